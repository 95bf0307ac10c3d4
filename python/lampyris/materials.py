"""What faces are made of, and which faces are meant."""

from __future__ import annotations

import numbers
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ._types import Grid, Reflectance, Table, Vector, plain
from .settings import real_number


@dataclass(frozen=True)
class Selector:
    """Faces of a model: all selectors that are given must hold; ``*`` in a name stands for anything."""

    #: Its keys in the scene file.
    table: Table = field(default_factory=dict)


def select(
    *,
    part: str | Sequence[str] | None = None,
    solid: int | str | Sequence[int | str] | None = None,
    instance: str | Sequence[str] | None = None,
    face: str | Sequence[str] | None = None,
    colour: str | Vector | None = None,
    layer: str | Sequence[str] | None = None,
    kind: str | Sequence[str] | None = None,
    radius_mm: float | Sequence[float] | None = None,
    entity: int | Sequence[int] | None = None,
    at: Vector | Sequence[Vector] | None = None,
) -> Selector:
    """Faces by part, solid (its number in the part, from 0, or its name), instance, name, colour, layer, kind and radius of surface,
    ``#id`` in the file, or nearest to points (mm)."""
    given = {
        "part": part, "solid": solid, "instance": instance, "face": face, "colour": colour, "layer": layer, "kind": kind,
        "radius_mm": radius_mm, "entity": entity, "at": at,
    }
    if all(value is None for value in given.values()):
        raise ValueError(f"select: say which faces, by one of {', '.join(given)}; all faces of a part are scene[part]")
    return Selector(plain(given))


@dataclass(frozen=True)
class Material:
    """Keys of a rule ``[[material]]``, and the medium that it brings along."""

    #: Its keys in the scene file.
    table: Table
    #: The table of the medium that it brings along, where it does.
    medium: Table | None = None


def mirror(reflectance: Reflectance = 1.0, scatter: Table | None = None) -> Material:
    """A mirror of this share, or of a table ``[[angle_deg, share], …]`` or ``[[angle_deg, nm, share], …]``."""
    return _reflecting("mirror", reflectance, scatter=scatter)


def diffuse(reflectance: Reflectance = 1.0) -> Material:
    """Reflects this share by Lambert's law, or that of a table ``[[angle_deg, share], …]`` or ``[[angle_deg, nm, share], …]``."""
    return _reflecting("diffuse", reflectance)


def _reflecting(surface: str, reflectance: Reflectance, **keys: Any) -> Material:
    """``TypeError`` for a reflectance that is ``None``: a scene would take its own."""
    if reflectance is None:
        raise TypeError(f"{surface}: reflectance = None: a share from 0 to 1 is needed, or a table of shares")
    return Material(plain({"surface": surface, "reflectance": reflectance, **keys}))


def absorber() -> Material:
    """Light ends here."""
    return Material({"surface": "absorber"})


def interface() -> Material:
    """The bare boundary of a medium."""
    return Material({"surface": "interface"})


def metal(n: float, k: float) -> Material:
    """A polished metal of the index n + ik."""
    return Material({"surface": "metal", "metal": [real_number("n", n), real_number("k", k)]})


def coating(
    reflectance: Reflectance | None = None,
    transmittance: float | None = None,
    rows: Grid | None = None,
) -> Material:
    """A coated boundary: shares, or rows ``[angle_deg, nm, R, T]`` or ``[angle_deg, nm, Rs, Rp, Ts, Tp]`` over a full grid.

    ``reflectance`` may be a table, as that of :func:`mirror`.
    """
    if reflectance is None and transmittance is None and rows is None:
        raise ValueError("coating: say what it does, by reflectance and transmittance or by rows; what takes all light is absorber()")
    keys = {"surface": "coating", "reflectance": reflectance, "transmittance": transmittance, "coating": rows}
    return Material(plain(keys))


def glass(medium: str | float, **keys: Any) -> Material:
    """A body of a transparent medium: a name of the catalogue (see :func:`media`) or an index; ``keys`` are those of ``[[medium]]``."""
    if isinstance(medium, str) and not keys:
        return Material({"medium": medium})
    if not isinstance(medium, (str, numbers.Real)) or isinstance(medium, bool):
        raise TypeError(f"glass: a name of lampyris.media() or an index is needed, as glass(1.49), not {medium!r}")
    twice = sorted({"name", "index", "catalogue"} & set(keys))
    if twice:
        raise ValueError(f"glass: {medium!r} says which glass it is already; leave {', '.join(twice)} out, or use scene.medium(name, …)")
    # A name that tells it from the catalogue's own, and from every other index.
    own = {"catalogue": medium} if isinstance(medium, str) else {"index": float(medium)}
    name = ", ".join(f"{key} {value}" for key, value in {**own, **keys}.items())
    return Material({"medium": name}, plain({"name": name, **own, **keys}))
