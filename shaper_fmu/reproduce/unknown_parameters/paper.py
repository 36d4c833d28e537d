"""Commands on a plant whose natural frequency and damping ratio both differ from the design, with the FMUs.

The papers vary the frequency, or announce to vary the damping: Kilic and Kapucu (2011) ask how their two-part command bears a
wrong damping, Ozokutan et al. (2025) want damping in their profile, Taskin, Kilic and Kapucu (2019) say that neither need be
known. Here all their commands move the plant of the last paper, a MassSpringDamper, beside the common shapers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line, Map
from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Claim, Reproduction
from shaper_fmu.reproduce.pwm.runs import DAMPING_RATIO, HALF_PERIOD, NATURAL_FREQUENCY
from shaper_fmu.reproduce.runs import OscillatorBench, band_below

LEVEL = 5.0
"""Tolerated V [%]."""
BELOW = LEVEL * (1.0 + 1e-6)
"""An EI shaper has just that much, nominally."""
FREQUENCY = np.linspace(0.7, 1.3, 31)
"""Natural frequency over the designed one, shape (n,)."""
DAMPING = np.linspace(0.0, 2.0 * DAMPING_RATIO, 21)
"""Damping ratio, the designed one in the middle, shape (m,)."""
PERIOD = 2.0 * math.pi / NATURAL_FREQUENCY
MOVE = 0.85 * PERIOD
"""Duration of the profiles [s]: 0.85 periods, as in Kilic and Kapucu (0.9703 s at 5.5045 rad/s)."""
STOP, STEP = 2.0 * HALF_PERIOD + 0.01, 0.01
PROFILE_STEP = MOVE / 100.0
"""Profiles are held over steps: late by half a step, which is allowed for, and wrong by a share of (w h)^2 / 24 or so: 1e-4."""


@dataclass(frozen=True)
class Command:
    """How a command is made of FMUs: `build` adds them and returns the command's output; its duration [s] or the variable of it."""

    name: str
    build: Callable[[System], str]
    duration: float | str
    step: float = STEP


def _shaper(kind: str) -> Callable[[System], str]:
    def build(system: System) -> str:
        system.add("shaper", fmu_path("InputShaper"), natural_frequency=[NATURAL_FREQUENCY], damping_ratio=[DAMPING_RATIO])
        system.set("shaper.shaper", kind)
        system.set("shaper.command", 1.0)
        return "shaper.shaped"

    return build


def _profile(kind: str, damping_ratio: float = DAMPING_RATIO) -> Callable[[System], str]:
    def build(system: System) -> str:
        system.add("profile", fmu_path("MotionProfile"), profile=kind, duration=MOVE)
        system.set("profile.natural_frequency", NATURAL_FREQUENCY)
        system.set("profile.damping_ratio", damping_ratio)
        system.add("shaper", fmu_path("InputShaper"), shaper="none")  # hands metres on as a number
        system.connect("profile.position", "shaper.command")
        return "shaper.shaped"

    return build


def _train(design: str) -> Callable[[System], str]:
    def build(system: System) -> str:
        system.add("train", fmu_path("PulseTrain"), natural_frequency=NATURAL_FREQUENCY, damping_ratio=DAMPING_RATIO)
        for name, value in {"design": design, "duration": HALF_PERIOD, "frequency_ratio": 12.0}.items():
            system.set(f"train.{name}", value)
        return "train.pulse"

    return build


COMMANDS = [
    *(Command(name, _shaper(kind), "shaper.duration") for name, kind in {"ZV": "zv", "ZVD": "zvd", "EI": "ei"}.items()),
    *(
        Command(name, _profile(kind), MOVE, PROFILE_STEP)
        for name, kind in {"single profile": "cycloid_versine_ramp", "two-part": "two_part", "S-curve": "s_curve"}.items()
    ),
    *(
        Command(name, _train(design), "train.travel_time")
        for name, design in {"PWM, ratio 12": "carrier", "on/off, minimax": "minimax", "on/off, UM-ZVD": "um_zvd"}.items()
    ),
]
UNDAMPED = Command("S-curve designed without damping", _profile("s_curve", 0.0), MOVE, PROFILE_STEP)


ERRORS = (0.8, 0.9, 1.1, 1.2)
"""Estimates of the natural frequency over the true one."""


