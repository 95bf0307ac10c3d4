"""Dask: dask_run.py SCENE OUT PARTS [SCHEDULER]; on this machine, or on the cluster of a scheduler's address."""

import subprocess
import sys

from dask.distributed import Client


def trace(scene, out, part, parts):
    shard = ["--threads", "1", "--shard", f"{part}/{parts}", "--resume"]
    subprocess.run(["lampyris", "trace", scene, *shard, "-o", f"{out}/parts", "--quiet"], check=True)


if __name__ == "__main__":
    scene, out, parts, *scheduler = sys.argv[1:]
    client = Client(*scheduler) if scheduler else Client(threads_per_worker=1, dashboard_address=None)
    numbers = range(1, int(parts) + 1)
    client.gather([client.submit(trace, scene, out, i, parts, retries=2, pure=False) for i in numbers])
    subprocess.run(["lampyris", "merge", f"{out}/parts", "-o", f"{out}/result"], check=True)
