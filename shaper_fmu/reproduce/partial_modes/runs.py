"""The runs for Jung (2011): a step or an S-shaped move -> InputShaper -> PositionController -> ThreeMassChain, fed back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.reproduce.partial_modes.machine import SET_A, Machine

STEP = 0.0005
"""Communication step [s]; the loop is coupled with order 2, and errs by 1e-6 m. An S-shaped move is passed on as steps of this
length, each of which is an event behind the shaper, so that it errs by 2e-4 m."""
STOP = 18.0
"""End of the runs [s]: every response has settled to 0.5 % before."""
S_TIME = 1.0
"""Duration of the S-shaped move [s]; the paper prints none."""
MASSES = ("chain.position[1]", "chain.position[2]", "chain.position[3]")
SPEEDS = ("chain.velocity[1]", "chain.velocity[2]", "chain.velocity[3]")
PRINTED = (3.85, 0.096), (9.42, 0.24)
"""(natural frequency [rad/s], damping ratio) of the paper's modes 1 and 2, eq. (11)."""

Mode = tuple[float, float]


@dataclass(frozen=True)
class Case:
    """A response of the three masses; arrays of shape (n,), `positions` (3, n).

    Attributes:
        overshoot: in % of the way; shape (3,), as what follows.
        rise: time until a mass first has 90 % of the way [s].
        enveloped5: time from which on the envelope of a mass, the sum of its modes', is within 5 % [s].
        settled5, settled2: time from which on a mass stays within 5 % and 2 % [s]. These jump where a swing just touches the
            band; overshoot, rise, envelope and energy do not.
    """

    time: np.ndarray
    command: np.ndarray
    positions: np.ndarray
    duration: float
    overshoot: np.ndarray
    rise: np.ndarray
    enveloped5: np.ndarray
    settled5: np.ndarray
    settled2: np.ndarray

    def energy(self, since: float = 0.0) -> np.ndarray:
        """Integral of (x - 1)^2 from a time [s] to the end of the run, for each mass [m2 s]; shape (3,)."""
        after = self.time >= since - 1e-12
        return trapezoid((self.positions[:, after] - 1.0) ** 2, self.time[after], axis=1)

    @property
    def steps(self) -> list[tuple[float, float]]:
        """(time [s], level after it) of each step of the shaped command."""
        changed = np.flatnonzero(np.diff(self.command) != 0.0) + 1
        first = [(0.0, float(self.command[0]))] if self.command[0] != 0.0 else []
        return [*first, *((float(self.time[i]), float(self.command[i])) for i in changed)]

    def thinned(self, every: int = 20) -> tuple[np.ndarray, np.ndarray]:
        """Times and positions for a figure."""
        return self.time[::every], self.positions[:, ::every]


def chain_modes(machine: Machine) -> tuple[Mode, Mode]:
    """The modes of the free chain, as its FMU calculates them."""
    system = System("modes")
    rest = {"force": 0.0, **{f"disturbance[{i}]": 0.0 for i in (1, 2, 3)}}
    system.add("chain", fmu_path("ThreeMassChain"), {**rest, **machine.chain_values()})
    names = [f"chain.{what}[{i}]" for i in (1, 2) for what in ("natural_frequency", "damping_ratio")]
    found = system.simulate(0.1, 0.1, record=names)
    w1, z1, w2, z2 = (float(found[name][-1]) for name in names)
    return (w1, z1), (w2, z2)


def loop(s_shaped: bool = False) -> System:
    """The system, with a step of 1 m or an S-shaped move (a cycloid: the speed is a raised cosine) as the command."""
    system = System("partial_modes_three_mass")
    system.add("shaper", fmu_path("InputShaper"), shaper="none")
    system.add("controller", fmu_path("PositionController"))
    system.add("chain", fmu_path("ThreeMassChain"), {f"disturbance[{i}]": 0.0 for i in (1, 2, 3)})
    for name, value in SET_A.start_values().items():
        system.set(name, value)
    if s_shaped:
        system.add("profile", fmu_path("MotionProfile"), profile="cycloid", duration=S_TIME)
        system.connect("profile.position", "shaper.command")
    else:
        system.set("shaper.command", 1.0)
    system.connect("shaper.shaped", "controller.reference")
    system.connect("controller.force", "chain.force")
    system.connect("chain.position[1]", "controller.position")
    system.connect("chain.velocity[1]", "controller.velocity")
    return system


def shaping(modes: tuple[Mode, ...], kind: str = "zvd") -> dict[str, Any]:
    """Start values of a shaper for these modes."""
    values: dict[str, Any] = {"shaper.shaper": kind if modes else "none", "shaper.modes": max(1, len(modes))}
    for i, (w, zeta) in enumerate(modes, 1):
        values |= {f"shaper.natural_frequency[{i}]": w, f"shaper.damping_ratio[{i}]": zeta}
    return values


