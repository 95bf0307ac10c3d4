"""Files that are written: whole or as they were, whatever happens meanwhile."""

from __future__ import annotations

import errno
import os
import pathlib
import stat
import sys
from typing import Any

import pytest
from conftest import lamp

import lampyris as lp
from lampyris.errors import write_file

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="permissions, pipes and limits of POSIX")


def names(folder: pathlib.Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def no_space(*_: Any) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_older_file_outlives_a_full_disk(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = lamp(2000).trace_part(0, 2)
    file = tmp_path / "part.bin"
    part.save(file)
    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", no_space)
        with pytest.raises(lp.InputError, match="cannot be written: No space left on device"):
            lamp(2000).trace_part(1, 2).save(file)
        with pytest.raises(lp.InputError, match="cannot be written"):
            lamp(2000).save(file)
    assert file.read_bytes() == part.to_bytes() and names(tmp_path) == ["part.bin"]


@POSIX
def test_a_file_that_is_cut_off_while_it_is_written_replaces_nothing(tmp_path: pathlib.Path) -> None:
    import resource

    file = tmp_path / "results.json"
    write_file(file, "old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(lp.InputError, match="File too large"):
            write_file(file, bytes(5000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert file.read_text() == "old" and names(tmp_path) == ["results.json"]


def test_whatever_ends_the_writing_takes_the_unfinished_file_away(tmp_path: pathlib.Path) -> None:
    wrong: Any = 3
    for name in ("new", "old"):
        (tmp_path / "old").write_text("old")
        with pytest.raises(TypeError):
            write_file(tmp_path / name, wrong)
        assert names(tmp_path) == ["old"] and (tmp_path / "old").read_text() == "old"


@POSIX
def test_permissions_and_links_stay(tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "kept"
    folder.mkdir()
    file, link = folder / "scene.toml", tmp_path / "link.toml"
    file.write_text("old")
    file.chmod(0o640)
    link.symlink_to(pathlib.Path("kept", "scene.toml"))
    write_file(link, "new")
    assert link.is_symlink() and file.read_text() == "new"
    assert stat.S_IMODE(file.stat().st_mode) == 0o640 and names(folder) == ["scene.toml"]
    # A link to a file that is not there yet makes it.
    file.unlink()
    write_file(link, "made")
    assert link.is_symlink() and file.read_text() == "made"
    # As any new file.
    (folder / "like").touch()
    assert stat.S_IMODE(file.stat().st_mode) == stat.S_IMODE((folder / "like").stat().st_mode)


@POSIX
def test_devices_are_written_and_protected_files_are_not(tmp_path: pathlib.Path) -> None:
    write_file("/dev/null", b"nothing")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    file = tmp_path / "protected"
    file.write_text("old")
    file.chmod(0o444)
    if not os.access(file, os.W_OK):
        with pytest.raises(lp.InputError, match="Permission denied"):
            write_file(file, "new")
        assert file.read_text() == "old"


def test_long_names_have_room_for_the_unfinished_file(tmp_path: pathlib.Path) -> None:
    name = "é" * 120
    write_file(tmp_path / name, "whole")
    assert (tmp_path / name).read_text() == "whole" and len(names(tmp_path)) == 1
