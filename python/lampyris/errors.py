"""Files that are not there or cannot be written, and paths that are none."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from contextlib import suppress
from typing import Any

from ._lampyris import InputError

#: Characters of its final name that an unfinished file has: of four bytes each, they and what follows stay below the 255 bytes of a name.
NAME_CHARACTERS = 50


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
    if not text:
        raise MissingFileError(f"{name}: '' names no file; check the path")
    doing = f"cannot read {what}" if what else "cannot be read"
    if os.path.isdir(text):
        raise InputError(f"{text}: {doing}: it is a folder; name a file in it")
    if not os.path.exists(text):
        raise MissingFileError(f"{text}: {doing}: there is no such file; check the path")
    return text


def write_file(path: Any, content: bytes | str) -> None:
    """Writes a file; :class:`InputError` where that cannot be, :class:`MissingFileError` without its folder.

    An older file of that name is replaced once the new one is whole, with its permissions kept; behind a link it is that file which is
    replaced. A pipe or device is written as it is.
    """
    text = writable_file(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        if os.path.exists(text) and not os.path.isfile(text):
            with open(text, "wb") as stream:
                stream.write(data)
        else:
            _replace_file(os.path.realpath(text), data)
    except OSError as e:
        raise InputError(f"{text}: cannot be written: {e.strerror}; check its folder and the permissions") from e


def _replace_file(target: str, data: bytes) -> None:
    """Writes a file beside its final name and renames it when it is whole; ``OSError`` leaves an older file as it was."""
    mode = stat.S_IMODE(os.stat(target).st_mode) if os.path.exists(target) else None
    if mode is not None and not os.access(target, os.W_OK):
        # A rename would replace what its owner has protected.
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), target)
    folder, name = os.path.split(target)
    beside = os.path.join(folder, f".{name[:NAME_CHARACTERS]}.{secrets.token_hex(8)}.part")
    file = open(beside, "xb")
    try:
        with file:
            if mode is not None:
                # Before anything is in it: what its owner alone may read stays so. Some file systems have no permissions.
                with suppress(OSError):
                    os.chmod(beside, mode)
            file.write(data)
        os.replace(beside, target)
    except BaseException:
        with suppress(OSError):
            os.unlink(beside)
        raise


def writable_file(path: Any) -> str:
    """A path as text whose folder is there."""
    text = file_path(path)
    if os.path.isdir(text):
        raise InputError(f"{text}: cannot be written: it is a folder; name a file in it")
    folder = os.path.dirname(text)
    if folder and not os.path.isdir(folder):
        raise MissingFileError(f"{text}: cannot be written: there is no folder {folder}; make it first")
    return text
