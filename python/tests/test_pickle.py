"""What can be pickled comes back the same, also from other processes and as a copy."""

from __future__ import annotations

import copy
import multiprocessing
import pathlib
import pickle
from functools import reduce
from typing import Any

import numpy as np
import pytest
from conftest import LAMP, SCENES, lamp

import lampyris as lp

SETTINGS: dict[str, Any] = {"rays": 20_000, "intersector": "octree"}


def again(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))


def listed(models: Any = ()) -> lp.Scene:
    """A scene whose source is an array of rays."""
    scene = lp.Scene(models, rays=3000)
    array = np.zeros((50, 7))
    array[:, 0], array[:, 2], array[:, 5], array[:, 6] = np.linspace(-1, 1, 50), 200.0, 1.0, 0.02
    return scene.add(lp.rays(array), lp.plane("wall", at=(0, 0, 300), size=(10, 10), cells=(2, 2)))


def filed() -> lp.Scene:
    return lp.Scene.from_toml(next(s for s in SCENES if s.stem == "s1_lens"))


@pytest.mark.parametrize("make", [lamp, listed, filed], ids=["model", "rays", "file"])
def test_scenes_are_pickled_whether_traced_or_not(make: Any) -> None:
    scene = make()
    fresh = again(scene)
    digest = scene.trace(progress=False, **SETTINGS).digest
    traced = again(scene)
    # The folder of the rays goes with the scene that made it.
    part = scene.trace_part(0, 3, **SETTINGS)
    del scene
    for other in (fresh, traced, copy.deepcopy(traced)):
        assert other.trace(progress=False, **SETTINGS).digest == digest
        assert other.trace(resume=part, progress=False, **SETTINGS).digest == digest


def test_parts_are_pickled_by_their_bytes() -> None:
    scene = lamp()
    parts = [again(scene.trace_part(k, 3, **SETTINGS)) for k in range(3)]
    first = parts[0]
    whole = reduce(lp.Part.merged, parts)
    assert whole.is_whole and whole.rays == 20_000 and copy.deepcopy(whole).rays == whole.rays
    digest = scene.trace(progress=False, **SETTINGS).digest
    assert lamp().trace(resume=whole, progress=False, **SETTINGS).digest == digest
    assert lamp().trace(resume=lp.Part.from_bytes(parts[1].to_bytes()), progress=False, **SETTINGS).digest == digest
    with pytest.raises(ValueError, match="in an earlier part"):
        first.merged(first)
    with pytest.raises(ValueError, match="part of another run"):
        scene.trace(resume=first, seed=9, progress=False, **SETTINGS)
    damaged = bytearray(first.to_bytes())
    damaged[200] ^= 1
    for wrong in (b"", b"part", bytes(damaged), first.to_bytes()[:-1]):
        with pytest.raises(ValueError, match="the part cannot be used"):
            lp.Part.from_bytes(wrong)


def test_an_interruption_comes_out_of_another_process() -> None:
    part = lamp().trace_part(0, 2, **SETTINGS)
    stopped = again(lp.Interrupted(part))
    assert stopped.part.rays == part.rays and "resume=True" in str(stopped)
    scene = lamp()
    scene.interrupted = part
    assert again(scene).trace(resume=True, progress=False, **SETTINGS).digest == scene.trace(progress=False, **SETTINGS).digest


def traced_part(index: int) -> lp.Part:
    return lamp().trace_part(index, 4, **SETTINGS)


