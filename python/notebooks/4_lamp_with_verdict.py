# %% [markdown]
# # A lamp and its verdict
# Light in candela over H and V, with both errors, and what a regulation says of it: pass, fail, or unsure.

# %%
import lampyris as lp

scene = lp.Scene.from_toml(lp.write_demo("."))
scene.tables["receiver"]

# %%
run = scene.trace(rays=50_000, progress=False)
{name: str(receiver.power) for name, receiver in run.items()}

# %%
far = next(r for r in run.values() if r.kind == "far_field")
brightest = far.figures["max"]
print(f"brightest cell {brightest.value:,.0f} {far.unit}, standard error of the rays {brightest.statistical:,.0f} {far.unit}")

# %% [markdown]
# The tables of the regulations come with the package; each row has its reading with both errors, and is unsure where these decide.

# %%
print(len(lp.regulations()), "regulations, such as", list(lp.regulations())[:3])
fine = lp.Scene.from_toml("lamp.toml")
fine.add(lp.far_field("fine", h_deg=(-50, 50), v_deg=(-20, 20), step_deg=0.125))
verdict = fine.trace(rays=50_000, intersector="octree", progress=False).assess("UN R112 B passing", "fine")
verdict

# %%
assert verdict.verdict in ("pass", "fail", "unsure")
[(row["id"], row["verdict"]) for row in verdict["rows"]][:5]
