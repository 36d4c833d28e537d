"""The farthest move in a given time, by a linear programme: the control is constant in each cell of a grid.

Unknowns are the control in each cell, the derivatives below it at the ends of the cells, and the distance, which is to be
as large as possible. With D that distance, V <= tolerance at a frequency is |R| <= tolerance D with the residual R, which is linear
in the control; for each band it is demanded where it is violated (Remez' exchange), as Re(exp(-j phase) R) <= tolerance D.
The grid leaves out controls, so that the distance may be a little too small: the proof of optimality, which needs no grid,
is in shaper_fmu.design.moves.certificate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.control import Control
from shaper_fmu.design.moves.deflection import Deflection
from shaper_fmu.design.moves.deflection_cells import COLUMNS, deflection_rows
from shaper_fmu.design.moves.task import Task
from shaper_fmu.errors import NoSolutionError

_EXCESS = 1e-4
"""By which the solution may exceed the tolerances, as a share of them for the distance 1; the polished move does not."""
_PHASES = 2.0 * math.pi * np.arange(16) / 16
_NO_DISTANCE = 1e-7
_PRECISE = {"primal_feasibility_tolerance": 1e-9, "dual_feasibility_tolerance": 1e-9}
_ATTEMPTS = (("highs", _PRECISE), ("highs", {}), ("highs", {"presolve": False}), ("highs-ipm", {}))
"""Methods and options, tried one after the other: numerically hard programmes are solved by one of them."""
_ITERATIONS = 5
"""Of the simplex method, for each column, before the next one is tried: with limited deflections a few never end."""
_NEAR = 0.5
"""Demands that leave more of the tolerance unused than this are forgotten; those that are needed after all are found again."""


@dataclass(frozen=True)
class StateMultipliers:
    """Multipliers of the limits of a derivative at some instants, also of its being 0 at the end."""

    derivative: int
    times: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class ResidualMultiplier:
    """The multiplier of the residual of a mode: the least distance times `value` is what its real part costs."""

    frequency: float
    damping_ratio: float
    tolerance: float
    value: complex


@dataclass(frozen=True)
class DeflectionMultipliers:
    """Multipliers of the limit of a mode's deflection at some instants."""

    mode: Deflection
    times: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class GridMove:
    """The farthest move on a grid: its control, the distance, and the multipliers of what limits it."""

    control: Control
    distance: float
    states: tuple[StateMultipliers, ...]
    residuals: tuple[ResidualMultiplier, ...]
    deflections: tuple[DeflectionMultipliers, ...] = ()


class MoveProgramme:
    """The linear programmes of one task; demands that were found are kept from one duration and grid to the next."""

    def __init__(self, task: Task):
        self.task = task
        self.rows: list[np.ndarray] = [np.zeros((2, 0)) for _ in task.bands]
        """Demands on each band with a tolerance: frequencies and phases, shape (2, n)."""

    def farthest(self, edges: np.ndarray, duration: float) -> GridMove:
        """The farthest move in this time; `edges` are the ends of the cells, from 0 to 1."""
        if not self.rows or not any(rows.size for rows in self.rows):
            self.rows = [self._first(band, duration) for band in self.task.bands]
        for _ in range(40):
            move = _Cells(self.task, edges * duration, self.rows).solved()
            if move.distance < _NO_DISTANCE:
                return move
            if not self._exchange(move):
                self._forget(move)
                return move
        raise NoSolutionError("the residual vibration over the bands was not brought within the tolerances")

    def _first(self, band: Band, duration: float) -> np.ndarray:
        if band.tolerance == 0.0:
            return np.zeros((2, 0))
        count = 3 + math.ceil(2.0 * duration * (band.high - band.low) / math.pi) if band.high > band.low else 1
        w = np.linspace(band.low, band.high, count)
        return np.array([np.repeat(w, len(_PHASES)), np.tile(_PHASES, len(w))])

    def _exchange(self, move: GridMove) -> bool:
        """Demand the tolerances where the move violates them; whether there were such places."""
        added = False
        for k, band in enumerate(self.task.bands):
            if band.tolerance > 0.0:
                found, v = move.control.peaks(band)
                worst = found[v > band.tolerance * (move.distance + _EXCESS)]
                phases = np.angle(move.control.along(worst, band.damping_ratio)[0]) if len(worst) else worst
                self.rows[k] = np.hstack((self.rows[k], [worst, phases]))
                added = added or len(worst) > 0
        return added

    def _forget(self, move: GridMove) -> None:
        for k, band in enumerate(self.task.bands):
            if self.rows[k].shape[1] > 2 * len(_PHASES):
                w, phases = self.rows[k]
                used = (np.exp(-1j * phases) * move.control.along(w, band.damping_ratio)[0]).real
                self.rows[k] = self.rows[k][:, used >= (1.0 - _NEAR) * band.tolerance * move.distance]


