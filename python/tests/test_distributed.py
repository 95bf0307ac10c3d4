"""A run on Dask has the bits of one on a single machine, also when workers die."""

from __future__ import annotations

import os
import signal
import threading
import time
from typing import Any

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
