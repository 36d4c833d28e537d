"""How wrong may the stiffness be? ZV and ZVD swept over it, and their insensitivity read off and compared with the formula.

The system is built in Python; the sweep is resumable: run it again, and nothing is left to do.
Leaves results/04_robustness_sweep.png.
"""

import numpy as np
from matplotlib.figure import Figure

from shaper_fmu import System, build_fmu, find_component, shaper, sweep_system
from shaper_fmu.analysis import insensitivity
from shaper_fmu.metrics import Residual
from shaper_fmu.sweep import Refine, Store, Vary

NATURAL_FREQUENCY, TOLERANCE = 10.0, 0.05  # rad/s, share of the unshaped vibration
STIFFNESS = NATURAL_FREQUENCY**2  # N/m, of a mass of 1 kg
STORE = "results/04_robustness_sweep.sqlite"

fmus = {name: build_fmu(find_component(name), "fmus", platforms=["this"]) for name in ("InputShaper", "MassSpringDamper")}
system = System("Wrong stiffness")
system.add("shaper", fmus["InputShaper"], command=1.0, natural_frequency=[NATURAL_FREQUENCY], damping_ratio=[0.0])
system.add("plant", fmus["MassSpringDamper"], mass=1.0, stiffness=STIFFNESS, damping=0.0)
system.connect("shaper.shaped", "plant.force")

counts = sweep_system(
    system,
    STORE,  # in this process; with workers=2 in two others
    vary={"plant.stiffness": Vary(low=0.36 * STIFFNESS, high=1.96 * STIFFNESS, points=61)},
    compare={kind: {"shaper.shaper": kind} for kind in ("none", "zv", "zvd")},
    reference="none",
    metrics={"residual": Residual("plant.position", command="shaper.shaped")},
    refine=Refine(metric="residual", level=TOLERANCE, width=0.01),  # N/m: where the residual crosses 5 %, runs in between
    stop_time=2.0,  # ZVD takes 0.63 s, the slowest vibration has a period of 1.05 s
    step=0.001,
)
print(f"{counts['done']} runs done, in {STORE}")

found: dict[str, dict[float, float]] = {}  # residual by case and stiffness
with Store(STORE) as store:
    for run in store.iterate("done"):
        found.setdefault(run.compared, {})[float(run.varied["plant.stiffness"])] = run.metrics["residual"]

figure = Figure(layout="constrained")
axes = figure.subplots()
for kind in ("zv", "zvd"):
    stiffness = np.array(sorted(found[kind]))
    share = np.array([found[kind][k] / found["none"][k] for k in stiffness])
    frequency = np.sqrt(stiffness / STIFFNESS)  # actual over designed
    soft, stiff = frequency <= 1.0, frequency >= 1.0
    low, high = (np.interp(TOLERANCE, share[side][::turn], frequency[side][::turn]) for side, turn in ((soft, -1), (stiff, 1)))
    formula = insensitivity(shaper(kind, NATURAL_FREQUENCY, 0.0), NATURAL_FREQUENCY, tolerance=TOLERANCE)
    print(f"{kind:3}  insensitivity {high - low:.5f} by {len(share)} runs, {formula:.5f} by the formula")
    axes.plot(frequency, 100.0 * share, label=kind.upper())

axes.axhline(100.0 * TOLERANCE, color="grey", linestyle="--", label=f"{100.0 * TOLERANCE:g} %")
axes.set_title("A step on a mass whose spring is not as stiff as thought")
axes.set_xlabel("actual over designed frequency")
axes.set_ylabel("residual vibration [% of the unshaped]")
axes.legend()
figure.savefig("results/04_robustness_sweep.png")
print("results/04_robustness_sweep.png")