class _Cells:
    """One linear programme. Columns: control, then for each derivative from the highest down its values at the cells' ends,
    then, if the jerk is the control, what bounds the speed within the cells, then those of limited deflections, the distance."""

    def __init__(self, task: Task, times: np.ndarray, rows: list[np.ndarray]):
        self.task, self.times, self.demands = task, times, rows
        self.widths = np.diff(times)
        self.count = len(self.widths)
        n = task.order
        self.middles = n == 3 and 1 in task.limited()
        self.swings = self.count * (n + self.middles)
        self.columns = self.swings + self.count * COLUMNS * len(task.deflections) + 1
        self.equal: list[sparse.csr_matrix] = []
        self.at_most: list[np.ndarray] = []

    def solved(self) -> GridMove:
        """The optimum, with its multipliers."""
        self._motion()
        for k, one in enumerate(self.task.deflections):
            self.equal += deflection_rows(one, self.widths, self._swing(k), self.columns)
        distance = np.append(self._moments(), -1.0)
        self.equal.append(self._row(distance[:-1], distance[-1]))
        owners = self._residual_rows()
        cost = np.zeros(self.columns)
        cost[-1] = -1.0
        result = self._optimum(cost)
        control = Control(self.times, result.x[: self.count], self.task.order)
        weight = 1.0 - float(np.sum(result.ineqlin.marginals))  # of the distance: its own, and that in the tolerances
        states, residuals = self._states(result, weight), self._residuals(result, owners, weight)
        return GridMove(control, float(result.x[-1]), states, residuals, self._deflections(result, weight))

    def _optimum(self, cost: np.ndarray) -> Any:
        """What linprog returns for the least cost."""
        most = (sparse.csr_matrix(np.array(self.at_most)), np.zeros(len(self.at_most))) if self.at_most else (None, None)
        equal = sparse.csr_matrix(sparse.vstack(self.equal))
        result: Any = None
        for method, options in _ATTEMPTS:
            zeros = np.zeros(self._equations())
            limited = {**options, "maxiter": _ITERATIONS * self.columns} if self.task.deflections else options
            result = linprog(cost, *most, equal, zeros, self._bounds(), method=method, options=limited)
            if result.x is not None:
                return result
        raise NoSolutionError(f"the linear programme of the move was not solved: {result.message}")

    def _equations(self) -> int:
        """How many equations there are."""
        return sum(int(part.shape[0]) for part in self.equal if part.shape is not None)

    def _block(self, derivative: int) -> int:
        return self.count * (self.task.order - derivative)

    def _swing(self, k: int) -> int:
        """The first column of a limited deflection."""
        return self.swings + self.count * COLUMNS * k

    def _motion(self) -> None:
        """x_k at a cell's end = sum_j h^j/j! x_(k+j) at its start.

        The speed along a cell with constant jerk is a parabola: it lies below its ends and the point where the tangents there
        meet, in the middle of the cell, v + h/2 a.
        """
        n, i = self.task.order, np.arange(self.count)
        ends = [(k, self._block(k), self.widths) for k in range(n - 1, 0, -1)]
        if self.middles:
            ends.append((1, self.count * n, 0.5 * self.widths))
        for k, block, h in ends:
            parts = [(i, block + i, np.ones(self.count))]
            if block < self.count * n:
                parts.append((i, i, -(h ** (n - k)) / math.factorial(n - k)))
            for j in range(n - k):
                parts.append((i[1:], self._block(k + j) + i[:-1], -(h[1:] ** j) / math.factorial(j)))
            rows, columns, values = (np.concatenate(column) for column in zip(*parts, strict=True))
            self.equal.append(sparse.csr_matrix((values, (rows, columns)), shape=(self.count, self.columns)))

    def _moments(self) -> np.ndarray:
        """What a unit control in each cell adds to the distance."""
        n, left = self.task.order, self.times[-1] - self.times
        return (left[:-1] ** n - left[1:] ** n) / math.factorial(n)

    def _row(self, control: np.ndarray, distance: float) -> sparse.csr_matrix:
        row = np.zeros((1, self.columns))
        row[0, : self.count] = control
        row[0, -1] = distance
        return sparse.csr_matrix(row)

    def _residual_rows(self) -> list[tuple[float, Band, complex]]:
        """Adds the demands; for each of them, equations first, frequency, band, and the factor of the residual."""
        equations: list[tuple[float, Band, complex]] = []
        demands: list[tuple[float, Band, complex]] = []
        for band, (frequencies, phases) in zip(self.task.bands, self.demands, strict=True):
            if band.tolerance == 0.0:
                scale = band.low ** (self.task.order - 1)
                response = self._response(band.low, band.damping_ratio)
                for factor in (scale, -1j * scale):
                    self.equal.append(self._row((factor * response).real, 0.0))
                    equations.append((band.low, band, factor))
            for w, phase in zip(frequencies.tolist(), phases.tolist(), strict=True):
                factor = np.exp(-1j * phase) / band.tolerance
                row = np.zeros(self.columns)
                row[: self.count] = (factor * self._response(w, band.damping_ratio)).real
                row[-1] = -1.0
                self.at_most.append(row)
                demands.append((w, band, factor))
        return equations + demands

    def _response(self, w: float, damping_ratio: float) -> np.ndarray:
        p = w * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
        grown = np.exp(p * (self.times[-1] - self.times)) / p**self.task.order
        return grown[:-1] - grown[1:]

    def _bounds(self) -> np.ndarray:
        bounds = np.tile([-np.inf, np.inf], (self.columns, 1))
        bounds[: self.count] = self.task.largest_control * np.array([-1.0, 1.0])
        for k in range(1, self.task.order):
            block = slice(self._block(k), self._block(k) + self.count)
            bounds[block] = self.task.limits[k - 1] * np.array([-1.0, 1.0])
            bounds[block.stop - 1] = 0.0
        if self.middles:
            bounds[self.count * self.task.order : self.swings] = self.task.limits[0] * np.array([-1.0, 1.0])
        for k in range(len(self.task.deflections)):
            for part in (0, 2):
                begin = self._swing(k) + part * self.count
                bounds[begin : begin + self.count] = [-1.0, 1.0]
        return bounds

    def _states(self, result: Any, weight: float) -> tuple[StateMultipliers, ...]:
        marginals = (result.lower.marginals + result.upper.marginals) / weight
        found = []
        for k in range(1, self.task.order):
            block = slice(self._block(k), self._block(k) + self.count)
            found.append(StateMultipliers(k, self.times[1:], marginals[block]))
        if self.middles:
            middles = 0.5 * (self.times[1:] + self.times[:-1])
            found.append(StateMultipliers(1, middles, marginals[self.count * self.task.order : self.swings]))
        return tuple(found)

    def _deflections(self, result: Any, weight: float) -> tuple[DeflectionMultipliers, ...]:
        marginals = (result.lower.marginals + result.upper.marginals) / weight
        instants = np.concatenate((self.times[1:], 0.5 * (self.times[1:] + self.times[:-1])))
        found = []
        for k, one in enumerate(self.task.deflections):
            ends, middles = (marginals[self._swing(k) + part * self.count :][: self.count] for part in (0, 2))
            values = np.concatenate((ends, middles)) / one.limit
            found.append(DeflectionMultipliers(one, instants[values != 0.0], values[values != 0.0]))
        return tuple(found)

    def _residuals(self, result: Any, owners: list[tuple[float, Band, complex]], weight: float) -> tuple[ResidualMultiplier, ...]:
        """One for each frequency: the sum over its phases."""
        exact = sum(band.tolerance == 0.0 for _, band, _ in owners)
        values = np.concatenate((result.eqlin.marginals[-exact:] if exact else [], result.ineqlin.marginals))
        found: dict[tuple[float, Band], complex] = {}
        for (w, band, factor), value in zip(owners, values.tolist(), strict=True):
            if value != 0.0:
                found[w, band] = found.get((w, band), 0.0) + value * factor / weight
        return tuple(ResidualMultiplier(w, band.damping_ratio, band.tolerance, value) for (w, band), value in found.items())
