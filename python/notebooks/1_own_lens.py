# %% [markdown]
# # A lens of your own
# From a STEP file to the focus: read it, say what it is made of, send a beam through, and look at the spot with both its errors.
# Put your own file in place of `lamp.stp`; the built-in lamp's clear cover serves as the piece of plastic here.

# %%
import numpy as np

import lampyris as lp

lp.write_demo(".")
model = lp.read_step("lamp.stp")
model

# %% [markdown]
# Every face is accounted for, and every face can be told by name, number, colour or a point on it.

# %%
account = model.account()
assert account["faces"]["refused"] == 0
[(f["part"], f["kind"], round(f["area_mm2"], 1)) for f in model.faces()][:5]

# %%
scene = lp.Scene(model, rays=20_000)
scene["cover_PMMA"] = lp.glass("PMMA")
scene.add(lp.collimated(at=(0, 0, -50), direction=(0, 0, 1), radius=5, power=1.0))
scene.add(lp.plane("screen", at=(0, 0, 200), size=(40, 40), cells=(40, 40)))
scene

# %% [markdown]
# Nobody said how fine the facets are to be: a pilot of the run's own rays chooses, and says why.

# %%
print(scene.prepare(progress=False)["chosen"]["because"])
run = scene.trace(progress=False)
run

# %%
screen = run["screen"]
print(screen.power)
assert screen.values.shape == (40, 40)
assert np.all(screen.statistical >= 0.0)
