"""What the tests share: the fixtures of the crate and the command."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
from typing import Any

import pytest

ROOT = pathlib.Path(os.environ.get("LAMPYRIS_SOURCE", pathlib.Path(__file__).parents[2]))
SCENES = sorted((ROOT / "fixtures" / "scenes").glob("*.toml"))


def command() -> str:
    """The command to compare with: of LAMPYRIS_COMMAND, of a build of the crate, or on the path."""
    built = [ROOT / "target" / kind / "lampyris" for kind in ("release", "debug")]
    known = [os.environ.get("LAMPYRIS_COMMAND"), *(str(b) for b in built if b.exists()), shutil.which("lampyris")]
    found = next((c for c in known if c), None)
    if found is None:
        pytest.skip("no lampyris command: build it with `cargo build`, or name it in LAMPYRIS_COMMAND")
    return found


def traced(scene: pathlib.Path, folder: pathlib.Path, *options: str) -> dict[str, Any]:
    """The document of ``lampyris trace --json``."""
    line = [command(), "trace", str(scene), "-o", str(folder), "--json", "--quiet", "--no-report", *options]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout))


@pytest.fixture
def lens() -> pathlib.Path:
    return ROOT / "fixtures" / "step" / "lens_planoconvex_nurbs.stp"
