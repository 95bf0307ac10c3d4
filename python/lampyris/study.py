"""What accuracy costs: studies whose rows come as arrays."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _lampyris
from ._types import Tolerance, tolerance_range
from .model import Model
from .progress import ProgressCallback, callback
from .settings import LARGEST_SEED, MOST_RAYS, count_of_threads, whole_number

#: Most rounds of a measurement.
MOST_REPETITIONS = 1_000_000


class Study(dict[str, npt.NDArray[Any]]):
    """The rows of a study by column, an array each; ``answer`` says in a sentence what came of it."""

    def __init__(self, document: dict[str, Any]) -> None:
        rows = document.get("rows", [])
        names = list(rows[0]) if rows else []
        super().__init__({name: _column([row[name] for row in rows]) for name in names})
        #: The whole document, as ``study.json`` has it.
        self.document = document
        #: A sentence on what came of it.
        self.answer: str = document.get("answer", "").replace("**", "")

    def to_frame(self) -> Any:
        """A ``pandas.DataFrame``."""
        import pandas

        return pandas.DataFrame(dict(self))

    def __repr__(self) -> str:
        rows = self.document.get("rows", [])
        return f"<lampyris.Study: {len(rows)} rows of {', '.join(self) or 'nothing'}>"

    def _repr_html_(self) -> str:
        from . import _html

        rows = zip(*(column.tolist() for column in self.values()))
        return f"<p>{escape(self.answer)}</p>" + _html.table(list(self), rows)


def _column(values: list[Any]) -> npt.NDArray[Any]:
    numbers = [v for v in values if v is not None]
    if numbers and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in numbers):
        return np.array([np.nan if v is None else v for v in values])
    return np.array(values)


def _study(
    kind: str,
    model: Model,
    tolerances: Sequence[Tolerance],
    normals: Sequence[str] | None,
    rays: int | None,
    repetitions: int | None,
    seed: int,
    threads: int | None,
    progress: bool | ProgressCallback,
) -> dict[str, Any]:
    if not isinstance(model, Model):
        raise TypeError(f"a study takes a Model, not {type(model).__name__}; read one with lampyris.read_step")
    if not isinstance(tolerances, Iterable):
        raise TypeError(f"tolerances: a list is needed, as [{tolerances!r}]")
    ranges = [tolerance_range(t) for t in tolerances]
    names = [normals] if isinstance(normals, str) else None if normals is None else list(normals)
    count = None if rays is None else whole_number("rays", rays, 1, MOST_RAYS)
    rounds = None if repetitions is None else whole_number("repetitions", repetitions, 1, MOST_REPETITIONS)
    key, cores = whole_number("seed", seed, 0, LARGEST_SEED), count_of_threads(threads)
    tell, close = callback(progress)
    try:
        text = _lampyris.study(kind, model._core, model.name, ranges, names, count, rounds, key, cores, tell)
    finally:
        close()
    return dict(json.loads(text))


def accuracy(
    model: Model,
    tolerances: Sequence[Tolerance] = (),
    *,
    normals: Sequence[str] | None = None,
    rays: int | None = None,
    repetitions: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | ProgressCallback = True,
) -> Study:
    """Tolerance × normals × intersector, each against the exact hits of the same rays: errors, seconds, bytes."""
    return Study(_study("accuracy", model, tolerances, normals, rays, repetitions, seed, threads, progress))


def interpolation(
    model: Model,
    *,
    rays: int | None = None,
    repetitions: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | ProgressCallback = True,
) -> Study:
    """Errors and seconds of the ways to get a normal on 20,000 facets, beside the published ones."""
    return Study(_study("interpolation", model, (), None, rays, repetitions, seed, threads, progress))


def check(
    model: Model,
    tolerance: Tolerance = (0.05, 0.2),
    *,
    rays: int = 100_000,
    seed: int = 1,
    threads: int | None = None,
    progress: bool | ProgressCallback = True,
) -> dict[str, Any]:
    """The same rays through octree, BVH and spline, with a cause for every difference, as ``lampyris check --json``."""
    document = _study("check", model, (tolerance,), None, rays, None, seed, threads, progress)
    document.pop("rows", None)
    return document
