"""Models from STEP files."""

from __future__ import annotations

import json
import warnings
from typing import Any

from . import _html, _lampyris
from ._types import FaceTolerances, Path, Tolerance, Tolerances, tolerance_list, tolerance_range
from .errors import existing_file
from .mesh import Mesh
from .settings import flag, real_number

#: Units of length that models are made in: a picometre and a thousand kilometres.
SMALLEST_UNIT_MM, LARGEST_UNIT_MM = 1e-9, 1e9


class Account(dict[str, Any]):
    """What a file holds and what was refused: the object of ``lampyris info --json``."""

    def _repr_html_(self) -> str:
        faces = self["faces"]
        rows = [
            ("parts", self["parts"]),
            ("instances", self["instances"]),
            ("faces found", faces["found"]),
            ("converted", faces["converted"]),
            ("repaired", faces["repaired"]),
            ("refused", faces["refused"]),
            ("unit of length", ", ".join(self["units"]["length"])),
        ]
        rows += [(f"refused #{r['id']} {r['entity']}", r["reason"]) for r in self["refusals"]]
        return _html.table((self["file"], ""), rows)


class Model:
    """Trimmed splines as a STEP file holds them, placed, in mm; made by :func:`read_step`."""

    def __init__(self, core: _lampyris.Model) -> None:
        if not isinstance(core, _lampyris.Model):
            raise TypeError("a Model is made by lampyris.read_step(path), not by its name")
        self._core = core

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name

    @property
    def path(self) -> str:
        """Where it was read from."""
        return str(self._core.path)

    @property
    def unit_mm(self) -> float | None:
        """Millimetres per length unit, where the file's own was overruled."""
        return self._core.unit_mm

    @property
    def parts(self) -> list[str]:
        """Names of its parts."""
        return self._core.parts

    def account(self) -> Account:
        """Faces read, units, what was refused and why."""
        return Account(json.loads(self._core.account_json()))

    def faces(self) -> list[dict[str, Any]]:
        """Every face with what a selector can tell it by: part, solid, id, name, colour, kind, radius, area, box, a point on it."""
        parts = json.loads(self._core.faces_json())
        return [
            {"part": part["name"], "solid": solid["index"], **face}
            for part in parts
            for solid in part["solids"]
            for face in solid["faces"]
        ]

    def tessellate(
        self,
        tolerance: Tolerance | None = None,
        *,
        angle_deg: float | None = None,
        parts: Tolerances | None = None,
        faces: FaceTolerances | None = None,
        measure: bool = False,
    ) -> Mesh:
        """Quad facets within a proved distance of the splines.

        ``tolerance`` is one length or two in mm, tight where curved and loose where flat, (0.05, 0.2) unless said otherwise; ``parts``
        overrules it by name, ``faces`` by name or ``#id`` in the file (``{3979: 0.01}``). ``angle_deg`` is the largest angle between facet
        and surface normal. ``measure`` samples the distance too.
        """
        asked = None if tolerance is None else tolerance_range(tolerance)
        angle = None if angle_deg is None else real_number("angle_deg", angle_deg)
        of_parts, of_faces = tolerance_list(parts, "parts"), tolerance_list(faces, "faces")
        return Mesh(self._core.tessellate(asked, angle, of_parts, of_faces, flag("measure", measure)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _read_again, (self.path, self.unit_mm, self._core.hash)

    def __deepcopy__(self, _memo: dict[int, Any]) -> Model:
        # Nothing of it can be changed.
        return self

    def __repr__(self) -> str:
        return repr(self._core)

    def _repr_html_(self) -> str:
        return self.account()._repr_html_()


def read_step(path: Path, unit_mm: float | None = None) -> Model:
    """Reads a STEP file; a face that cannot be converted is refused with a reason and stops nothing.

    ``unit_mm`` overrules the file's unit of length. What could not be read, such as the end of a file that was cut off, is told by warnings.
    Raises :class:`InputError` when the file cannot be read or is not STEP.
    """
    unit = None if unit_mm is None else real_number("unit_mm", unit_mm)
    if unit is not None and not SMALLEST_UNIT_MM <= unit <= LARGEST_UNIT_MM:
        raise _lampyris.SceneError(f"unit_mm = {unit}: it must be from {SMALLEST_UNIT_MM} to {LARGEST_UNIT_MM} mm, as 25.4 for inches")
    model = _lampyris.read_step(existing_file(path), unit)
    for sentence in model.reading_notes():
        warnings.warn(sentence, stacklevel=2)
    return Model(model)


def _read_again(path: str, unit_mm: float | None, known_hash: str) -> Model:
    """The model of a file that was pickled by its path."""
    model = read_step(path, unit_mm)
    if model._core.hash != known_hash:
        raise _lampyris.InputError(f"{path}: the file is another one since the model was pickled; read it with lampyris.read_step")
    return model
