"""Writes ``api.md`` from the docstrings: ``python docs/generate_api.py``; with ``--check`` it only compares."""

from __future__ import annotations

import inspect
import pathlib
import re
import sys
from typing import Any

import lampyris
import lampyris.distributed

PAGE = pathlib.Path(__file__).with_name("api.md")

#: Names of types in the signatures, and what they stand for.
TYPES = {
    "Path": "A `str` or `os.PathLike`.",
    "Vector": "Numbers in a list, tuple or array: three of a point (mm) or direction, two of sides (mm) or of a range of angles (degrees).",
    "Cells": "Two whole numbers: cells along the first and the second axis.",
    "Tolerance": "A length in mm, or two, the tighter one first: `0.1`, `(0.05, 0.2)`.",
    "Tolerances": "A dict of tolerances by name: `{'cover': 0.01}`.",
    "FaceTolerances": "A dict of tolerances by name of the face, or by its `#id` in the file: `{'lens': 0.01, 3979: (0.01, 0.05)}`.",
    "Grid": "Rows of numbers, as a list of lists or an array.",
    "Reflectance": "A share from 0 to 1, or rows `[angle_deg, share]` or `[angle_deg, nm, share]` over a full grid.",
    "Table": "A dict with the keys of a table of the scene file.",
    "FloatArray": "A NumPy array of float64.",
    "ProgressCallback": "A function `f(stage, done, total, messages)`: `done` and `total` are rays in the stages `tracing` and `checking`, "
    "thousandths of the work in others, a total of 0 is not known yet, `messages` is a list of sentences. It stops the work by raising.",
    "Settings": "A dict: `rays`, `seed`, `threads`, `tolerance_mm`, `facets`, `intersector`, `normals`, `unit`, `chosen`, `notes`, `accounts`.",
}


def signature(thing: Any) -> str:
    try:
        return str(inspect.signature(thing)).replace("lampyris.", "")
    except (TypeError, ValueError):
        return ""


def entry(name: str, thing: Any, level: str) -> list[str]:
    text = inspect.getdoc(thing) or ""
    is_callable = callable(thing) and not isinstance(thing, type)
    return [f"{level} `{name}{signature(thing) if is_callable else ''}`", "", text, ""]


def members(thing: type) -> list[tuple[str, Any]]:
    public = [(n, m) for n, m in inspect.getmembers(thing) if not n.startswith("_")]
    own = {n for base in thing.__mro__ if base.__module__.startswith("lampyris") for n in vars(base)}
    return [(n, m) for n, m in public if n in own]


def attributes(thing: type) -> list[tuple[str, str]]:
    """What a class sets below a comment that begins with ``#:``, with the words of that."""
    found, words = [], []
    try:
        lines = inspect.getsource(thing).splitlines()
    except (OSError, TypeError):
        # Those of the extension are properties.
        return []
    for line in lines:
        text = line.strip()
        if text.startswith("#:"):
            words.append(text.removeprefix("#:").strip())
            continue
        name = re.match(r"(?:self\.)?(\w+)\b *[:=]", text)
        if name and words and not name[1].startswith("_"):
            found.append((name[1], " ".join(words)))
        words = []
    return found


def page() -> str:
    lines = ["# Every name", "", "Written by `docs/generate_api.py` from the docstrings.", ""]
    things = [(f"lampyris.{n}", getattr(lampyris, n)) for n in sorted(lampyris.__all__)]
    things = [(n, t) for n, t in things if not isinstance(t, str) and not inspect.ismodule(t)]
    studies = [(f"lampyris.study.{n}", getattr(lampyris.study, n)) for n in ("Study", "accuracy", "check", "interpolation")]
    shared = [("lampyris.distributed.trace", lampyris.distributed.trace)]
    lines += ["## Types in signatures", "", "| type | what it is |", "|---|---|"]
    lines += [f"| `{name}` | {meaning} |" for name, meaning in TYPES.items()] + [""]
    lines += ["## `lampyris.__version__`", "", "The version, as a text; that of the command.", ""]
    for name, thing in things + studies + shared:
        lines += entry(name, thing, "##")
        if isinstance(thing, type) and thing.__module__.startswith("lampyris"):
            set_there = {member: text for base in reversed(thing.__mro__) for member, text in attributes(base)}
            known = {member: entry(f"{name}.{member}", value, "###") for member, value in members(thing)}
            known |= {member: [f"### `{name}.{member}`", "", text, ""] for member, text in set_there.items()}
            lines += [line for member in sorted(known) for line in known[member]]
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    made = page()
    if "--check" in sys.argv:
        sys.exit(0 if PAGE.exists() and PAGE.read_text(encoding="utf-8") == made else f"{PAGE} is not current: run {sys.argv[0]}")
    PAGE.write_text(made, encoding="utf-8")