@dataclass(frozen=True)
class Found:
    """V [%] of a command, shape (m, n), over damping ratios (m,) and natural frequencies by the designed one (n,).

    Both are odd in number, with the designed value in the middle. `duration` is the command's [s].
    """

    frequency: np.ndarray
    damping: np.ndarray
    values: np.ndarray
    duration: float

    def over_frequency(self) -> np.ndarray:
        """At the designed damping ratio, shape (n,)."""
        return self.values[len(self.damping) // 2]

    def over_damping(self) -> np.ndarray:
        """At the designed natural frequency, shape (m,)."""
        return self.values[:, len(self.frequency) // 2]

    def nominal(self) -> float:
        """V [%] of the designed plant."""
        return float(self.over_frequency()[len(self.frequency) // 2])

    def width(self) -> float:
        """Width of the band of w/wn round 1 with V below the level."""
        low, high = band_below(self.frequency, self.over_frequency(), BELOW, 1.0)
        return high - low

    def share(self) -> float:
        """Share of the map with V below the level."""
        return float(np.mean(self.values < BELOW))


def reproduce(update: Update) -> Reproduction:
    """Run all commands over the map; `update(done, total)` counts the rows of all maps."""
    commands = [*COMMANDS, UNDAMPED]
    total, found = len(commands) * len(DAMPING), {}
    for number, command in enumerate(commands):

        def row_done(row: int, before: int = number * len(DAMPING)) -> None:
            update(before + row, total)

        found[command.name] = vibration_map(command, FREQUENCY, DAMPING, row_done)
    estimates = two_part_by_estimate()
    return Reproduction(
        "unknown-parameters",
        "Natural frequency and damping ratio both unknown",
        "What the papers announce, or leave open: Kilic and Kapucu 2011, Taskin, Kilic and Kapucu 2019, Ozokutan, Karadag, "
        "Kapucu and Kutuk 2025",
        _claims(found, estimates),
        [*_blocks(found), _estimates_table(estimates)],
    )


def vibration_map(
    command: Command, frequency: np.ndarray, damping: np.ndarray, row_done: Callable[[int], None] = lambda _row: None
) -> Found:
    """V of a command on all plants of natural frequencies (over the designed one), shape (n,), and damping ratios, (m,)."""
    keep = [command.duration] if isinstance(command.duration, str) else []
    end = command.duration if isinstance(command.duration, str) else command.duration + 0.5 * command.step
    values, duration = np.empty((len(damping), len(frequency))), 0.0
    with OscillatorBench(command.build, STOP if keep else MOVE, command.step, keep=keep) as bench:
        for i, ratio in enumerate(damping):
            for k, x in enumerate(frequency):
                residuals = bench.residuals({}, float(x) * NATURAL_FREQUENCY, float(ratio), end)
                values[i, k] = 100.0 * residuals.vibration
                duration = residuals.duration if keep else MOVE
            row_done(i + 1)
    return Found(frequency, damping, values, duration)


def two_part_by_estimate() -> dict[str, list[float]]:
    """V [%] of the two-part command at `ERRORS`: by a wrong estimate at the same duration, and at one in periods of the estimate.

    At last by the plant's frequency, with the same command, at plants of `ERRORS` times the designed frequency.
    """
    found: dict[str, list[float]] = {"same duration": [], "duration in periods of the estimate": [], "plant": []}
    with OscillatorBench(_profile("two_part"), MOVE / ERRORS[0], PROFILE_STEP) as bench:
        for x in ERRORS:
            for (name, values), duration in zip(found.items(), (MOVE, MOVE / x, MOVE), strict=True):
                plant, designed = (x, 1.0) if name == "plant" else (1.0, x)
                command = {"profile.duration": duration, "profile.natural_frequency": designed * NATURAL_FREQUENCY}
                step = duration / 2000.0
                left = bench.residuals(command, plant * NATURAL_FREQUENCY, DAMPING_RATIO, duration + 0.5 * step, step=step)
                values.append(100.0 * left.vibration)
    return found


def _estimates_table(estimates: dict[str, list[float]]) -> Table:
    labels = {"plant": "plant changed, command the same"}
    rows = [[labels.get(name, f"estimate wrong, {name}"), *(f"{v:.2f}" for v in values)] for name, values in estimates.items()]
    head = ["two-part command", *(f"{100.0 * (x - 1.0):+.0f} %" for x in ERRORS)]
    return Table("V [%] by the error of the estimate, or of the plant", head, rows)


def _claims(found: dict[str, Found], estimates: dict[str, list[float]]) -> list[Claim]:
    two, single, pwm, zv = (found[name] for name in ("two-part", "single profile", "PWM, ratio 12", "ZV"))
    s_curve, undamped, flat = found["S-curve"], found[UNDAMPED.name], found["on/off, UM-ZVD"]
    off = {name: max(f.over_damping()[0], f.over_damping()[-1]) for name, f in found.items()}
    return [
        Claim(
            "Kilic and Kapucu 2011, section 5: how the two-part command tolerates a wrong damping remains to be studied",
            f"V up to {off['two-part']:.2f} %, the single profile {off['single profile']:.2f} %",
            "reproduced" if off["two-part"] < off["single profile"] else "not reproduced",
            f"Damping ratios from {two.damping[0]:g} to {two.damping[-1]:g}, designed for "
            f"{DAMPING_RATIO}. Reproduced means that the two-part command tolerates it better, as it does a wrong frequency: "
            f"V < 5 % over {two.width():.3f} in w/wn against {single.width():.3f}.",
        ),
        Claim(
            "Kilic and Kapucu 2011, abstract: residual vibration is reduced fairly in spite of wrong system parameters",
            f"V < 5 % on {two.share():.0%} of the map, the single profile {single.share():.0%}",
            "reproduced" if two.share() > single.share() else "not reproduced",
            "Both parameters wrong at once. Which way to err: for a fixed duration, estimate the frequency high rather than low "
            f"(V = {_list(estimates['same duration'])} % at -20, -10, +10, +20 %); if the duration is chosen in periods of the "
            f"estimate, low rather than high ({_list(estimates['duration in periods of the estimate'])} %).",
        ),
        Claim(
            "Taskin, Kilic and Kapucu 2019, abstract: it works robustly even if natural frequency and damping are not known",
            f"V < 5 % on {pwm.share():.0%} of the map, ZV {zv.share():.0%}",
            "reproduced" if pwm.share() > zv.share() else "not reproduced",
            f"Ratio 12 and 0.1374 s, both parameters wrong at once. UM-ZVD, also on/off, has {flat.share():.0%} with "
            f"{flat.duration / PERIOD:.2f} periods in the place of {pwm.duration / PERIOD:.2f}.",
        ),
        Claim(
            "Ozokutan et al. 2025, conclusion: damping is to be included in the model",
            f"V = {s_curve.nominal():.1e} % with it, {undamped.nominal():.2f} % without",
            "reproduced" if s_curve.nominal() < 0.01 < undamped.nominal() else "not reproduced",
            f"The S-curve with a ramped versine against the damping, on a plant with {DAMPING_RATIO}; what is left is of "
            "holding the profile over steps. Reproduced means that it helps.",
        ),
    ]


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _blocks(found: dict[str, Found]) -> list[Block]:
    panels = [(command.name, found[command.name].values) for command in COMMANDS]
    axis, ratio = "natural frequency over the designed one", "damping ratio"
    x, y = found["ZV"].frequency, found["ZV"].damping
    levels = [(LEVEL, f"{LEVEL:g} %"), (10.0, "10 %"), (20.0, "20 %")]
    nominal = [(1.0, DAMPING_RATIO)]
    shown = ["single profile", "two-part", "S-curve", UNDAMPED.name, "ZVD"]
    lines = [Line(name, found[name].damping, found[name].over_damping(), style=i) for i, name in enumerate(shown)]
    rows = []
    for name, f in found.items():
        low, high = band_below(f.damping, f.over_damping(), BELOW, DAMPING_RATIO)
        bands = [f"{f.width():.3f}", f"{low:.3f} .. {high:.3f}" if high > low else "none", f"{f.share():.1%}"]
        rows.append([name, f"{f.duration / PERIOD:.3f}", f"{f.nominal():.3f}", *bands])
    head = ["command", "duration [periods]", "nominal V [%]", "width of V < 5 % in w/wn", "V < 5 % in damping", "of the map"]
    title = "Residual vibration V with both parameters wrong"
    return [
        Text(
            f"V: envelope at the command's end over that of a step at its start. Designed for {NATURAL_FREQUENCY} rad/s and "
            f"a damping ratio of {DAMPING_RATIO} (the crosses); {panels[0][1].size} runs a map."
        ),
        Map("map", title, axis, ratio, "V [%]", x, y, panels, levels, 30.0, nominal),
        Table("Robustness", head, rows),
        Figure("damping", "Wrong damping ratio", ratio, "V [%]", lines, [(LEVEL, f"{LEVEL:g} %")], [(DAMPING_RATIO, "designed")]),
    ]
