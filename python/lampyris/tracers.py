"""Octree, BVH and spline, asked about arrays of rays."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _lampyris
from ._lampyris import Hits
from .mesh import Mesh
from .model import Model
from .settings import count_of_threads, flag, real_number, word


class _Tracer:
    def __init__(self, core: _lampyris.Tracer, made_of: tuple[Any, ...]) -> None:
        self._core = core
        #: What it is built of anew where it is unpickled.
        self._made_of = made_of

    def intersect(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        *,
        t_min: float = 0.0,
        t_max: float = math.inf,
        threads: int | None = None,
    ) -> Hits:
        """Nearest hits of rays from ``origins`` (n, 3) along ``directions`` (n, 3), in mm.

        Arrays of float64 in one piece are read where they lie, read-only ones too; other numbers are converted first. Directions are
        brought to unit length. ``ValueError`` names the first ray that cannot be traced, and why. Ctrl-C ends the call.
        """
        ends = (real_number("t_min", t_min), real_number("t_max", t_max))
        return self._core.intersect(origins, directions, *ends, count_of_threads(threads))

    @property
    def bytes(self) -> int:
        """Bytes held, without mesh and model."""
        return self._core.bytes

    @property
    def primitives(self) -> int:
        """Facets or patches."""
        return self._core.primitives

    @property
    def build_seconds(self) -> float:
        """Seconds that building took."""
        return self._core.build_seconds

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._made_of

    def __deepcopy__(self, _memo: dict[int, Any]) -> Any:
        # Nothing of it can be changed.
        return self

    def __repr__(self) -> str:
        return repr(self._core)


class Octree(_Tracer):
    """The octree over the facets of a mesh.

    ``normals`` is how the normal at a hit is computed: flat, nearest, bilinear or cubic; with ``exact`` every hit is moved to the spline of
    ``model``.
    """

    def __init__(self, mesh: Mesh, normals: str = "bilinear", model: Model | None = None) -> None:
        super().__init__(_on_facets("Octree", "octree", mesh, normals, model), (mesh, normals, model))


class Bvh(_Tracer):
    """A hierarchy of boxes over the facets of a mesh: eight-wide, or binary with ``wide=False``."""

    def __init__(
        self, mesh: Mesh, normals: str = "bilinear", model: Model | None = None, *, wide: bool = True
    ) -> None:
        super().__init__(_on_facets("Bvh", "cwbvh" if flag("wide", wide) else "bvh2", mesh, normals, model), (mesh, normals, model))
        self._wide = wide

    def __reduce__(self) -> tuple[Any, ...]:
        return partial(Bvh, wide=self._wide), self._made_of


class Exact(_Tracer):
    """The splines of a model themselves; every hit says whether it is proved to be the first."""

    def __init__(self, model: Model) -> None:
        if not isinstance(model, Model):
            raise TypeError(f"Exact takes a Model, not {type(model).__name__}; read one with lampyris.read_step")
        super().__init__(_lampyris.Tracer.from_model(model._core), (model,))


def _on_facets(what: str, kind: str, mesh: Mesh, normals: str, model: Model | None) -> _lampyris.Tracer:
    if not isinstance(mesh, Mesh):
        advice = "make one with model.tessellate(), Mesh.from_arrays, from_trimesh or from_pyvista"
        raise TypeError(f"{what} takes a Mesh, not {type(mesh).__name__}; {advice}")
    if model is not None and not isinstance(model, Model):
        raise TypeError(f"model: a Model is needed, not {type(model).__name__}; give the one whose tessellate() made the mesh")
    return _lampyris.Tracer.of_mesh(mesh._core, kind, word("normals", normals), None if model is None else model._core)
