"""Which shaper when: every kind on a plant whose frequency is not as designed, as the table of docs/which_shaper.md.

A step moves a mass on a spring (damping ratio 0.02) whose natural frequency is 30 % lower to 30 % higher than the shaper believes.
Leaves results/08_which_shaper.png.
"""

from collections import defaultdict

import numpy as np
from matplotlib.figure import Figure

from shaper_fmu import System, build_fmu, find_component, shaper, sweep_system
from shaper_fmu.metrics import Residual
from shaper_fmu.sweep import Sampling, Store, Vary

FREQUENCY, DAMPING = 2.0 * np.pi, 0.02  # 1 Hz: times are periods
KINDS = ["um_zv", "zv", "mzv", "um_zvd", "zvd", "ei", "zvdd", "two_hump_ei", "zvddd", "three_hump_ei"]
SHOWN = (0.0, 0.05, 0.1, 0.2, 0.3)  # how wrong the frequency is, either way
RATIOS = np.arange(70, 131) / 100.0  # actual over designed
STORE = "results/08_which_shaper.sqlite"

fmus = {name: build_fmu(find_component(name), "fmus", platforms=["this"]) for name in ("InputShaper", "MassSpringDamper")}
system = System("Which shaper")
system.add("shaper", fmus["InputShaper"], command=1.0, natural_frequency=[FREQUENCY], damping_ratio=[DAMPING])
system.add("plant", fmus["MassSpringDamper"], mass=1.0)
system.connect("shaper.shaped", "plant.force")
sweep_system(
    system,
    STORE,
    # side by side: the frequency changes, the damping ratio does not
    vary={
        "plant.stiffness": Vary(values=[float((FREQUENCY * ratio) ** 2) for ratio in RATIOS]),
        "plant.damping": Vary(values=[float(2.0 * DAMPING * FREQUENCY * ratio) for ratio in RATIOS]),
    },
    plan=Sampling(kind="zip"),
    compare={kind: {"shaper.shaper": kind} for kind in ["none", *KINDS]},
    reference="none",
    metrics={"residual": Residual("plant.position", command="shaper.shaped")},
    stop_time=4.0,  # the longest shaper takes 2 periods, the slowest period is 1.43 s
    step=0.005,
)

left: dict[str, dict[float, float]] = defaultdict(dict)  # residual by kind and ratio
with Store(STORE) as store:
    for run in store.iterate("done"):
        ratio = round(float(np.sqrt(float(run.varied["plant.stiffness"]))) / FREQUENCY, 6)
        left[run.compared][ratio] = run.metrics["residual"]
share = {kind: {ratio: left[kind][ratio] / left["none"][ratio] for ratio in left[kind]} for kind in KINDS}


def worst(kind: str, wrong: float) -> float:
    """The largest share left where the frequency is wrong by this much at the most."""
    return max(value for ratio, value in share[kind].items() if abs(ratio - 1.0) <= wrong + 1e-9)


def tolerated(kind: str, tolerance: float = 0.0505) -> str:
    """How wrong the frequency may be, either way, before more than this is left; EI has its maxima at 5 % exactly."""
    wrong = max((wrong for wrong in np.arange(31) / 100.0 if worst(kind, wrong) <= tolerance), default=0.0)
    return f"±{100.0 * wrong:.0f} %" + (" at least" if wrong == 0.3 else "")


print("| shaper | delay | exact | " + " | ".join(f"±{100.0 * wrong:.0f} %" for wrong in SHOWN[1:]) + " | 5 % up to |")
for kind in KINDS:
    delay = shaper(kind, FREQUENCY, DAMPING).duration
    columns = " | ".join(f"{100.0 * worst(kind, wrong):.1f} %" for wrong in SHOWN)
    print(f"| `{kind}` | {delay:.2f} | {columns} | {tolerated(kind)} |")

figure = Figure(figsize=(8.0, 4.5), layout="constrained")
axes = figure.subplots()
for kind in ("zv", "mzv", "zvd", "ei", "two_hump_ei", "three_hump_ei"):
    axes.plot(100.0 * (RATIOS - 1.0), [100.0 * share[kind][round(float(ratio), 6)] for ratio in RATIOS], label=kind)
axes.axhline(5.0, color="grey", linestyle="--", label="5 %")
axes.set_xlabel("how wrong the frequency is [%]")
axes.set_ylabel("left, of the unshaped vibration [%]")
axes.set_ylim(0.0, 50.0)
axes.set_title("What a wrong frequency costs")
axes.legend()
figure.savefig("results/08_which_shaper.png")
print("results/08_which_shaper.png")
