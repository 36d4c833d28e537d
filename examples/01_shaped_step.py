"""Move an oscillator by a step: unshaped, and shaped by ZV and ZVD. All three are FMUs, coupled by the master.

Leaves results/01_shaped_step.png. Run it from anywhere: python examples/01_shaped_step.py
"""

from pathlib import Path

from shaper_fmu import System, build_fmu, find_component
from shaper_fmu.page import Figure, Line, write_picture

for name in ("InputShaper", "MassSpringDamper"):
    build_fmu(find_component(name), "fmus", platforms=["this"])

lines = []
for shaper in ("none", "zv", "zvd"):
    system = System("shaped_step")
    system.add("shaper", "fmus/InputShaper.fmu", shaper=shaper, natural_frequency=[10.0], damping_ratio=[0.05])
    system.add("plant", "fmus/MassSpringDamper.fmu", mass=1.0, stiffness=100.0, damping=1.0)
    system.drive("shaper.command", 100.0)  # N: one metre of the spring
    system.connect("shaper.shaped", "plant.force")
    results = system.simulate(stop_time=3.0, step=0.01)  # the steps end at the impulses, too, which fall between the points
    lines.append(Line(shaper, results.time, results["plant.position"]))
    late = results["plant.position"][results.time > 1.5]
    print(f"{shaper:5}  swing after 1.5 s: {1000 * (late.max() - late.min()):8.3f} mm peak to peak")

figure = Figure("shaped_step", "A step of 100 N on a mass of 1 kg and a spring of 100 N/m", "time [s]", "position [m]", lines)
print(write_picture(figure, Path("results/01_shaped_step.png")))
