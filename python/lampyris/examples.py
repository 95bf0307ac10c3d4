"""A lamp to begin with."""

from __future__ import annotations

import pathlib

from . import _lampyris
from ._types import Path
from .errors import file_path


def write_demo(folder: Path = ".") -> str:
    """Writes the built-in three-cavity lamp, ``lamp.stp``, and its scene, ``lamp.toml``; gives the path of the scene."""
    place = pathlib.Path(file_path(folder, "folder"))
    place.mkdir(parents=True, exist_ok=True)
    step, scene = _lampyris.demo_files()
    (place / "lamp.stp").write_bytes(step)
    (place / "lamp.toml").write_text(scene, encoding="utf-8")
    return str(place / "lamp.toml")
