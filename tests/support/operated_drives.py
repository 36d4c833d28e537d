"""Drives that an operator commands: the component's kernel stepped as a master does, and what its output does to a load, by scipy."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from compiled_kernels import Kernels, record_of
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import linprog

from shaper_fmu.commands.shaped_stop import ShapedStop

GRAVITY = 9.81
Piece = tuple[float, float]
"""How long an acceleration lasts [s], and the acceleration [m/s2]."""


@cache
def kernels() -> Kernels:
    """The compiled kernels, whose bits are those of plain Python (test_kernels)."""
    return Kernels(ShapedStop)


class Drive:
    """The compiled kernel on its record, stepped to communication points and to the events between."""

    def __init__(self, **values: Any):
        self.plain = ShapedStop(**values)
        self.record = record_of(self.plain)
        self.time = 0.0
        self.pieces: list[Piece] = []
        self.speeds: list[float] = []
        self.status = kernels().start(self.record) or kernels().step(self.record, 0.0, 0.0)
        assert self.status == 0, self.plain.messages[self.status]
        self.speeds.append(self["speed"])

    def __getitem__(self, name: str) -> float:
        return self.record[name].item()

    def step(self, until: float, **inputs: Any) -> None:
        """One communication step with these inputs, cut where an event is announced."""
        for name, value in inputs.items():
            self.record[name] = value
        while self.time < until:
            self.call(self.time, 0.0)
            due = self["next_event_time"]
            end = due if self.time < due < until else until
            self.pieces.append((end - self.time, self["acceleration"]))
            self.call(self.time, end - self.time)
            self.time = end

    def call(self, t: float, h: float) -> None:
        self.status = kernels().step(self.record, t, h)
        assert self.status == 0, self.plain.messages[self.status]
        self.speeds.append(self["speed"])


def swing_after(pieces: list[Piece], w: float, zeta: float, angle: float, rate: float, length: float) -> np.ndarray:
    """Angle and rate of the linear pendulum after the pieces, by the matrix exponential."""
    matrix = np.array([[0.0, 1.0, 0.0], [-w * w, -2.0 * zeta * w, -1.0 / length], [0.0, 0.0, 0.0]])
    state = np.array([angle, rate, 0.0])
    for time, level in pieces:
        state[2] = level
        state = expm(matrix * time) @ state
    return state[:2]


def swing_integrated(pieces: list[Piece], length: float, angle: float, rate: float, *, linear: bool) -> tuple[float, float]:
    """Angle and rate of an undamped pendulum after the pieces, nonlinear or linear, by DOP853 at 1e-12."""
    sine: Callable[[float], float] = float if linear else math.sin
    for time, level in pieces:

        def slopes(_, y, level=level):
            return [y[1], -(GRAVITY * sine(y[0]) + level * (1.0 if linear else math.cos(y[0]))) / length]

        found = solve_ivp(slopes, (0.0, time), [angle, rate], method="DOP853", rtol=1e-12, atol=1e-14)
        angle, rate = found.y[:, -1].tolist()
    return angle, rate


class Optimum:
    """Linear programmes over cells of constant acceleration: the fastest change of the speed within all limits, by bisection.

    q'' + 2 zeta w q' + w^2 q = -a at rest at the end, for the deflection q: int a exp(-p t) dt = q' - conj(p) q at the start.
    """

    def __init__(self, w: float, zeta: float, pull: float | tuple[float, float], lowest: float, highest: float, cells: int = 120):
        self.pole = w * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
        self.pull = pull if isinstance(pull, tuple) else (-pull, pull)
        self.lowest, self.highest, self.cells = lowest, highest, cells

    def possible(self, time: float, speed: float, target: float, swing: complex) -> bool:
        n, h = self.cells, time / self.cells
        grown = np.exp(-self.pole * h * np.arange(n + 1))
        effect = (grown[:-1] - grown[1:]) / self.pole
        sums = h * np.tril(np.ones((n, n)))
        rows = np.vstack((sums, -sums))
        most = np.concatenate((np.full(n, self.highest - speed), np.full(n, speed - self.lowest)))
        exact = np.array([np.full(n, h), effect.real, effect.imag])
        wanted = [target - speed, swing.real, swing.imag]
        found = linprog(np.zeros(n), rows, most, exact, wanted, self.pull, method="highs")
        return found.status == 0

    def time(self, speed: float, target: float, deflection: float, rate: float) -> float:
        """The shortest time [s], to 0.1 %."""
        swing = rate - self.pole.conjugate() * deflection
        short, long = 0.0, 1.0
        while not self.possible(long, speed, target, swing):
            short, long = long, 1.5 * long
        while long - short > 1e-3 * long:
            middle = 0.5 * (short + long)
            short, long = (short, middle) if self.possible(middle, speed, target, swing) else (middle, long)
        return long
