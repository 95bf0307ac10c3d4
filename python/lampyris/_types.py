"""Types that several modules take."""

from __future__ import annotations

import json
import math
import numbers
import os
from collections.abc import Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]
Vector = Union[Sequence[float], npt.NDArray[Any]]
Cells = Union[Sequence[int], npt.NDArray[Any]]
Tolerance = Union[float, Sequence[float], npt.NDArray[Any]]
Tolerances = Mapping[str, Tolerance]
# Keys are names and numbers; a mapping's key type is invariant, and one that mixes both has none of its own.
FaceTolerances = Mapping[Any, Tolerance]
Grid = Union[Sequence[Sequence[float]], npt.NDArray[Any]]
Reflectance = Union[float, Grid]
Table = dict[str, Any]

#: Whole numbers of TOML have 64 bits with a sign.
LARGEST_NUMBER = (1 << 63) - 1


def tolerance_range(tolerance: Tolerance) -> tuple[float, float]:
    """A range of tolerances from one number or two, mm."""
    advice = f"tolerance {tolerance!r}: write one number of mm or two, the tighter one first"
    try:
        ends = np.atleast_1d(np.asarray(tolerance))
    except ValueError:
        raise ValueError(advice) from None
    is_bool = isinstance(tolerance, (list, tuple)) and any(isinstance(end, (bool, np.bool_)) for end in tolerance)
    if ends.shape not in ((1,), (2,)) or ends.dtype.kind not in "iuf" or is_bool:
        raise ValueError(advice)
    return (float(ends[0]), float(ends[-1]))


def tolerance_list(tolerances: FaceTolerances | None, name: str) -> list[tuple[str, tuple[float, float]]]:
    """Tolerances by name as the extension takes them; faces may be named by their ``#id`` in the file, as 17, "17" or "#17"."""
    if tolerances is None:
        return []
    words, example = ("names or numbers", "{'cover': 0.01, 17: 0.01}") if name == "faces" else ("names", "{'cover': 0.01}")
    advice = f"{name}: a dict of {words} and tolerances is needed, as {example}, not {tolerances!r}"
    if not isinstance(tolerances, Mapping):
        raise TypeError(advice)
    named: list[tuple[str, tuple[float, float]]] = []
    for key, tolerance in tolerances.items():
        if name == "faces" and isinstance(key, numbers.Integral) and not isinstance(key, bool):
            key = f"#{key}"
        if not isinstance(key, str):
            raise TypeError(advice)
        if key == "":
            by_number = "name them by number, as '#17', or " if name == "faces" else ""
            raise ValueError(f"{name}: '' is no name: it would stand for all that have none; {by_number}set `tolerance`")
        named.append((key, tolerance_range(tolerance)))
    return named


def table_to_json(tables: Table) -> str:
    """Tables as JSON for the extension; a number that is not finite, which JSON has not, stands as text under ``$float``."""

    def known(value: Any, place: str) -> Any:
        value = plain(value)
        if isinstance(value, float) and not math.isfinite(value):
            return {"$float": str(value)}
        if isinstance(value, dict):
            return {str(key): known(x, f"{place}.{key}" if place else str(key)) for key, x in value.items()}
        if isinstance(value, list):
            return [known(x, f"{place}[{k}]") for k, x in enumerate(value)]
        if isinstance(value, int) and not -LARGEST_NUMBER - 1 <= value <= LARGEST_NUMBER:
            advice = "; trace(seed=…) takes seeds up to 18446744073709551615" if place == "run.seed" else ""
            raise ValueError(f"{place} = {value}: whole numbers of a scene file are at most {LARGEST_NUMBER}{advice}")
        if not isinstance(value, (str, int, float)):
            raise TypeError(f"{place}: a scene holds numbers, texts, lists and tables, not {value!r} ({type(value).__name__})")
        return value

    try:
        return json.dumps(known(tables, ""), allow_nan=False)
    except RecursionError:
        raise ValueError("the tables of the scene hold themselves; leave that entry out") from None


def table_from_json(text: str) -> Table:
    """Tables from JSON of the extension."""

    def number(table: Table) -> Any:
        return float(table["$float"]) if set(table) == {"$float"} else table

    return dict(json.loads(text, object_hook=number))


def require_given(what: str, keys: Table) -> None:
    """``TypeError`` where a place or direction is ``None``: a scene would take its own."""
    for name in ("at", "direction", "normal"):
        if name in keys and keys[name] is None:
            raise TypeError(f"{what}: {name} = None: three numbers are needed")


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
