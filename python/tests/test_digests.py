"""The bits of Python are those of the command."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest
from conftest import SCENES, traced

import lampyris as lp


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.stem)
def test_every_fixture_scene_has_the_digest_of_the_command(scene: pathlib.Path, tmp_path: pathlib.Path) -> None:
    read = lp.Scene.from_toml(scene)
    rays: int | None = 20_000
    if any("rays" in source for source in read.tables["source"]):
        # Beside sources with rays of their own another number is refused: a hundredth of theirs will do.
        rays = None
        for source in read.tables["source"]:
            source["rays"] //= 100
        scene = tmp_path / scene.name
        read.save(scene)
    expected = traced(scene, tmp_path, *(["--rays", str(rays)] if rays else []))
    run = read.trace(rays=rays, progress=False)
    assert run.digest == expected["digest"]
    assert [r["figures"] for r in run.document["receivers"]] == [r["figures"] for r in expected["receivers"]]


def test_no_scene_of_the_fixtures_is_left_out() -> None:
    assert {"demo", "low_beam", "s1_lens", "s2_lamp", "s3_reflector"} <= {scene.stem for scene in SCENES}


def test_settings_mean_what_the_options_mean(tmp_path: pathlib.Path) -> None:
    scene = next(s for s in SCENES if s.stem == "s1_lens")
    options = ("--rays", "5000", "--seed", "7", "--tolerance", "0.02..0.1", "--normals", "cubic", "--intersector", "cwbvh")
    expected = traced(scene, tmp_path, *options)
    settings = {"seed": 7, "tolerance": (0.02, 0.1), "normals": "cubic", "intersector": "cwbvh"}
    read = lp.Scene.from_toml(scene)
    run = read.trace(rays=5000, progress=False, **settings)  # type: ignore[arg-type]
    assert run.digest == expected["digest"]
    assert read.trace(rays=5000, threads=1, progress=False, **settings).digest == run.digest  # type: ignore[arg-type]


def test_a_scene_that_was_taken_apart_and_put_together_keeps_its_digest() -> None:
    scene = next(s for s in SCENES if s.stem == "s1_lens")
    read, rebuilt = lp.Scene.from_toml(scene), lp.Scene.from_toml(scene)
    assert rebuilt.tables["receiver"][0]["name"] == "focus"
    assert "[[receiver]]" in rebuilt.to_toml()
    runs = [s.trace(rays=4000, normals="bilinear", progress=False) for s in (read, rebuilt)]
    assert runs[0].digest == runs[1].digest
    assert np.array_equal(runs[0]["focus"].values, runs[1]["focus"].values)


def test_parts_add_up_to_the_bits_of_one_run(tmp_path: pathlib.Path) -> None:
    scene = lp.Scene.from_toml(next(s for s in SCENES if s.stem == "s3_reflector"))
    whole = scene.trace(rays=4000, normals="bilinear", progress=False)
    parts = [scene.trace_part(k, 3, rays=4000, normals="bilinear") for k in range(3)]
    again = scene.read_part(parts[2].to_bytes(), rays=4000, normals="bilinear")
    total = again.merged(parts[0]).merged(parts[1])
    assert total.is_whole and not again.is_whole
    assert scene.trace(rays=4000, normals="bilinear", resume=total, progress=False).digest == whole.digest
    with pytest.raises(ValueError, match="counts once"):
        total.merged(parts[0])
    with pytest.raises(ValueError, match="another run"):
        scene.read_part(parts[0].to_bytes(), rays=4000, normals="flat")
    with pytest.raises(ValueError, match="damaged"):
        scene.read_part(parts[0].to_bytes()[:-5], rays=4000, normals="bilinear")
