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


def cluster() -> Any:
    return distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)


def test_the_digest_is_that_of_one_machine() -> None:
    from lampyris.distributed import trace

    scene = lp.Scene.from_toml(SCENE)
    expected = scene.trace(rays=40_000, progress=False)
    with cluster() as workers, distributed.Client(workers) as client:
        run = trace(scene, client, shards=5, rays=40_000, progress=False)
        assert run.digest == expected.digest
        assert run["focus"].figures == expected["focus"].figures
        with pytest.raises(ValueError, match="at least one"):
            trace(scene, client, shards=0)
        with pytest.raises(ValueError, match="one machine"):
            trace(scene, client, until="1%@focus")


def test_a_killed_worker_costs_time_alone() -> None:
    from lampyris.distributed import trace

    scene = lp.Scene.from_toml(SCENE)
    settings: dict[str, Any] = {"rays": 2_000_000, "intersector": "exact"}
    expected = scene.trace(progress=False, **settings)
    killed: list[int] = []
    with cluster() as workers, distributed.Client(workers) as client:
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
