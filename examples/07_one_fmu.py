"""A shaped plant as one FMU, for a host that steps by 50 ms and knows no events; and the same two FMUs stepped by such a host.

In the container each impulse of the shaper falls where it belongs. On the host's grid it comes late by up to a step.
Leaves fmus/shaped_plant.fmu and results/07_one_fmu.png.
"""

from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

from shaper_fmu import System, build_fmu, find_component
from shaper_fmu.page import Figure, Line, write_picture

STIFFNESS, FREQUENCY = 100.0, 10.0  # N/m and rad/s, of a mass of 1 kg
STOP, STEP = 2.0, 0.05  # s: the host's

for name in ("InputShaper", "MassSpringDamper"):
    build_fmu(find_component(name), "fmus", platforms=["this"])

system = System("shaped_plant")
system.add("shaper", "fmus/InputShaper.fmu", shaper="zvd", natural_frequency=[FREQUENCY])
system.add("plant", "fmus/MassSpringDamper.fmu", stiffness=STIFFNESS, damping=0.0)
system.connect("shaper.shaped", "plant.force")
packed = system.to_fmu("fmus/shaped_plant.fmu", rename={"shaper.command": "force", "plant.position": "position"})
print(packed)

force = np.array([(0.0, STIFFNESS), (STOP, STIFFNESS)], dtype=[("time", float), ("force", float)])  # one metre of the spring
host = simulate_fmu(
    "fmus/shaped_plant.fmu", stop_time=STOP, step_size=STEP, output_interval=STEP, input=force, start_values={"force": STIFFNESS}
)

system.drive("shaper.command", STIFFNESS)
grid = system.simulate(STOP, STEP, exact=False, algorithm="parallel")  # as a host that steps both FMUs side by side
fine = system.simulate(STOP, 0.002)

lines = [
    Line("exact", fine.time, fine["plant.position"]),
    Line("one FMU, steps of 50 ms", host["time"], host["position"], markers=True),
    Line("two FMUs on a grid of 50 ms", grid.time, grid["plant.position"], markers=True),
]
for label, time, position in (("one FMU", host["time"], host["position"]), ("two FMUs", grid.time, grid["plant.position"])):
    rest = position[time > 1.0]
    print(f"{label:9}  residual vibration {100 * (rest.max() - rest.min()) / 2:7.3f} % of the move")

figure = Figure("one_fmu", "ZVD on a mass and a spring: a host that steps by 50 ms", "time [s]", "position [m]", lines)
print(write_picture(figure, Path("results/07_one_fmu.png")))
