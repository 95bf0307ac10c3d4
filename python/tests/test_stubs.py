"""The stubs say what the extension has, and the tests and notebooks are typed."""

from __future__ import annotations

import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("mypy")
PACKAGE = pathlib.Path(__file__).parents[1]


def test_the_stubs_are_those_of_the_extension() -> None:
    line = [sys.executable, "-m", "mypy.stubtest", "--mypy-config-file", "pyproject.toml", "lampyris._lampyris"]
    done = subprocess.run(line, capture_output=True, text=True, cwd=PACKAGE)
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_is_content_in_strict_mode() -> None:
    places = ["lampyris", "tests", *(str(p) for p in sorted((PACKAGE / "notebooks").glob("*.py")))]
    line = [sys.executable, "-m", "mypy", *places]
    done = subprocess.run(line, capture_output=True, text=True, cwd=PACKAGE)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_api_page_is_current() -> None:
    line = [sys.executable, "docs/generate_api.py", "--check"]
    done = subprocess.run(line, capture_output=True, text=True, cwd=PACKAGE)
    assert done.returncode == 0, done.stdout + done.stderr
