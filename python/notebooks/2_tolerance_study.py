# %% [markdown]
# # What a tolerance costs, and what it gives
# Facets make light go astray. How far, and what finer facets cost, is measured against the spline itself.

# %%
import numpy as np

import lampyris as lp

lp.write_demo(".")
lamp = lp.read_step("lamp.stp")

# %%
study = lp.study.accuracy(lamp, [0.4, 0.1], rays=2000, repetitions=1, normals=["flat", "bilinear"], progress=False)
print(study.answer)

# %% [markdown]
# The rows are arrays: here the largest direction error of the octree on one thread.

# %%
rows = (study["intersector"] == "octree") & (study["threads"] == 1)
for tolerance, normals, error in zip(
    study["tolerance_mm"][rows], study["normals"][rows], study["direction_error_deg_p99"][rows]
):
    print(f"{tolerance} mm, {normals}: {error:.3g}°")

# %%
flat = rows & (study["normals"] == "flat")
bilinear = rows & (study["normals"] == "bilinear")
assert np.nanmean(study["direction_error_deg_rms"][flat]) > np.nanmean(study["direction_error_deg_rms"][bilinear])

# %% [markdown]
# Or ask for the accuracy and let the tolerances be found.

# %%
scene = lp.Scene.from_toml("lamp.toml")
run = scene.trace(rays=5000, accuracy_deg=0.2, progress=False)
print(run.document["accuracy"]["answer"])
