"""Types that several modules take."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]
Vector = Sequence[float]
Tolerance = Union[float, Sequence[float]]
Tolerances = Mapping[str, Tolerance]
Table = dict[str, Any]


def tolerance_range(tolerance: Tolerance) -> tuple[float, float]:
    """A range of tolerances from one number or two, mm."""
    if isinstance(tolerance, (int, float)):
        return (float(tolerance), float(tolerance))
    if len(tolerance) != 2:
        raise ValueError(f"tolerance {tolerance!r}: write one number of mm or two, the tighter one first")
    return (float(tolerance[0]), float(tolerance[1]))


def tolerance_list(tolerances: Tolerances | None) -> list[tuple[str, tuple[float, float]]]:
    """Tolerances by name as the extension takes them."""
    return [(name, tolerance_range(t)) for name, t in (tolerances or {}).items()]


def table_to_json(tables: Table) -> str:
    """Tables as JSON for the extension; a number that is not finite, which JSON has not, stands as text under ``$float``."""

    def finite(value: Any) -> Any:
        if isinstance(value, float) and not math.isfinite(value):
            return {"$float": str(value)}
        if isinstance(value, dict):
            return {key: finite(x) for key, x in value.items()}
        return [finite(x) for x in value] if isinstance(value, list) else value

    return json.dumps(finite(tables), allow_nan=False)


def table_from_json(text: str) -> Table:
    """Tables from JSON of the extension."""

    def number(table: Table) -> Any:
        return float(table["$float"]) if set(table) == {"$float"} else table

    return dict(json.loads(text, object_hook=number))


def plain(value: Any) -> Any:
    """Numbers and lists of NumPy as those of Python, for a table."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(x) for key, x in value.items() if x is not None}
    if isinstance(value, (list, tuple)):
        return [plain(x) for x in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value
