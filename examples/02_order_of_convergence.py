"""A profile that leaves no vibration (Taskin, Kilic and Kapucu 2019), held over ever smaller communication steps.

The profile is exact; what remains comes from holding its values over the steps, and falls with their square.
Leaves results/02_order_of_convergence.png.
"""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np

from shaper_fmu import System, build_fmu, find_component
from shaper_fmu.page import Figure, Line, write_picture

W, ZETA = 22.9476, 0.0891  # rad/s, -: the paper's plant
WD = W * math.sqrt(1.0 - ZETA**2)

for name in ("InputShaper", "MotionProfile", "MassSpringDamper"):
    build_fmu(find_component(name), "fmus", platforms=["this"])


def residual(duration: float, steps: int) -> float:
    """Residual envelope at the end of the move, relative to that of a step (V of Singer and Seering 1990)."""
    system = System("convergence")
    profile = {"profile": "cycloid_versine_ramp", "duration": duration, "natural_frequency": W, "damping_ratio": ZETA}
    system.add("profile", "fmus/MotionProfile.fmu", profile)
    system.add("shaper", "fmus/InputShaper.fmu", shaper="none")  # passes the reference on as a force
    system.add("plant", "fmus/MassSpringDamper.fmu", stiffness=W * W, damping=2.0 * ZETA * W)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    results = system.simulate(duration, duration / steps, record=["plant.position", "plant.velocity"])
    deviation, speed = results["plant.position"][-1] - 1.0 / W**2, results["plant.velocity"][-1]
    return math.hypot(deviation, (speed + ZETA * W * deviation) / WD) * W**2 * math.sqrt(1.0 - ZETA**2)


counts = [25, 50, 100, 200, 400, 800]
lines = []
for duration in (0.1374496, 0.1222, 0.3):
    residuals = [residual(duration, steps) for steps in counts]
    orders = ", ".join(f"{math.log2(a / b):.3f}" for a, b in pairwise(residuals))
    ends = f"V = {residuals[0]:.2e} at {counts[0]} steps, {residuals[-1]:.2e} at {counts[-1]}"
    print(f"T = {duration} s: {ends}; observed orders {orders}")
    lines.append(Line(f"T = {duration} s", np.log10(counts), np.log10(residuals), markers=True))

figure = Figure("order", "Residual vibration V of a held profile", "log10 of the steps per move", "log10 V", lines)
print(write_picture(figure, Path("results/02_order_of_convergence.png")))
