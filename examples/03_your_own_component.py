"""From a Python file with a component (my_plant.py) to an FMU in a coupled run, and the same kernel called from Python.

Leaves results/03_your_own_component.png.
"""

from pathlib import Path
from typing import Any

from shaper_fmu import System, build_fmu, load_components
from shaper_fmu.page import Figure, Line, write_picture

tank: Any = load_components(Path(__file__).with_name("my_plant.py"))[0]
fmu = build_fmu(tank, "fmus", platforms=["this"])
print(f"{fmu}: {fmu.stat().st_size} bytes")

system = System("tank")
system.add("tank", fmu, area=0.4)
system.drive("tank.inflow", ([0.0, 10.0], [0.05, 0.02]))  # m3/s: less from 10 s on
results = system.simulate(stop_time=30.0, step=0.5)

plain = tank(area=0.4, inflow=0.05)  # the same object that runs inside the FMU
plain.initialize()
for i in range(20):
    plain.do_step(0.5 * i, 0.5)
print(f"level at 10 s: {results['tank.level'][20]:.15f} m by the FMU, {plain.level:.15f} m by the object")

line = Line("level", results.time, results["tank.level"])
figure = Figure("tank", "A tank, as an FMU of one's own", "time [s]", "level [m]", [line])
print(write_picture(figure, Path("results/03_your_own_component.png")))
