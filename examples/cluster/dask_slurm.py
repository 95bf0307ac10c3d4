"""Dask on Slurm by dask-jobqueue (PBS, LSF and others alike): dask_slurm.py SCENE OUT PARTS JOBS."""

import sys

from dask.distributed import Client
from dask_jobqueue import SLURMCluster
from dask_run import trace
import subprocess

if __name__ == "__main__":
    scene, out, parts, jobs = sys.argv[1:]
    cluster = SLURMCluster(cores=1, memory="1GB", walltime="01:00:00", scheduler_options={"dashboard_address": None})
    cluster.scale(jobs=int(jobs))
    client = Client(cluster)
    client.upload_file(__file__.replace("dask_slurm", "dask_run"))
    client.gather([client.submit(trace, scene, out, i, parts, retries=2, pure=False) for i in range(1, int(parts) + 1)])
    subprocess.run(["lampyris", "merge", f"{out}/parts", "-o", f"{out}/result"], check=True)
