"""CAD surfaces straight to optical simulation, the same bits from a notebook as from the command.

    import lampyris as lp

    scene = lp.Scene("lamp.step", unit="lm")
    scene["reflector"] = lp.mirror(0.92)
    scene.add(lp.led(at=(0, 0, 5), size=(1, 1), power=1000))
    scene.add(lp.far_field("far", h_deg=(-40, 40), v_deg=(-20, 20), step_deg=0.5))
    run = scene.trace(until="1%@far")
    run["far"].candela, run["far"].statistical, run["far"].geometric

Lengths are mm, angles degrees, powers watts (or lumens, where the scene says ``unit="lm"``).
"""

from . import study
from ._lampyris import Defect, Hits, InputError, SceneError, __version__
from .errors import MissingFileError
from .examples import write_demo
from .materials import Material, Selector, coating, diffuse, glass, absorber, interface, metal, mirror, select
from .mesh import Mesh
from .model import Account, Model, read_step
from .part import Interrupted, Part
from .receivers import ReceiverTable, absorbed, disc, far_field, plane, sphere
from .results import Ends, Figure, LostLightWarning, Receiver, Run
from .scene import Scene, media, scene_schema
from .sources import Source, collimated, cone, cosine, eulumdat, ies, lambertian, led, point, ray_file, rays
from .tracers import Bvh, Exact, Octree
from .verdicts import Assessment, regulations

__all__ = [
    "Account", "Assessment", "Bvh", "Defect", "Ends", "Exact", "Figure", "Hits", "InputError", "Interrupted",
    "LostLightWarning", "Material", "Mesh", "MissingFileError", "Model", "Octree", "Part", "Receiver", "ReceiverTable",
    "Run", "Scene", "SceneError", "Selector", "Source", "__version__", "absorbed", "absorber", "coating", "collimated",
    "cone", "cosine", "diffuse", "disc", "eulumdat", "far_field", "glass", "ies", "interface", "lambertian", "led", "media",
    "metal", "mirror", "plane", "point", "ray_file", "rays", "read_step", "regulations", "scene_schema", "select", "sphere",
    "study", "write_demo",
]
