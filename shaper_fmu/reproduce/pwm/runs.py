"""The runs for the pulse width modulated commands of Taskin, Kilic and Kapucu (2019): FMUs PulseTrain and MassSpringDamper."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.runs import OscillatorBench, plant_values

NATURAL_FREQUENCY = 22.9476
"""wn [rad/s], below eq. (2) of the paper, as the damping ratio."""
DAMPING_RATIO = 0.0891
STIFFNESS = NATURAL_FREQUENCY * NATURAL_FREQUENCY
"""Of a mass of 1 kg [N/m]; the paper prints no masses and springs."""
HALF_PERIOD = math.pi / (NATURAL_FREQUENCY * math.sqrt(1.0 - DAMPING_RATIO * DAMPING_RATIO))
"""Td/2 [s], the travel time of figs. 1 to 4 and 6."""
SHORT = 0.1222
"""The shorter travel time [s] of figs. 5 and 7."""
STEP = 0.01
"""Communication step [s]; the pulses are a tenth of it and fall where they like."""
STOP = 0.3
"""End of the runs [s], after every command's end."""

LONG_CASE, SHORT_CASE, ZV_CASE = "proposed, 0.1374 s", "proposed, 0.1222 s", "ZV + PWM"
CASES: dict[str, dict[str, Any]] = {
    LONG_CASE: {"train.design": "carrier", "train.duration": HALF_PERIOD},
    SHORT_CASE: {"train.design": "carrier", "train.duration": SHORT},
    ZV_CASE: {"train.design": "zv_carrier"},
}
"""The paper's commands, less their frequency ratio."""

DESIGNS: dict[str, dict[str, Any]] = {
    "minimax, 0.1374 s": {"train.design": "minimax", "train.duration": HALF_PERIOD},
    "minimax, 0.1222 s": {"train.design": "minimax", "train.duration": SHORT},
    "UM-ZV": {"train.design": "um_zv"},
    "UM-ZVD": {"train.design": "um_zvd"},
    "polished carrier, ratio 12, 0.1374 s": {"train.design": "carrier_polished", "train.duration": HALF_PERIOD},
    "polished carrier, ratio 13, 0.1222 s": {
        "train.design": "carrier_polished", "train.duration": SHORT, "train.frequency_ratio": 13.0,
    },
}  # fmt: skip
"""Other on/off commands, for comparison."""

KEPT = ["train.travel_time", "train.residual_vibration", "train.minimum_pulse_width", "train.pulses"]


@dataclass(frozen=True)
class Scan:
    """A command over the frequency ratio; arrays of shape (n,).

    `relative` and `vibration` in % (see `Residuals`), `designed`: V by the FMU's own design formula [%], `width`: of the shortest
    pulse or gap [s], `pulses`: rising edges.
    """

    ratio: np.ndarray
    relative: np.ndarray
    vibration: np.ndarray
    designed: np.ndarray
    width: np.ndarray
    pulses: np.ndarray

    def whole(self) -> Scan:
        """At whole ratios alone."""
        chosen = np.abs(self.ratio - np.round(self.ratio)) < 1e-9
        return Scan(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))

    def at(self, ratio: float) -> int:
        """The index of a ratio."""
        return int(np.abs(self.ratio - ratio).argmin())


def train(system: System, output: str = "pulse") -> str:
    """The paper's PulseTrain for its plant; returns the command's name."""
    system.add("train", fmu_path("PulseTrain"), natural_frequency=NATURAL_FREQUENCY, damping_ratio=DAMPING_RATIO)
    system.set("train.frequency_ratio", 12.0)
    return f"train.{output}"


def train_bench(output: str = "pulse") -> OscillatorBench:
    """The train on the plant."""
    return OscillatorBench(lambda system: train(system, output), STOP, STEP, STIFFNESS, KEPT)


def zv_bench() -> OscillatorBench:
    """A step through an InputShaper, ZV, on the plant: the staircase that the paper modulates."""

    return OscillatorBench(_shape_step, STOP, STEP, STIFFNESS, ["shaper.duration"])


def _shape_step(system: System) -> str:
    system.add("shaper", fmu_path("InputShaper"), natural_frequency=[NATURAL_FREQUENCY], damping_ratio=[DAMPING_RATIO])
    system.set("shaper.shaper", "zv")
    system.set("shaper.command", 1.0)
    return "shaper.shaped"


def zv_staircase() -> tuple[float, float]:
    """The first and the last level of a step through the ZV shaper."""
    system = System("staircase")
    command = _shape_step(system)
    levels = system.simulate(STOP, STEP, record=[command])[command]
    return float(levels[0]), float(levels[-1])


