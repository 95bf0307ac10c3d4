"""A lamp to begin with."""

from __future__ import annotations

import pathlib

from . import _lampyris
from ._types import Path
from .errors import file_path, write_file


def write_demo(folder: Path = ".") -> str:
    """Writes the built-in three-cavity lamp, ``lamp.stp``, and its scene, ``lamp.toml``, into a folder, which is made; gives the path of
    the scene.

    Raises ``FileExistsError``, and writes neither, where a file of that name holds something else.
    """
    place = pathlib.Path(file_path(folder, "folder"))
    place.mkdir(parents=True, exist_ok=True)
    step, scene = _lampyris.demo_files()
    contents = {place / "lamp.stp": step, place / "lamp.toml": scene.encode()}
    missing = {file: content for file, content in contents.items() if not _holds(file, content)}
    for file, content in missing.items():
        write_file(file, content)
    return str(place / "lamp.toml")


def _holds(file: pathlib.Path, content: bytes) -> bool:
    """Whether a file of this content is there; ``FileExistsError`` for one of another."""
    if not file.exists():
        return False
    if not file.is_file() or file.read_bytes() != content:
        raise FileExistsError(f"{file}: it is there already and is not the demo's; name another folder, or move it away")
    return True
