"""Files that are not there or cannot be written, and paths that are none."""

from __future__ import annotations

import errno
import os
from typing import Any

from ._lampyris import InputError


class MissingFileError(InputError, FileNotFoundError):
    """A file, or the folder of one that is to be written, is not there."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.errno = errno.ENOENT


def file_path(path: Any, name: str = "path") -> str:
    """A path as text; ``TypeError`` for what is none."""
    try:
        text = os.fspath(path)
    except TypeError:
        raise TypeError(f"{name}: a str or os.PathLike is needed, not {path!r}") from None
    if isinstance(text, bytes):
        raise TypeError(f"{name}: a str or os.PathLike is needed, not bytes; os.fsdecode({text!r}) makes one")
    return str(text)


def existing_file(path: Any, name: str = "path", what: str = "") -> str:
    """A path as text where a file is; :class:`InputError` for a folder, :class:`MissingFileError` for nothing."""
    text = file_path(path, name)
    doing = f"cannot read {what}" if what else "cannot be read"
    if os.path.isdir(text):
        raise InputError(f"{text}: {doing}: it is a folder; name a file in it")
    if not os.path.exists(text):
        raise MissingFileError(f"{text}: {doing}: there is no such file; check the path")
    return text


def write_file(path: Any, content: bytes | str) -> None:
    """Writes a file; :class:`InputError` where that cannot be, :class:`MissingFileError` without its folder."""
    text = writable_file(path)
    try:
        with open(text, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
    except OSError as e:
        raise InputError(f"{text}: cannot be written: {e.strerror}; check its folder and the permissions") from e


def writable_file(path: Any) -> str:
    """A path as text whose folder is there."""
    text = file_path(path)
    if os.path.isdir(text):
        raise InputError(f"{text}: cannot be written: it is a folder; name a file in it")
    folder = os.path.dirname(text)
    if folder and not os.path.isdir(folder):
        raise MissingFileError(f"{text}: cannot be written: there is no folder {folder}; make it first")
    return text