def ratios(step: float) -> np.ndarray:
    """Frequency ratios from 1 to 25, shape (n,)."""
    return np.round(np.arange(round(24.0 / step) + 1) * step + 1.0, 9)


def scan(bench: OscillatorBench, case: dict[str, Any], grid: np.ndarray, done: Callable[[], None], **options: Any) -> Scan:
    """A case at all frequency ratios of the grid."""
    rows = []
    for ratio in grid:
        values = {**case, "train.frequency_ratio": float(ratio)}
        residuals = bench.residuals(values, NATURAL_FREQUENCY, DAMPING_RATIO, "train.travel_time", **options)
        kept = residuals.kept
        designed = 100.0 * kept["train.residual_vibration"]
        rows.append(
            (
                100.0 * residuals.relative,
                100.0 * residuals.vibration,
                designed,
                kept["train.minimum_pulse_width"],
                kept["train.pulses"],
            )
        )
    done()
    return Scan(grid, *np.array(rows).T)


def vibration(bench: OscillatorBench, case: Mapping[str, Any], frequency: float = 1.0, damping: float = DAMPING_RATIO) -> float:
    """V [%] on a plant of `frequency` times the paper's natural frequency, and of this damping ratio."""
    duration = bench.keep[0]
    return 100.0 * bench.residuals(case, frequency * NATURAL_FREQUENCY, damping, duration).vibration


def time_response(case: dict[str, Any], ratio: float, stop: float) -> Results:
    """Reference, carrier, pulses and the plant's position every 0.25 ms, with both sides of jumps."""
    system = System("pulse width modulation")
    command = train(system)
    system.add("plant", fmu_path("MassSpringDamper"))
    system.connect(command, "plant.force", gain=STIFFNESS)
    for name, value in {
        **case,
        "train.frequency_ratio": ratio,
        **plant_values(STIFFNESS, NATURAL_FREQUENCY, DAMPING_RATIO),
    }.items():
        system.set(name, value)
    record = ["train.reference", "train.carrier", "train.pulse", "plant.position"]
    return system.simulate(stop, 2.5e-4, record=record, everywhere=True)


def switch_times(results: Results) -> np.ndarray:
    """Times at which the pulses switch [s], shape (n,): of rows with both sides of jumps."""
    return results.time[1:][np.diff(results["train.pulse"]) != 0.0]


def damped_frequency() -> float:
    """wd [rad/s]: pi over the time of a step response to its first peak, where the plant's velocity vanishes."""
    system = System("step")
    system.add("plant", fmu_path("MassSpringDamper"), force=STIFFNESS)
    for name, value in plant_values(STIFFNESS, NATURAL_FREQUENCY, DAMPING_RATIO).items():
        system.set(name, value)
    results = system.simulate(0.2, 1e-4, record=["plant.velocity"])
    speed = results["plant.velocity"]
    i = int(np.flatnonzero((speed[:-1] > 0.0) & (speed[1:] <= 0.0))[0])
    peak = results.time[i] + (results.time[i + 1] - results.time[i]) * speed[i] / (speed[i] - speed[i + 1])
    return math.pi / float(peak)


def profile_vibration(duration: float) -> float:
    """V [%] of the reference profile itself, before modulation, held over 20 000 steps."""

    def build(system: System) -> str:
        system.add("profile", fmu_path("MotionProfile"), profile="cycloid_versine_ramp", duration=duration)
        system.set("profile.natural_frequency", NATURAL_FREQUENCY)
        system.set("profile.damping_ratio", DAMPING_RATIO)
        system.add("shaper", fmu_path("InputShaper"), shaper="none")  # hands metres on as a number
        system.connect("profile.position", "shaper.command")
        return "shaper.shaped"

    with OscillatorBench(build, duration, duration / 20_000, STIFFNESS) as bench:
        return 100.0 * bench.residuals({}, NATURAL_FREQUENCY, DAMPING_RATIO, duration).vibration


def on_the_grid(steps: list[float], update: Update) -> dict[str, dict[tuple[str, float], Scan]]:
    """The paper's commands at whole ratios where steps do not end at the pulses: held, and as means, by (case, step [s])."""
    found: dict[str, dict[tuple[str, float], Scan]] = {}
    count = 0
    for output in ("pulse", "pulse_mean"):
        with train_bench(output) as bench:
            for case, values in CASES.items():
                for step in steps:
                    count += 1
                    update(count, 2 * len(CASES) * len(steps))
                    found.setdefault(output, {})[case, step] = scan(
                        bench, values, ratios(1.0), lambda: None, exact=False, step=step
                    )
    return found
