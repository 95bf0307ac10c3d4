"""From a STEP file to candela in ten lines, with nothing but the wheel installed."""

import lampyris as lp

lp.write_demo(".")
scene = lp.Scene("lamp.stp", unit="lm")
scene["cover_PMMA"] = lp.glass("PMMA")
scene[lp.select(part="housing", at=[[-95, 30, 12.5], [0, 30, 9.375], [95, 30, 7.5]])] = lp.mirror(0.95)
scene.add(lp.led(at=(-95, 0, 17.69), direction=(0, 0, -1), power=100))
scene.add(lp.far_field("far", h_deg=(-40, 40), v_deg=(-20, 20), step_deg=0.5))
run = scene.trace(until="1%@far")
print(run["far"].candela.max(), run["far"].power)
