"""Random plants as users have them, with what a shaper leaves of their vibration over the range, computed without FMUs.

The truth of a linear plant is V of Singer and Seering (1990) of its own mode, |sum A_i exp(p (T - t_i))|, over a fine grid of the
range; lags, integrators and noise are no part of it. That of a nonlinear one is half the peak-to-peak value after the shaped step
over that after the unshaped one, by scipy's solver of its own equation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from rough_fmus import EULER
from scipy.integrate import solve_ivp

_GRID = 41
_GRID_NONLINEAR = 7


@dataclass(frozen=True)
class Rough:
    """A plant: start values of the FMU, its default experiment [s], the spread of its mass, the step it is commanded."""

    kind: str
    values: dict[str, float]
    stop_time: float
    spread: float
    amplitude: float | None = None


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _mode(rng: np.random.Generator) -> tuple[dict[str, float], float]:
    w = _log(rng, 2.0, 60.0)
    return {"w": w, "z": _log(rng, 0.005, 0.08)}, 20.0 * 2.0 * math.pi / w


def lagging(rng: np.random.Generator) -> Rough:
    """A drive's lag of 0.03 to 1 periods, in series with the mode or beside it, sometimes with an integrator or a drift."""
    values, stop = _mode(rng)
    values["lag"] = 2.0 * math.pi / values["w"] * _log(rng, 0.03, 1.0)
    scale = values["w"] ** -2
    if rng.random() < 0.5:
        values["series"] = 1.0
    else:
        values["cl"] = scale * _log(rng, 0.1, 3.0)
    extra = rng.random()
    if extra < 0.2:
        values["ci"] = scale * values["w"] * rng.uniform(0.05, 0.3)
    elif extra < 0.4:
        values["drift"] = scale * values["w"] * rng.uniform(0.001, 0.01)
    return Rough("lag", values, stop, rng.uniform(0.03, 0.1))


def noisy(rng: np.random.Generator) -> Rough:
    """Noise of 0.1 to 2 % of what a step excites; another one in each run, or the same."""
    values, stop = _mode(rng)
    values["noise"] = values["w"] ** -2 * _log(rng, 0.001, 0.02)
    values["seed"] = float(rng.integers(0, 2) * rng.integers(1, 1000))
    return Rough("noise", values, stop, rng.uniform(0.03, 0.1))


def euler_stepped(rng: np.random.Generator) -> Rough:
    """Euler's method over the communication step; half of them move at the start."""
    values, stop = _mode(rng)
    values |= {"euler": EULER, "z": _log(rng, 0.02, 0.08)}
    if rng.random() < 0.5:
        values["q0"] = values["w"] ** -2 * rng.uniform(0.1, 1.0)
    return Rough("euler", values, stop, rng.uniform(0.03, 0.1))


def nonlinear(rng: np.random.Generator) -> Rough:
    """A pendulum, a Duffing spring or friction, at steps from small to such as change the frequency by some percent."""
    values, stop = _mode(rng)
    values["z"] = _log(rng, 0.01, 0.05)
    w2, which = values["w"] ** 2, rng.integers(3)
    deflection = _log(rng, 0.02, 0.5)
    if which == 0:
        values["pendulum"] = 1.0
    elif which == 1:
        values["cubic"] = float(rng.uniform(-0.3, 1.0))
    else:
        values |= {"friction": w2 * deflection * _log(rng, 0.002, 0.05), "slip": 0.05 * deflection * values["w"]}
    return Rough("nonlinear", values, stop, rng.uniform(0.02, 0.06), amplitude=w2 * deflection)


FAMILIES: dict[str, tuple[Callable[[np.random.Generator], Rough], int]] = {
    "lag": (lagging, 50), "noise": (noisy, 20), "euler": (euler_stepped, 10), "nonlinear": (nonlinear, 10),
}  # fmt: skip
"""What makes a plant, and how many of them the whole set has."""


def left(plant: Rough, amplitudes: Sequence[float], delays: Sequence[float]) -> float:
    """The largest share of the vibration that impulses leave over the range of the mass."""
    if plant.kind == "nonlinear":
        masses = np.linspace(1.0 - plant.spread, 1.0 + plant.spread, _GRID_NONLINEAR)
        return max(_left_nonlinear(plant, float(mass), amplitudes, delays) for mass in masses)
    return max(
        _left_linear(plant, float(mass), amplitudes, delays) for mass in np.linspace(1.0 - plant.spread, 1.0 + plant.spread, _GRID)
    )


def _left_linear(plant: Rough, mass: float, amplitudes: Sequence[float], delays: Sequence[float]) -> float:
    w, zeta = plant.values["w"] / math.sqrt(mass), plant.values["z"] / math.sqrt(mass)
    pole = w * (-zeta + 1j * math.sqrt(1.0 - zeta * zeta))
    return float(abs(np.exp(pole * (delays[-1] - np.array(delays))) @ np.array(amplitudes)))


def _left_nonlinear(plant: Rough, mass: float, amplitudes: Sequence[float], delays: Sequence[float]) -> float:
    assert plant.amplitude is not None
    shaped = _swing(plant.values, mass, plant.amplitude * np.array(amplitudes), delays)
    return shaped / _swing(plant.values, mass, np.array([plant.amplitude]), [0.0])


def _swing(values: dict[str, float], mass: float, jumps: np.ndarray, delays: Sequence[float]) -> float:
    """Half the peak-to-peak value over one and a half periods after the last jump."""
    w, zeta, period = values["w"], values["z"], 2.0 * math.pi / values["w"]

    def rates(force: float) -> Callable[[float, np.ndarray], list[float]]:
        def rate(_: float, x: np.ndarray) -> list[float]:
            spring = math.sin(x[0]) if values.get("pendulum") else x[0] + values.get("cubic", 0.0) * x[0] ** 3
            friction = values.get("friction", 0.0) * math.tanh(x[1] / values.get("slip", 1e-3))
            return [x[1], (-2.0 * zeta * w * x[1] - w * w * spring - friction + force) / mass]

        return rate

    x, force, position, ends = np.zeros(2), 0.0, np.zeros(1), [*delays[1:], delays[-1] + 1.5 * period]
    for jump, begin, end in zip(jumps, delays, ends, strict=True):
        force += float(jump)
        times = np.linspace(begin, end, 600)
        found = solve_ivp(rates(force), (begin, end), x, t_eval=times, method="LSODA", rtol=1e-8, atol=1e-12)
        x, position = found.y[:, -1], found.y[0]
    return 0.5 * float(np.ptp(position))
