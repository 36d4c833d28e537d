"""The proof that no move is faster: a bound of the distance in a given time, from multipliers of what limits the move.

For any multipliers m of the derivatives x_k at instants s and g of the residuals R, every permitted control u gives

    D = int phi u dt - sum m x_k(s) - sum Re(g R) <= U int |phi| dt + sum |m| X_k + D sum |g| tolerance,
    phi(t) = (T - t)^(n-1)/(n-1)! + sum m (s - t)_+^(n-1-k)/(n-1-k)! + sum Re(g exp(p (T - t)) / p^(n-1)),

where n is the control's order, U and X_k are the limits, and derivatives that are 0 at the end cost nothing. Multipliers of a
deflection q at instants s are like those of x_k, with q's response to the control instead of the power of s - t. This weak duality
holds in continuous time and for any multipliers; those of the linear programme make the bound tight. A move that reaches its
distance in some time reaches it in any longer one, by waiting: so a time in which the bound is below the distance is a
lower bound of the duration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from shaper_fmu.design.moves.programme import DeflectionMultipliers, GridMove, ResidualMultiplier, StateMultipliers
from shaper_fmu.design.moves.task import Task

_NODES = 4096
"""Least number of nodes for the integral of |phi|."""


@dataclass(frozen=True)
class Certificate:
    """Multipliers for a task, at times that are shares of the duration; see the module's text."""

    task: Task
    grid: np.ndarray
    states: tuple[StateMultipliers, ...]
    residuals: tuple[ResidualMultiplier, ...]
    deflections: tuple[DeflectionMultipliers, ...] = ()

    def farthest(self, duration: float) -> float:
        """No move gets farther than this in the given time."""
        share = 1.0 - sum(abs(one.value) * one.tolerance for one in self.residuals)
        if share <= 0.0:
            return math.inf
        cost = self.task.largest_control * self._integral(duration)
        for one in self.states:
            used = float(np.abs(one.values[one.times < 1.0]).sum())
            cost += self.task.limits[one.derivative - 1] * used if used else 0.0
        cost += sum(one.mode.limit * float(np.abs(one.values).sum()) for one in self.deflections)
        return cost / share

    def _integral(self, duration: float) -> float:
        """An upper bound of int |phi| dt: that of the polygon through phi's values, and the most by which phi bends beside it."""
        edges = self.grid
        count = max(2, math.ceil(_NODES / len(edges)))
        nodes = duration * np.unique(np.concatenate([np.linspace(a, b, count) for a, b in pairwise(edges)]))
        h, values = np.diff(nodes), self.switching_function(nodes, duration)
        a, b = values[:-1], values[1:]
        larger = np.maximum(np.abs(a) + np.abs(b), 1e-300)
        polygon = np.where(a * b >= 0.0, 0.5 * larger, 0.5 * (a * a + b * b) / larger)
        return float(h @ polygon + self._bend(duration) * (h**3).sum() / 12.0)

    def _bend(self, duration: float) -> float:
        """The most that the second derivative of phi can be between the edges."""
        n = self.task.order
        found = 1.0 if n == 3 else 0.0
        found += sum(abs(one.value) * one.frequency ** (3 - n) for one in self.residuals)
        for one in self.deflections:
            found += float(np.abs(one.values).sum()) * one.mode.frequency**2 / one.mode.pole.imag
        return found

    def switching_function(self, t: np.ndarray, duration: float) -> np.ndarray:
        """phi at rising times t; the multipliers of the highest derivative are spread evenly over the half cells around them."""
        n, left = self.task.order, duration - t
        phi = left ** (n - 1) / math.factorial(n - 1)
        for one in self.residuals:
            p = one.frequency * complex(-one.damping_ratio, math.sqrt(1.0 - one.damping_ratio**2))
            phi = phi + (one.value * np.exp(p * left) / p ** (n - 1)).real
        for one in self.states:
            phi = phi + (self._steps(one, t / duration) if one.derivative == n - 1 else _ramps(one, t, duration))
        for one in self.deflections:
            phi = phi - one.mode.unit(0, np.subtract.outer(duration * one.times, t).T) @ one.values
        return phi

    def _steps(self, one: StateMultipliers, t: np.ndarray) -> np.ndarray:
        """sum of the multipliers after t, from middle to middle of the cells; that of the end is not spread."""
        middles = 0.5 * (one.times[1:] + one.times[:-1])
        first = 0.5 * one.times[0]
        after = np.cumsum(one.values[::-1])[::-1]
        return np.interp(t, np.concatenate(([first], middles)), after)


def _ramps(one: StateMultipliers, t: np.ndarray, duration: float) -> np.ndarray:
    """sum of the multipliers times (s - t)_+ over their instants s."""
    s = duration * one.times
    after = np.concatenate((np.cumsum(one.values[::-1])[::-1], [0.0]))
    moment = np.concatenate((np.cumsum((one.values * s)[::-1])[::-1], [0.0]))
    first = np.searchsorted(s, t, side="right")
    return moment[first] - after[first] * t


def certificate(task: Task, move: GridMove) -> Certificate:
    """The certificate that the multipliers of a grid's move give."""
    whole = move.control.duration
    edges = move.control.times / whole
    middles = 0.5 * (edges[1:] + edges[:-1])
    states = tuple(StateMultipliers(one.derivative, one.times / whole, one.values) for one in move.states)
    grid = np.unique(np.concatenate((edges, middles)))
    swings = tuple(DeflectionMultipliers(one.mode, one.times / whole, one.values) for one in move.deflections)
    return Certificate(task, grid, states, move.residuals, swings)
