"""Where light comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._types import FloatArray, Path, Table, Vector, plain, require_given
from .errors import file_path
from .materials import Selector

#: Wavelengths of light that a scene may have, nm.
SHORTEST_NM, LONGEST_NM = 1.0, 1e6


@dataclass(frozen=True)
class Source:
    """Keys of a ``[[source]]``, and its rays where they came as an array."""

    #: Its keys in the scene file.
    table: Table
    #: Its rays, where they came as an array, (n, 7) or (n, 8).
    rays: FloatArray | None = None


def _source(kind: str, keys: dict[str, Any], **own: Any) -> Source:
    require_given(kind, own)
    return Source(plain({"kind": kind, **own, **keys}))


def _where(name: str, on: Selector | Table | None, at: Vector | None, direction: Vector | None) -> Table:
    """Keys of where light starts: on faces, along their normals, or at a place in a direction."""
    if on is None:
        if at is None or direction is None:
            raise TypeError(f"{name}: say where light starts, by `at` and `direction`, or by `on` for faces of the model")
        return {"at": at, "direction": direction}
    if at is not None or direction is not None:
        raise TypeError(f"{name}: light starts on faces, along their normals; leave `at` and `direction` out, or `on`")
    return {"on": on.table if isinstance(on, Selector) else on}


def point(at: Vector, power: float = 1.0, **keys: Any) -> Source:
    """The same in every direction."""
    return _source("point", keys, at=at, power=power)


def cone(
    at: Vector | None = None,
    direction: Vector | None = None,
    half_angle_deg: float | None = None,
    power: float = 1.0,
    *,
    on: Selector | Table | None = None,
    **keys: Any,
) -> Source:
    """The same in every direction within an angle of ``direction``, or of the normals of the faces it is ``on``."""
    return _source("cone", keys, half_angle_deg=half_angle_deg, power=power, **_where("cone", on, at, direction))


def collimated(at: Vector, direction: Vector, radius: float | None = None, power: float = 1.0, **keys: Any) -> Source:
    """A beam from a disc of ``radius`` or a rectangle of ``size``, mm."""
    return _source("collimated", keys, at=at, direction=direction, radius=radius, power=power)


def lambertian(
    at: Vector | None = None,
    direction: Vector | None = None,
    power: float = 1.0,
    *,
    on: Selector | Table | None = None,
    **keys: Any,
) -> Source:
    """Intensity proportional to the cosine to ``direction``, from a point, a disc (``radius``), a rectangle (``size``), or faces it is ``on``."""
    return _source("lambertian", keys, power=power, **_where("lambertian", on, at, direction))


def cosine(at: Vector, direction: Vector, exponent: float, power: float = 1.0, **keys: Any) -> Source:
    """Intensity proportional to a power of the cosine to ``direction``."""
    return _source("cosine", keys, at=at, direction=direction, exponent=exponent, power=power)


def led(
    at: Vector = (0.0, 0.0, 0.0),
    direction: Vector = (0.0, 0.0, 1.0),
    size: Vector = (1.0, 1.0),
    power: float = 1.0,
    **keys: Any,
) -> Source:
    """The die of an LED: a rectangle that shines by Lambert's law."""
    return _source("lambertian", keys, at=at, direction=direction, size=size, power=power)


def ies(file: Path, at: Vector = (0.0, 0.0, 0.0), direction: Vector = (0.0, 0.0, 1.0), **keys: Any) -> Source:
    """The intensity of an IES LM-63 file, in lumens unless ``power`` is given."""
    return _source("ies", keys, file=file_path(file, "file"), at=at, direction=direction)


def eulumdat(file: Path, at: Vector = (0.0, 0.0, 0.0), direction: Vector = (0.0, 0.0, 1.0), **keys: Any) -> Source:
    """The intensity of a EULUMDAT file, in lumens unless ``power`` is given."""
    return _source("eulumdat", keys, file=file_path(file, "file"), at=at, direction=direction)


def ray_file(file: Path, at: Vector = (0.0, 0.0, 0.0), **keys: Any) -> Source:
    """The rays of a file: TM-25, Zemax, LightTools, NPZ, or CSV with the columns ``x,y,z,dx,dy,dz,power`` and perhaps ``wavelength_nm``."""
    return _source("rays", keys, file=file_path(file, "file"), at=at)


def rays(array: npt.ArrayLike, at: Vector = (0.0, 0.0, 0.0), **keys: Any) -> Source:
    """Rays of an array: (n, 7) of origin (mm), direction and power, or (n, 8) with the wavelength in nm too."""
    try:
        given = np.asarray(array)
    except ValueError as e:
        raise ValueError(f"rays: an array of shape (n, 7) or (n, 8) is needed: {e}") from None
    if given.dtype.kind not in "fiu":
        raise TypeError(f"rays: an array of numbers with shape (n, 7) or (n, 8) is needed, not of {given.dtype}")
    if given.ndim != 2 or given.shape[1] not in (7, 8):
        raise ValueError(f"rays: the shape must be (n, 7) or (n, 8), not {given.shape}; the columns are x, y, z, dx, dy, dz, power, nm")
    if np.ma.is_masked(array):
        raise ValueError("rays: some numbers are masked; leave such rows out with array[~numpy.ma.getmaskarray(array).any(axis=1)]")
    if not np.isfinite(given).all():
        row = int(np.argwhere(~np.isfinite(given))[0, 0])
        raise ValueError(f"rays[{row}] holds a number that is not finite; leave such rows out")
    if given.shape[1] == 8 and not ((given[:, 7] >= SHORTEST_NM) & (given[:, 7] <= LONGEST_NM)).all():
        row = int(np.argmin((given[:, 7] >= SHORTEST_NM) & (given[:, 7] <= LONGEST_NM)))
        advice = f"it must be from {SHORTEST_NM:g} to {LONGEST_NM:g} nm; one in µm is a thousand times as many nm"
        raise ValueError(f"rays[{row}] has the wavelength {given[row, 7]:g} nm: {advice}")
    require_given("rays", {"at": at})
    table = plain({"kind": "rays", "at": at, **keys})
    # A copy: what is written into the caller's array later is no part of the source.
    return Source(table, np.array(given, dtype=np.float64, order="C"))
