"""A run on Dask has the bits of one on a single machine, also when workers die."""

from __future__ import annotations

import _thread
import os
import pathlib
import signal
import subprocess
import sys
import textwrap
import threading
import time
from typing import Any

import numpy as np
import pytest
from conftest import SCENES

import lampyris as lp

distributed = pytest.importorskip("distributed")

SCENE = next(s for s in SCENES if s.stem == "s1_lens")


def cluster(number: int = 2) -> Any:
    return distributed.LocalCluster(n_workers=number, threads_per_worker=1, processes=True, dashboard_address=None)


def test_the_digest_is_that_of_one_machine() -> None:
    from lampyris.distributed import trace

    scene = lp.Scene.from_toml(SCENE)
    expected = scene.trace(rays=40_000, progress=False)
    with cluster() as workers, distributed.Client(workers) as client:
        run = trace(scene, client, shards=5, rays=40_000, progress=False)
        assert run.digest == expected.digest
        assert run["focus"].figures == expected["focus"].figures
        with pytest.raises(ValueError, match="at least 1"):
            trace(scene, client, shards=0)
        with pytest.raises(ValueError, match="one machine"):
            trace(scene, client, until="1%@focus")


def test_wrong_arguments_are_told_what_to_do() -> None:
    from lampyris.distributed import trace

    scene: Any = lp.Scene.from_toml(SCENE)
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as workers:
        with distributed.Client(workers) as client:
            wrong: dict[str, Any]
            for wrong in ({"shards": "4"}, {"shards": True}, {"retries": "a"}):
                with pytest.raises(TypeError, match=next(iter(wrong))):
                    trace(scene, client, **wrong)
            for wrong in ({"shards": 1.5}, {"retries": -1}, {"threads": 0}):
                with pytest.raises(ValueError, match=next(iter(wrong))):
                    trace(scene, client, **wrong)
            with pytest.raises(TypeError, match="Scene is needed"):
                trace("scene.toml", client)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match="makes one of a cluster"):
            trace(scene, workers)
        with pytest.raises(ValueError, match="connect a new"):
            trace(scene, client)


def test_settings_of_facets_may_be_arrays() -> None:
    from lampyris.distributed import _asks_for_facets, trace

    tolerance = np.array([0.05, 0.2])
    asked: dict[str, Any]
    for asked in ({"tolerance": tolerance}, {"tolerance": 0.1}, {"accuracy_deg": 0.1}, {"parts": {"lens": tolerance}}):
        assert _asks_for_facets(asked)
    for asked in ({}, {"rays": 5}, {"tolerance": None}, {"accuracy_deg": None, "parts": None}, {"faces": {}}):
        assert not _asks_for_facets(asked)
    scene = lp.Scene.from_toml(SCENE)
    expected = scene.trace(rays=20_000, tolerance=(0.05, 0.2), progress=False)
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as workers:
        with distributed.Client(workers) as client:
            run = trace(scene, client, shards=2, rays=20_000, tolerance=tolerance, progress=False)
    assert run.digest == expected.digest


@pytest.mark.parametrize("number", [1, 2])
def test_a_killed_worker_costs_time_alone(number: int) -> None:
    from lampyris.distributed import trace

    scene = lp.Scene.from_toml(SCENE)
    settings: dict[str, Any] = {"rays": 2_000_000, "intersector": "exact"}
    expected = scene.trace(progress=False, **settings)
    killed: list[int] = []
    with cluster(number) as workers, distributed.Client(workers) as client:
        processes = client.run(os.getpid)

        def kill() -> None:
            while not killed:
                busy = [address for address, tasks in client.processing().items() if any("-trace-" in str(t) for t in tasks)]
                if busy:
                    killed.append(processes[busy[0]])
                    os.kill(killed[0], getattr(signal, "SIGKILL", signal.SIGTERM))
                time.sleep(0.02)

        killer = threading.Thread(target=kill)
        killer.start()
        run = trace(scene, client, shards=12, progress=False, **settings)
        killer.join()
        assert killed and killed[0] not in client.run(os.getpid).values()
    assert run.digest == expected.digest


