# %% [markdown]
# # One run on many machines
# A run is divided into parts that are functions of the scene alone; Dask traces them wherever there is room, and their sum has the
# bits of one machine. Here the cluster is this machine; `dask_jobqueue.SLURMCluster()` gives a client just so.
#
# Run as a program, this file is imported by every worker again, and must start no cluster there: hence `if __name__ == "__main__":`,
# which always holds in a notebook.

# %%
from distributed import Client, LocalCluster

import lampyris as lp
from lampyris.distributed import trace

if __name__ == "__main__":
    scene = lp.Scene.from_toml(lp.write_demo("."))
    alone = scene.trace(rays=40_000, progress=False)

# %%
if __name__ == "__main__":
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    client = Client(cluster)
    run = trace(scene, client, shards=6, rays=40_000, progress=False)
    client.close()
    cluster.close()

# %%
if __name__ == "__main__":
    assert run.digest == alone.digest
    print(run.digest)

# %% [markdown]
# Without Dask the parts can go through files, as those of `lampyris trace --shard`.

# %%
if __name__ == "__main__":
    parts = [scene.trace_part(k, 3, rays=40_000) for k in range(3)]
    parts[1].save("part.bin")
    with open("part.bin", "rb") as file:
        again = scene.read_part(file.read(), rays=40_000)
    whole = parts[0].merged(again).merged(parts[2])
    assert scene.trace(rays=40_000, resume=whole, progress=False).digest == alone.digest
