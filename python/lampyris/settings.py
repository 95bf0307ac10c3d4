"""The settings of a trace beside the scene, checked before any work."""

from __future__ import annotations

import math
import numbers
from typing import Any

import numpy as np

from ._types import tolerance_list, tolerance_range

#: Settings of a trace that are none of the scene's own.
Settings = dict[str, Any]

#: Most rays of a run.
MOST_RAYS = 20_000_000_000_000
#: Seeds are unsigned integers of 64 bits.
LARGEST_SEED = (1 << 64) - 1
#: Numbers of threads are unsigned integers of 32 bits at least; no more than 16 for each core are started.
MOST_THREADS = (1 << 32) - 1

TOLERANCES = ("parts", "faces", "roles")
ANGLES = ("angle_deg", "accuracy_deg")
WORDS = ("normals", "intersector")
NAMES = ("rays", "seed", "threads", "tolerance", *ANGLES, *TOLERANCES, *WORDS)


def whole_number(name: str, value: Any, least: int, most: int | None) -> int:
    """A whole number between ``least`` and ``most``, or from ``least`` on; ``1e6`` is one."""
    is_number = isinstance(value, numbers.Real) and not isinstance(value, bool)
    if not is_number:
        raise TypeError(f"{name}: a whole number is needed, not {value!r}")
    # NaN lies in no range, and infinity has no whole part.
    is_within = least <= value < math.inf and (most is None or value <= most)
    if not is_within or value != int(value):
        limit = "" if most is None else f" and at most {most}"
        raise ValueError(f"{name} = {value!r}: it must be a whole number, at least {least}{limit}")
    return int(value)


def real_number(name: str, value: Any) -> float:
    """A number."""
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        raise TypeError(f"{name}: a number is needed, not {value!r}")
    return float(value)


def flag(name: str, value: Any) -> bool:
    """``True`` or ``False``."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name}: True or False is needed, not {value!r}")
    return bool(value)


def word(name: str, value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise TypeError(f"{name}: a text is needed, not {value!r}")
    return value


def count_of_threads(threads: Any) -> int | None:
    """A number of threads, or ``None`` for all."""
    return None if threads is None else min(whole_number("threads", threads, 1, None), MOST_THREADS)


def trace_settings(asked: Settings) -> Settings:
    """The keywords of :meth:`Scene.trace` as the extension takes them; ``TypeError`` or ``ValueError`` for what is none."""
    for name in asked:
        if name in ("until", "resume"):
            raise TypeError(f"{name} is for Scene.trace alone; here the number of rays is given")
        if name not in NAMES:
            raise TypeError(f"{name} is no setting of a trace; there are {', '.join(NAMES)}")
    given = {name: value for name, value in asked.items() if value is not None}
    made: Settings = {
        # In the extension the first ray stands before their number; a run has all of them.
        "rays": (None, whole_number("rays", given["rays"], 1, MOST_RAYS)) if "rays" in given else None,
        "seed": whole_number("seed", given["seed"], 0, LARGEST_SEED) if "seed" in given else None,
        "threads": count_of_threads(given.get("threads")),
        "tolerance": tolerance_range(given["tolerance"]) if "tolerance" in given else None,
    }
    made |= {name: real_number(name, given[name]) if name in given else None for name in ANGLES}
    made |= {name: word(name, given[name]) if name in given else None for name in WORDS}
    # The extension names one of each: part, face, role.
    return made | {name[:-1]: tolerance_list(given.get(name), name) for name in TOLERANCES}
