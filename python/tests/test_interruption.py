"""Ctrl-C, exceptions of a progress function and forks: nothing that was traced is lost, and nothing hangs."""

from __future__ import annotations

import multiprocessing
import pathlib
import signal
import subprocess
import sys
import textwrap
import time
from typing import Any

import numpy as np
import pytest
from conftest import LAMP, SCENES, lamp

import lampyris as lp

SIGNALS = pytest.mark.skipif(sys.platform == "win32", reason="signals of a console are not sent to one process there")


def test_progress_is_told_and_can_stop_a_run() -> None:
    scene = lamp(2000)
    told: list[tuple[str, int, int]] = []
    scene.trace(progress=lambda stage, done, total, messages: told.append((stage, done, total)))
    assert told

    class Enough(Exception):
        pass

    def stop(stage: str, done: int, total: int, messages: list[str]) -> None:
        if stage == "tracing" and done > 0:
            raise Enough

    long = lamp(50_000_000)
    with pytest.raises(Enough):
        long.trace(intersector="octree", progress=stop)
    assert long.interrupted is not None and 0 < long.interrupted.rays < 50_000_000


INTERRUPTED = """
    import sys, lampyris as lp
    scene = lp.Scene.from_toml(sys.argv[1])
    settings = dict(rays=int(sys.argv[2]), intersector="octree")
    def tell(stage, done, total, messages):
        if stage == "tracing" and done > 0:
            print("tracing", flush=True)
    try:
        scene.trace(progress=tell, **settings)
    except lp.Interrupted as e:
        assert 0 < e.part.done < e.part.replicates, e.part
        print("kept", e, flush=True)
        print("digest", scene.trace(resume=True, progress=False, **settings).digest, flush=True)
"""


@SIGNALS
def test_ctrl_c_leaves_what_is_done_and_it_goes_on_to_the_same_bits() -> None:
    scene = next(s for s in SCENES if s.stem == "s3_reflector")
    rays = 4_000_000
    line = [sys.executable, "-c", textwrap.dedent(INTERRUPTED), str(scene), str(rays)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "tracing\n"
        child.send_signal(signal.SIGINT)
        rest = [text for text in child.stdout.read().splitlines() if text != "tracing"]
    assert child.returncode == 0 and rest[0].startswith("kept"), rest
    whole = lp.Scene.from_toml(scene).trace(rays=rays, intersector="octree", progress=False)
    assert rest[-1] == f"digest {whole.digest}"


def test_ctrl_c_after_the_last_ray_keeps_all_of_them() -> None:
    scene = lamp()
    settings: dict[str, Any] = {"intersector": "octree"}

    def stop(stage: str, done: int, total: int, messages: list[str]) -> None:
        if stage in ("checking", "building the cross-check"):
            raise KeyboardInterrupt

    with pytest.raises(lp.Interrupted, match="resume=True") as stopped:
        scene.trace(progress=stop, **settings)
    assert stopped.value.part.is_whole and scene.interrupted is stopped.value.part
    told: list[int] = []
    whole = scene.trace(resume=True, progress=lambda stage, done, total, messages: told.append(done), **settings)
    assert whole.digest == lamp().trace(progress=False, **settings).digest and scene.interrupted is None


def test_a_search_for_an_error_goes_on_where_it_was_stopped() -> None:
    settings: dict[str, Any] = {"until": "0.02%@far", "intersector": "octree"}
    undisturbed = lamp().trace(progress=False, **settings)
    rounds: list[str] = []

    def stop(stage: str, done: int, total: int, messages: list[str]) -> None:
        rounds.extend(message for message in messages if "going on" in message)
        if rounds and stage == "tracing" and done > 0:
            raise KeyboardInterrupt

    scene = lamp()
    with pytest.raises(lp.Interrupted) as stopped:
        scene.trace(progress=stop, **settings)
    # In another process too, from its bytes.
    other = lamp()
    saved = other.read_part(stopped.value.part.to_bytes(), intersector="octree")
    for run in (scene.trace(resume=True, progress=False, **settings), other.trace(resume=saved, progress=False, **settings)):
        assert run.until is not None and run.until["reached"]
        assert (run.digest, run.rays) == (undisturbed.digest, undisturbed.rays)


def test_what_was_done_of_a_part_goes_with_ctrl_c() -> None:
    scene = lamp(50_000_000)

    def stop(stage: str, done: int, total: int, messages: list[str]) -> None:
        if stage == "tracing" and done > 0:
            raise KeyboardInterrupt

    with pytest.raises(lp.Interrupted) as stopped:
        scene.trace_part(0, 2, intersector="octree", progress=stop)
    assert 0 < stopped.value.part.rays < 25_000_000


def test_a_part_goes_on_as_the_run_that_it_is_of() -> None:
    scene = lamp()
    part = scene.trace_part(0, 2, rays=1_500_000, intersector="octree")
    with pytest.raises(ValueError, match="a run of 1500000 rays, not 1000000"):
        scene.trace(rays=1_000_000, resume=part, intersector="octree", progress=False)
    assert scene.trace(rays=1_500_000, resume=part, intersector="octree", progress=False).rays == 1_500_000


INTERSECTING = """
    import sys, time, numpy as np, lampyris as lp
    tracer = lp.Exact(lp.read_step(sys.argv[1]))
    n = 4_000_000
    origins = np.random.default_rng(1).uniform(-100, 100, (n, 3))
    directions = np.ones((n, 3))
    tracer.intersect(origins[:40_000], directions[:40_000])
    print("ready", flush=True)
    try:
        while True:
            tracer.intersect(origins, directions)
    except KeyboardInterrupt:
        print("stopped", flush=True)
"""


@SIGNALS
def test_ctrl_c_ends_a_long_call_of_an_intersector() -> None:
    line = [sys.executable, "-c", textwrap.dedent(INTERSECTING), str(LAMP)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.3)
        child.send_signal(signal.SIGINT)
        assert child.stdout.read() == "stopped\n"
    assert child.returncode == 0


def traced_in_a_fork(rays: int) -> tuple[str, float]:
    mesh = lp.read_step(LAMP).tessellate(0.5)
    hits = lp.Octree(mesh).intersect(np.array([[0.0, 0.0, 500.0]]), np.array([[0.0, 0.0, -1.0]]))
    return lamp(rays).trace(intersector="octree", progress=False).digest, float(hits.t[0])


@pytest.mark.skipif(sys.platform == "win32", reason="there are no forks")
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_a_fork_has_threads_of_its_own() -> None:
    # The threads of this process are started, and stay here.
    here = traced_in_a_fork(2000)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply_async(traced_in_a_fork, (2000,)).get(timeout=60) == here