class Bench:
    """The system's FMUs, to be run again and again with other shapers."""

    def __init__(self, s_shaped: bool = False):
        self._move: float = S_TIME if s_shaped else 0.0
        self._simulation = Simulation(loop(s_shaped), [*MASSES, *SPEEDS, "shaper.shaped", "shaper.duration"])

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *error: object) -> None:
        self._simulation.close()

    def run(self, machine: Machine, modes: tuple[Mode, ...], kind: str = "zvd") -> Case:
        """The response with a shaper for these modes."""
        values = {**machine.start_values(), **shaping(modes, kind)}
        found = self._simulation.run(STOP, STEP, start_values=values, interpolation="linear", everywhere=True)
        positions, speeds = (np.array([found[name] for name in names]) for names in (MASSES, SPEEDS))
        duration = float(found["shaper.duration"][-1])
        last = int(np.argmin(np.abs(found.time - duration - self._move)))
        return Case(
            found.time,
            found["shaper.shaped"],
            positions,
            duration,
            100.0 * np.maximum(0.0, positions.max(axis=1) - 1.0),
            np.array([first_reached(found.time, x, 0.9) for x in positions]),
            found.time[last] + envelope_times(machine, positions[:, last], speeds[:, last], 0.05),
            np.array([settling_time(found.time, x, 0.05) for x in positions]),
            np.array([settling_time(found.time, x, 0.02) for x in positions]),
        )


def first_reached(time: np.ndarray, x: np.ndarray, level: float) -> float:
    """The time at which x first reaches a level [s], between the points by a straight line."""
    i = int(np.argmax(x >= level))
    return float(time[i - 1] + (time[i] - time[i - 1]) * (level - x[i - 1]) / (x[i] - x[i - 1]))


def envelope_times(machine: Machine, positions: np.ndarray, speeds: np.ndarray, band: float) -> np.ndarray:
    """The times from a state on [s], (3,), after which the envelope of each mass about 1 m stays within the band, in m.

    The envelope is the sum of the magnitudes of the closed loop's modes, so that it falls all the time.
    """
    poles, shapes = np.linalg.eig(machine.closed_loop()[0])
    rates = np.real(poles)
    amplitude = np.abs(shapes * np.linalg.solve(shapes, np.concatenate([positions - 1.0, speeds]).astype(complex)))

    def over(t: float, j: int) -> float:
        return float(amplitude[j] @ np.exp(rates * t)) - band

    return np.array([brentq(over, 0.0, 100.0, args=(j,)) if over(0.0, j) > 0.0 else 0.0 for j in range(3)])


def settling_time(time: np.ndarray, x: np.ndarray, band: float) -> float:
    """The time after which |x - 1| stays within the band [s], between the points by a straight line."""
    error = np.abs(x - 1.0) - band
    outside = np.flatnonzero(error > 0.0)
    if not len(outside):
        return 0.0
    i = int(outside[-1])
    if i + 1 == len(x):
        return float("inf")
    return float(time[i] + (time[i + 1] - time[i]) * error[i] / (error[i] - error[i + 1]))


def cases(bench: Bench, machine: Machine, slow: Mode, fast: Mode, done: Callable[[], None]) -> dict[str, Case]:
    """No shaper, ZVD on the fast mode, on the slow one, and on both."""
    found = {}
    for name, modes in {"none": (), "fast": (fast,), "slow": (slow,), "both": (slow, fast)}.items():
        found[name] = bench.run(machine, modes)
        done()
    return found


def residual_by_printed_formula(mode: Mode) -> float:
    """What eq. (8) as printed, K = exp(+ zeta pi / sqrt(1 - zeta^2)), leaves of its own mode, of a step's residual [%].

    Two equal oscillator FMUs, one with the shaper and one with the bare step, at the last impulse and half a period on.
    """
    w, zeta = mode
    damped = w * float(np.sqrt(1.0 - zeta * zeta))
    k, half = float(np.exp(zeta * np.pi * w / damped)), np.pi / damped
    system = System("eq8")
    oscillator = fmu_path("MassSpringDamper")
    system.add("shaper", fmu_path("InputShaper"), {
        "shaper": "custom", "command": w * w, "custom_impulses": 2, "custom_delay[2]": half,
        "custom_amplitude[1]": 1.0 / (1.0 + k), "custom_amplitude[2]": k / (1.0 + k),
    })  # fmt: skip
    system.add("plant", oscillator, stiffness=w * w, damping=2.0 * zeta * w)
    system.connect("shaper.shaped", "plant.force")
    found = system.simulate(half, half / 10, record=["plant.position", "plant.velocity"])
    # V of Singer and Seering: the envelope at the last impulse over that of a step at its own time, which is 1 / sqrt(1 - zeta^2)
    x, v = found["plant.position"][-1] - 1.0, found["plant.velocity"][-1]
    return 100.0 * float(np.sqrt((1.0 - zeta * zeta) * x * x + (v / w + zeta * x) ** 2))