@pytest.mark.parametrize("method", ["spawn", "fork"])
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_parts_come_from_a_pool(method: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip("there are no forks")
    scene = lamp()
    digest = scene.trace(progress=False, **SETTINGS).digest
    with multiprocessing.get_context(method).Pool(2) as pool:
        parts = pool.map(traced_part, range(4))
        # The scene itself goes there, with what it has prepared left out.
        other = pool.apply(scene.trace_part, (0, 1), SETTINGS)
    assert scene.trace(resume=reduce(lp.Part.merged, parts), progress=False, **SETTINGS).digest == digest
    assert other.is_whole and scene.trace(resume=other, progress=False, **SETTINGS).digest == digest


def test_runs_and_receivers_are_pickled_with_their_arrays() -> None:
    scene = filed()
    scene.add(lp.plane("wall", at=(0, 0, 300), cells=(5, 4), channels="photometric"), lp.far_field("far", step_deg=10))
    run = scene.trace(progress=False, **SETTINGS)
    for other in (again(run), again(again(run)), copy.deepcopy(run)):
        assert (other.digest, other.document, other.until, repr(other)) == (run.digest, run.document, run.until, repr(run))
        assert other.notes == run.notes and other.verdicts == [] and list(other) == list(run)
        assert all(np.array_equal(other.paths[k], run.paths[k]) for k in run.paths)
        for name, receiver in run.items():
            same_receiver(other[name], receiver)
    same_receiver(again(run["wall"]), run["wall"])
    same_receiver(copy.deepcopy(run["wall"]), run["wall"])
    with pytest.raises(ValueError, match="assess it before"):
        again(run).assess(next(iter(lp.regulations())), "far")


def same_receiver(one: lp.Receiver, other: lp.Receiver) -> None:
    assert one.figures == other.figures and (one.name, one.unit) == (other.name, other.unit)
    for a, b in zip((one.values, one.statistical, one.geometric, *one.edges), (other.values, other.statistical, other.geometric, *other.edges)):
        assert a is not None and b is not None and np.array_equal(a, b, equal_nan=True)
    assert list(one.channels) == list(other.channels)
    assert all(np.array_equal(one.channels[k][0], other.channels[k][0]) for k in one.channels)


def test_models_meshes_intersectors_and_hits_are_pickled(tmp_path: pathlib.Path, lens: pathlib.Path) -> None:
    model = lp.read_step(LAMP)
    mesh = model.tessellate(0.5)
    random = np.random.default_rng(7)
    origins, directions = random.uniform(-150, 150, (2000, 3)), random.normal(size=(2000, 3))
    expected = lp.Octree(mesh).intersect(origins, directions)
    assert np.isfinite(expected.t).any()
    for tree in (lp.Octree(again(mesh)), again(lp.Octree(mesh)), again(lp.Bvh(mesh, wide=False)), copy.deepcopy(lp.Bvh(mesh))):
        same_hits(tree.intersect(origins, directions), expected)
    exact = lp.Exact(model).intersect(origins[:200], directions[:200])
    same_hits(again(lp.Exact(model)).intersect(origins[:200], directions[:200]), exact)
    polished = lp.Octree(mesh, "exact", model)
    same_hits(again(polished).intersect(origins[:200], directions[:200]), polished.intersect(origins[:200], directions[:200]))
    for hits in (again(expected), copy.deepcopy(expected)):
        same_hits(hits, expected)
        assert (hits.nodes, hits.tests) == (expected.nodes, expected.tests)
    met = int(np.isfinite(expected.t).sum())
    assert repr(expected) == f"<lampyris.Hits: {met} of 2000 rays hit>" and len(expected) == 2000
    other = again(mesh)
    assert other.report == mesh.report and np.array_equal(other.sag, mesh.sag) and other.area == mesh.area
    assert again(model).account()["bytes"] == model.account()["bytes"]
    copied = tmp_path / "lens.stp"
    copied.write_bytes(lens.read_bytes())
    pickled = pickle.dumps(lp.read_step(copied))
    copied.write_bytes(LAMP.read_bytes())
    with pytest.raises(lp.InputError, match="another one since the model was pickled"):
        pickle.loads(pickled)


def same_hits(one: lp.Hits, other: lp.Hits) -> None:
    for name in ("t", "normal", "geometric_normal", "face", "primitive", "uv", "certainty"):
        assert np.array_equal(getattr(one, name), getattr(other, name), equal_nan=name not in ("face", "primitive", "certainty")), name
