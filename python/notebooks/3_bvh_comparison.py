# %% [markdown]
# # Your own structure beside the octree
# The intersectors take and give NumPy arrays, so that any other can be compared on the very same facets and rays.

# %%
import time

import numpy as np

import lampyris as lp

lp.write_demo(".")
model = lp.read_step("lamp.stp")
mesh = model.tessellate((0.05, 0.2))
mesh

# %%
random = np.random.default_rng(1)
box = np.array([mesh.positions.min(axis=0), mesh.positions.max(axis=0)])
n = 50_000
origins = random.uniform(box[0], box[1], (n, 3)) + [0.0, 0.0, 1000.0]
targets = random.uniform(box[0], box[1], (n, 3))
directions = targets - origins
directions /= np.linalg.norm(directions, axis=1)[:, None]

# %%
octree, bvh, exact = lp.Octree(mesh), lp.Bvh(mesh), lp.Exact(model)
hits = {}
for name, tracer in (("octree", octree), ("bvh", bvh), ("spline", exact)):
    start = time.perf_counter()
    hits[name] = tracer.intersect(origins, directions)
    print(f"{name}: {n / (time.perf_counter() - start) / 1e6:.1f} million rays/s, {tracer.bytes / len(mesh):.0f} bytes a facet")

# %% [markdown]
# Octree and BVH stand on the same facets and agree; the spline is elsewhere by what the facets' sag allows.

# %%
assert np.array_equal(np.isfinite(hits["octree"].t), np.isfinite(hits["bvh"].t))
both = np.isfinite(hits["octree"].t) & np.isfinite(hits["spline"].t)
print("median distance from the spline:", np.median(np.abs(hits["octree"].t[both] - hits["spline"].t[both])), "mm")

# %% [markdown]
# A cause for every difference comes from the cross-check.

# %%
check = lp.study.check(model, rays=5000, progress=False)
assert check["octree_vs_bvh"]["disagree"] == 0
check["facets_vs_exact"]
