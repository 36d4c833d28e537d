"""Bounds of candidates over the modes' boxes, and dominated combinations that need none.

For each candidate and each mode a bound of V over the mode's box of frequencies and damping ratios is proven
(shaper_fmu/design/guarantees.py). What an output swings after the command is at most the sum of what its modes swing, so

    worst case = max over outputs of sum_k share_k bound_k,     share_k = amplitude_k / sum of all amplitudes

is an upper bound of the envelope that is left, as a share of the sum of the modes' amplitudes after an unshaped step: the modes
need not be at their worst at the same place of their boxes, nor swing in phase. The nominal level is the same for boxes that are
the modes' nominal points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.profiles import Profile
from shaper_fmu.tune.choice.bounds import proven, remaining
from shaper_fmu.tune.choice.boxes import ModeBox, shares
from shaper_fmu.tune.choice.candidates import MOST_CUSTOM, Design, Designs, label_of
from shaper_fmu.tune.choice.moves import as_impulses, fastest_move
from shaper_fmu.tune.choice.requirements import Requirements

SAME = 1e-9
"""Durations that differ by less than this share are the same."""


@dataclass(frozen=True)
class Candidate:
    """A command and its proven bounds.

    Attributes:
        name: its name in messages.
        design: the shaper; with a `profile` none of its own (unshaped).
        profile: the profile of a move; None for any command through the shaper.
        delay: how much later than the unshaped command it ends [s].
        bounds: of V over each mode's box.
        at: where V is largest: natural frequency [rad/s] and damping ratio, for each mode.
        worst_case: the bounds together, weighted by the modes' shares, of the worst output.
        nominal: the same with bounds of V at each mode's nominal natural frequency and damping ratio.
    """

    name: str
    design: Design
    profile: Profile | None
    delay: float
    bounds: tuple[float, ...]
    at: tuple[tuple[float, float], ...]
    worst_case: float
    nominal: float

    @property
    def sequence(self) -> ImpulseSequence:
        """Impulses of the shaper."""
        return self.design.sequence

    def start_values(self) -> dict[str, Any]:
        """Start values of an InputShaper that make it this shaper."""
        return self.design.start_values()


@dataclass(frozen=True)
class Dominated:
    """A design for which another one is certainly no worse.

    Attributes:
        design: which one.
        at_least: of its worst case, seen at some points of the boxes.
        nominal: level at the modes' nominal points.
        by: a candidate that is no longer, and leaves no more: in the worst case, and nominally as far as it is above the required
            nominal tolerance.
    """

    design: Design
    at_least: float
    nominal: float
    by: Candidate


class Search:
    """Bounds of designs over the modes' boxes."""

    def __init__(self, boxes: Sequence[ModeBox], requirements: Requirements):
        self.boxes: Sequence[ModeBox] = boxes
        self.requirements: Requirements = requirements
        self.shares: np.ndarray = shares(boxes)
        self.candidates: list[Candidate] = []
        self.dominated: list[Dominated] = []
        self._points = [box.at_nominal for box in boxes]
        self._highest = max(box.natural_frequency.high for box in boxes)
        self._base = fastest_move(requirements.move) if requirements.move is not None else None
        self._base_bounds, self._base_nominal = np.ones(len(boxes)), np.ones(len(boxes))
        if self._base is not None and self._base.duration > 0.0:
            moves = as_impulses(self._base, self._highest)
            self._base_bounds, self._base_nominal = np.array(self._bounded(moves)[0]), self._nominal(moves)

    def together(self, levels: Sequence[float] | np.ndarray) -> float:
        """The level in the worst output, from levels of V for each mode."""
        return float((self.shares.T @ np.asarray(levels)).max())

    def add(self, design: Design) -> Candidate:
        """Bound a shaper; for a move that of the fastest one through it, by the product of both bounds."""
        bounds, places = self._bounded(design.sequence)
        total = self._base_bounds * np.array(bounds)
        nominal = self._base_nominal * self._nominal(design.sequence)
        name = design.name if self._base is None else f"{label_of(self._base.kind.name)}, {design.name}"
        return self._keep(name, design, self._base, design.delay, total, places, nominal)

    def add_profile(self, law: Profile) -> Candidate:
        """Bound a profile."""
        assert self._base is not None  # profiles are proposed for moves only
        moves = as_impulses(law, self._highest)
        bounds, places = self._bounded(moves)
        delay = max(0.0, law.duration - self._base.duration)
        name = f"{label_of(law.kind.name)} in {law.duration:.4g} s"
        return self._keep(name, Design(()), law, delay, np.array(bounds), places, self._nominal(moves))

    def levels(self, left: Sequence[np.ndarray] | np.ndarray) -> tuple[float, float]:
        """Worst case and nominal level of the fastest move through a shaper of which F is known as `remaining` gives it."""
        sizes = np.abs(np.array(left))
        return self.together(self._base_bounds * sizes[:, :-1].max(axis=1)), self.together(self._base_nominal * sizes[:, -1])

    def mix(self, found: Designs) -> None:
        """Bound the combinations that could be useful; the others are dominated by candidates that are bounded already."""
        factors = {id(one): one for way in found.by_mode for of_mode in way for one in of_mode}
        left = {key: np.array([remaining(one.sequence, box) for box in self.boxes]) for key, one in factors.items()}
        best = front(sorted(self.candidates, key=order), self.requirements)
        for design in sorted(found.mixed(), key=lambda one: one.delay):
            values = np.ones((len(self.boxes), 1), complex)
            for factor in design.factors:
                values = values * left[id(factor)]
            level, nominal = self.levels(values)
            winner = next((one for one in best if _beats(one, design, level, nominal, self.requirements)), None)
            if winner is not None:
                self.dominated.append(Dominated(design, level, nominal, winner))
            elif not design.by_kind and len(design.sequence.delays) > MOST_CUSTOM:
                found.leave_out(design.name, f"{len(design.sequence.delays)} impulses; an InputShaper takes {MOST_CUSTOM}")
            else:
                best.append(self.add(design))

    def _keep(
        self, name: str, design: Design, law: Profile | None, delay: float, bounds: np.ndarray,
        places: Sequence[tuple[float, float]], nominal: np.ndarray,
    ) -> Candidate:  # fmt: skip
        worst = self.together(bounds)
        at_nominal = min(worst, self.together(nominal))  # the nominal point is in the box: both are bounds
        proofs = tuple(float(b) for b in bounds), tuple(places)
        self.candidates.append(Candidate(name, design, law, delay, *proofs, worst, at_nominal))
        return self.candidates[-1]

    def _bounded(self, sequence: ImpulseSequence) -> tuple[list[float], list[tuple[float, float]]]:
        proofs = [proven(sequence, box) for box in self.boxes]
        return [proof.bound for proof in proofs], [proof.at for proof in proofs]

    def _nominal(self, sequence: ImpulseSequence) -> np.ndarray:
        return np.array([proven(sequence, point).bound for point in self._points])


def _beats(one: Candidate, design: Design, level: float, nominal: float, requirements: Requirements) -> bool:
    """Whether a candidate makes a design useless that leaves at least so much.

    One that an InputShaper designs by its kind is of use, too, where only a custom sequence of the same length beats it.
    """
    return (
        one.delay <= design.delay
        and one.worst_case <= level
        and max(one.nominal, requirements.nominal_tolerance) <= max(nominal, requirements.nominal_tolerance)
        and (one.design.by_kind or not design.by_kind or one.delay < design.delay * (1.0 - SAME))
    )


def order(candidate: Candidate) -> tuple[float, float, float]:
    """By rising delay; of equally short ones that which leaves least is the first."""
    return candidate.delay, candidate.worst_case, candidate.nominal


def front(candidates: Sequence[Candidate], requirements: Requirements) -> list[Candidate]:
    """The Pareto front in delay, worst case and nominal level; candidates in `order`.

    A nominal level counts as far as it is above the required nominal tolerance.
    """
    kept: list[Candidate] = []
    for one in candidates:
        limit = max(one.nominal, requirements.nominal_tolerance)
        if not any(other.worst_case <= one.worst_case and other.nominal <= limit for other in kept):
            kept.append(one)
    return kept
