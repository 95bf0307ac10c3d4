"""What the tests share: the fixtures of the crate and the command."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import subprocess
from typing import Any

import pytest

import lampyris as lp

ROOT = pathlib.Path(os.environ.get("LAMPYRIS_SOURCE", pathlib.Path(__file__).parents[2]))
#: Every scene of the fixtures, in whatever folder.
SCENES = sorted((ROOT / "fixtures").rglob("*.toml"))

LAMP = ROOT / "fixtures" / "step" / "lamp_multicavity.stp"


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


def lamp(rays: int = 20_000) -> lp.Scene:
    """The demo's lamp, built call by call."""
    scene = lp.Scene(lp.read_step(LAMP), unit="lm", rays=rays, seed=1)
    scene["cover_PMMA"] = lp.glass("PMMA")
    points = [[-95, 30, 12.5], [0, 30, 9.375], [95, 30, 7.5]]
    scene[lp.select(part="housing", at=points)] = lp.mirror(0.95)
    scene.add(lp.led(at=(-95, 0, 17.69), direction=(0, 0, -1), power=100))
    scene.add(lp.far_field("far", h_deg=(-40, 40), v_deg=(-20, 20), step_deg=1.0))
    return scene
