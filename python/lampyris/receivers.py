"""Where light is counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._types import Cells, Table, Vector, plain, require_given
from .settings import real_number, word


@dataclass(frozen=True)
class ReceiverTable:
    """Keys of a ``[[receiver]]``."""

    #: Its keys in the scene file.
    table: Table


def _receiver(kind: str, name: str, keys: dict[str, Any], **own: Any) -> ReceiverTable:
    word("name", name)
    require_given(kind, own)
    return ReceiverTable(plain({"name": name, "kind": kind, **own, **keys}))


def plane(
    name: str,
    at: Vector,
    normal: Vector = (0.0, 0.0, 1.0),
    size: Vector = (100.0, 100.0),
    cells: Cells = (100, 100),
    **keys: Any,
) -> ReceiverTable:
    """A rectangle in space, power per area; light ends there unless ``absorbs=False``."""
    return _receiver("plane", name, keys, at=at, normal=normal, size=size, cells=cells)


def far_field(
    name: str,
    h_deg: Vector | None = None,
    v_deg: Vector | None = None,
    cells: Cells | None = None,
    step_deg: float | None = None,
    **keys: Any,
) -> ReceiverTable:
    """All light that leaves the scene by direction, power per solid angle.

    An angle that is not given goes from −90° to 90°; with ``angles="C"``, C from 0° to 360° and γ from 0° to 180°.
    The map has ``cells``, or whole cells that come closest to ``step_deg``: of 7° over 180° there are 26, of 6.92°.
    """
    if step_deg is not None:
        if cells is not None:
            raise ValueError(f"far_field: cells = {cells!r} and step_deg = {step_deg!r} both say how fine it is; leave one out")
        if not real_number("step_deg", step_deg) > 0.0:
            raise ValueError(f"step_deg = {step_deg}: it must be positive")
        whole = ((0.0, 360.0), (0.0, 180.0)) if keys.get("angles") == "C" else ((-90.0, 90.0), (-90.0, 90.0))
        ranges = [unset if ends is None else ends for ends, unset in zip((h_deg, v_deg), whole)]
        for axis, ends in zip(("h_deg", "v_deg"), ranges):
            if not np.isfinite(np.asarray(ends, dtype=float)).all() or np.shape(ends) != (2,):
                raise ValueError(f"{axis} = {ends!r}: two finite angles are needed, as (-40, 40)")
        cells = [max(1, round((high - low) / step_deg)) for low, high in ranges]
    return _receiver("far_field", name, keys, h_deg=h_deg, v_deg=v_deg, cells=cells)


def disc(
    name: str,
    at: Vector,
    radius: float,
    normal: Vector = (0.0, 0.0, 1.0),
    cells: Cells = (100, 100),
    **keys: Any,
) -> ReceiverTable:
    """A round detector in space, power per area; ``cells`` are those of the square around it."""
    return _receiver("disc", name, keys, at=at, normal=normal, radius=radius, cells=cells)


def sphere(name: str, at: Vector, radius: float, cells: Cells = (180, 90), **keys: Any) -> ReceiverTable:
    """A sphere in space by direction from its centre, power per area."""
    return _receiver("sphere", name, keys, at=at, radius=radius, cells=cells)


def absorbed(name: str, part: str | Sequence[str] | None = None, **keys: Any) -> ReceiverTable:
    """What the faces of a part absorb."""
    return _receiver("absorbed", name, keys, part=part, cells=[1, 1])