@pytest.mark.parametrize("number", [1, 2])
def test_ctrl_c_keeps_the_parts_that_are_done(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from lampyris.distributed import _Tasks, trace

    settings: dict[str, Any] = {"rays": 1_000_000, "intersector": "exact"}
    scene = lp.Scene.from_toml(SCENE)
    digest = scene.trace(progress=False, **settings).digest

    gathered = _Tasks.finished

    def pressed_again(tasks: _Tasks) -> list[bytes]:
        # As people do.
        signal.raise_signal(signal.SIGINT)
        return gathered(tasks)

    monkeypatch.setattr(_Tasks, "finished", pressed_again)

    def tell(stage: str, done: int, total: int, messages: list[str]) -> None:
        if stage == "tracing" and done > 0.4 * total and not pressed:
            pressed.append(threading.Thread(target=_thread.interrupt_main))
            pressed[0].start()

    with cluster(number) as workers, distributed.Client(workers) as client:
        parts: list[lp.Part] = []
        for _ in range(2):
            pressed: list[threading.Thread] = []
            with pytest.raises(lp.Interrupted, match="resume=True") as stopped:
                # The second time it goes on from the first, in other shards.
                trace(scene, client, shards=13 + 4 * len(parts), resume=bool(parts), progress=tell, **settings)
            pressed[0].join()
            assert scene.interrupted is stopped.value.part and not scene.interrupted.is_whole
            parts.append(scene.interrupted)
        assert 0.3e6 < parts[0].rays < parts[1].rays
        assert trace(scene, client, shards=5, resume=True, progress=False, **settings).digest == digest
        assert scene.interrupted is None
        other = lp.Scene.from_toml(SCENE)
        with pytest.raises(ValueError, match="part of another run"):
            trace(other, client, resume=parts[0], seed=5, progress=False, **settings)
    assert other.trace(resume=other.read_part(parts[0].to_bytes(), **settings), progress=False, **settings).digest == digest
    assert scene.trace(resume=parts[1], progress=False, **settings).digest == digest


AT_A_TERMINAL = """
    import sys, lampyris as lp, distributed
    from lampyris.distributed import trace

    def tell(stage, done, total, messages):
        if stage == "tracing" and done > 0.3 * total:
            print("tracing", flush=True)

    if __name__ == "__main__":
        scene = lp.Scene.from_toml(sys.argv[1])
        settings = dict(rays=int(sys.argv[2]), intersector="exact")
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            with distributed.Client(cluster) as client:
                try:
                    trace(scene, client, shards=20, progress=tell, **settings)
                except lp.Interrupted as e:
                    print("kept", e.part.rays, flush=True)
                print("digest", trace(scene, client, resume=True, progress=False, **settings).digest, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there are no groups of processes")
def test_ctrl_c_at_a_terminal_goes_to_the_workers_too(tmp_path: pathlib.Path) -> None:
    rays = 1_000_000
    program = tmp_path / "program.py"
    program.write_text(textwrap.dedent(AT_A_TERMINAL))
    line = [sys.executable, str(program), str(SCENE), str(rays)]
    path = os.pathsep.join([str(pathlib.Path(lp.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        line, stdout=subprocess.PIPE, text=True, start_new_session=True, env={**os.environ, "PYTHONPATH": path}
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "tracing\n"
        os.killpg(child.pid, signal.SIGINT)
        kept, digest = (text for text in child.stdout.read().splitlines() if text != "tracing")
    assert child.returncode == 0 and 0.3 * rays <= int(kept.removeprefix("kept ")) < rays
    assert digest == f"digest {lp.Scene.from_toml(SCENE).trace(rays=rays, intersector='exact', progress=False).digest}"


def test_a_part_that_fails_leaves_the_others() -> None:
    from lampyris.distributed import trace

    settings: dict[str, Any] = {"rays": 400_000, "intersector": "octree"}
    scene = lp.Scene.from_toml(SCENE)

    def stop(stage: str, done: int, total: int, messages: list[str]) -> None:
        if stage == "tracing" and done > 0.5 * total:
            raise RuntimeError("enough")

    with cluster(1) as workers, distributed.Client(workers) as client:
        with pytest.raises(RuntimeError, match="enough"):
            trace(scene, client, shards=8, progress=stop, **settings)
    assert scene.interrupted is not None and scene.interrupted.rays >= 200_000
    assert scene.trace(resume=True, progress=False, **settings).digest == scene.trace(progress=False, **settings).digest
