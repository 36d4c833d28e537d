"""Tune a shaper for a plant of which only the FMU is known: modes, choice, proof. The same as `shaper-fmu tune`.

Leaves results/05_tune_a_plant.png and, in results/crane_tuned/, the shaper as an FMU, the shaped plant as an SSP archive, and all
numbers. Run it from anywhere: python examples/05_tune_a_plant.py
"""

from pathlib import Path

from shaper_fmu import build_fmu, find_component, tune_plant
from shaper_fmu.page import Figure, Line, write_picture
from shaper_fmu.report import write_tuning
from shaper_fmu.tune import requirements_for

plant = build_fmu(find_component("OverheadCrane"), "fmus", platforms=["this"])
spread = {"initial_rope_length": 0.1}  # the rope is known to 10 %
requirements = requirements_for(spread, tolerance=0.05, longest_delay=8.0)
found = tune_plant(
    plant, "trolley_acceleration", ["swing_angle"], requirements=requirements, spread=spread, amplitude=0.2, say=print
)

assert found.plant is not None
for mode in found.plant.ranges:
    w = mode.natural_frequency
    print(f"natural frequency {w.nominal:.6f} rad/s, {w.low:.6f} to {w.high:.6f} rad/s over the rope's lengths")
print(f"{found.verdict}: {found.summary}")
for path in write_tuning(found, Path("results/crane_tuned"), report=False):
    print(f"wrote {path}")

worst = found.responses[-1]
unshaped, shaped = worst.outputs["swing_angle"]
lines = [Line("unshaped", worst.time, unshaped), Line("shaped", worst.time, shaped)]
title = f"The trolley begins to accelerate at 0.2 m/s2; rope of {worst.values['initial_rope_length']:.3g} m, the worst"
print(write_picture(Figure("tuned", title, "time [s]", "swing angle [rad]", lines), Path("results/05_tune_a_plant.png")))
