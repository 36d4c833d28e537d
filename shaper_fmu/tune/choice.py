"""The choice of a shaper: what each one costs in time and leaves of the vibration, and which one to take.

For each candidate and each mode a bound of V over the mode's box of frequencies and damping ratios is proven
(shaper_fmu/analysis/guarantee.py). What an output swings after the command is at most the sum of what its modes swing, so

    worst case = max over outputs of sum_k share_k bound_k,     share_k = amplitude_k / sum of all amplitudes

is an upper bound of the envelope that is left, as a share of the sum of the modes' amplitudes after an unshaped step: the modes
need not be at their worst at the same place of their boxes, nor swing in phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shaper_fmu.errors import ComponentError
from shaper_fmu.profiles.design import Profile
from shaper_fmu.shapers.lp_layout import Band
from shaper_fmu.shapers.sequence import ImpulseSequence
from shaper_fmu.shapers.specified_insensitivity import MOST_DAMPED, TOLERANCES, specified_insensitivity
from shaper_fmu.tune.boxes import ModeBox, shares
from shaper_fmu.tune.candidate_moves import as_impulses, fastest_move, profiles
from shaper_fmu.tune.candidates import MOST_CUSTOM, Design, Designs, LeftOut, designs, proven, remaining, words
from shaper_fmu.tune.wish import Wish

_SAME = 1e-9
"""Durations that differ by less than this share are the same."""


@dataclass(frozen=True)
class Candidate:
    """A command and what is proven of it.

    Attributes:
        name: in words.
        design: the shaper; with a `profile` none of its own (unshaped).
        profile: the profile of a move; None for any command through the shaper.
        delay: how much later than the unshaped command it ends [s].
        bounds: of V over each mode's box.
        at: where V is largest: natural frequency [rad/s] and damping ratio, for each mode.
        worst_case: the bounds together, weighted by the modes' shares, of the worst output.
    """

    name: str
    design: Design
    profile: Profile | None
    delay: float
    bounds: tuple[float, ...]
    at: tuple[tuple[float, float], ...]
    worst_case: float

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
        by: a candidate that is no longer, and leaves no more.
    """

    design: Design
    at_least: float
    by: Candidate


@dataclass(frozen=True)
class Choice:
    """What `choose` has found.

    Attributes:
        boxes: the modes with the wished margins.
        wish: what was asked for.
        candidates: all that was bounded, by rising delay.
        dominated: combinations of shapers that were not bounded, since others are no worse.
        front: candidates than which none is both as short and leaves less, by rising delay.
        recommended: the shortest candidate that fits; None if none fits.
        nearest: the one recommended, or else the candidate within the delay that leaves least.
        floor: no shaper of positive impulses that fits is shorter [s]; None if unknown, and for a move.
        reason: the recommendation in words, or what would make one possible.
        left_out: what could not be designed, and why.
    """

    boxes: tuple[ModeBox, ...]
    wish: Wish
    candidates: tuple[Candidate, ...]
    dominated: tuple[Dominated, ...]
    front: tuple[Candidate, ...]
    recommended: Candidate | None
    nearest: Candidate
    floor: float | None
    reason: str
    left_out: tuple[LeftOut, ...]

    def to_floor(self, candidate: Candidate) -> float | None:
        """How much longer a candidate is than the shortest positive shaper that leaves no more than it, as a share.

        None where no floor is known: negative impulses, a profile, no impulse after the first, or a box that is too wide.
        """
        if self.wish.move is not None or min(candidate.sequence.amplitudes) < 0.0 or not 0.0 < candidate.worst_case < 1.0:
            return None
        floor = shortest(self.boxes, candidate.worst_case)
        return candidate.delay / floor - 1.0 if floor else None


def choose(modes: Sequence[ModeBox], wish: Wish | None = None, *, floor: bool = True) -> Choice:
    """Bound every shaper (and profile, for a move) over the modes' boxes, and recommend the shortest that fits the wish.

    Without `floor` it is not computed, which may save a second or two for damped modes.

    Raises ComponentError for no modes, and for modes of which none swings.
    """
    from shaper_fmu.tune.choice_words import recommendation  # it asks for what nearby wishes would give

    wish = wish or Wish()
    if not modes:
        raise ComponentError("there is no mode: nothing vibrates, so that no shaper is needed")
    boxes = tuple(box.widened(wish.frequency_margin, wish.damping_margin) for box in modes)
    found = designs(boxes, wish)
    search = Search(boxes, wish)
    for design in found.plain:
        search.add(design)
    for law in profiles(boxes, wish, found.left_out):
        search.add_profile(law)
    _mix(search, found)
    candidates = tuple(sorted(search.candidates, key=_order))
    fitting = [one for one in candidates if fits(one, wish)]
    recommended = shortest_of(fitting) if fitting else None
    quick = [one for one in candidates if one.delay <= wish.longest_delay * (1.0 + _SAME)]
    nearest = recommended or min(quick, key=lambda one: (one.worst_case, one.delay))
    least = shortest(boxes, wish.tolerance) if floor and wish.move is None else None
    choice = Choice(
        boxes, wish, candidates, tuple(search.dominated), tuple(_front(candidates)), recommended, nearest, least, "",
        tuple(found.left_out),
    )  # fmt: skip
    return Choice(**{**vars(choice), "reason": recommendation(choice)})


def fits(candidate: Candidate, wish: Wish) -> bool:
    """Whether a candidate is within the tolerance and the longest delay."""
    return candidate.worst_case <= wish.tolerance and candidate.delay <= wish.longest_delay * (1.0 + _SAME)


def shortest_of(candidates: Sequence[Candidate]) -> Candidate:
    """The shortest candidate, of equally short ones that which leaves least."""
    least = min(one.delay for one in candidates)
    same = [one for one in candidates if one.delay <= least * (1.0 + _SAME)]
    return min(same, key=lambda one: (one.worst_case, one.delay, len(one.sequence.delays)))


class Search:
    """Bounds of designs over the modes' boxes."""

    def __init__(self, boxes: Sequence[ModeBox], wish: Wish):
        self.boxes, self.shares = boxes, shares(boxes)
        self.candidates: list[Candidate] = []
        self.dominated: list[Dominated] = []
        self._highest = max(box.natural_frequency.high for box in boxes)
        self._base = fastest_move(wish.move) if wish.move is not None else None
        self._base_bounds = np.ones(len(boxes))
        if self._base is not None and self._base.duration > 0.0:
            self._base_bounds = np.array(self._bounded(as_impulses(self._base, self._highest))[0])

    def together(self, levels: Sequence[float] | np.ndarray) -> float:
        """What levels of V for each mode come to in the worst output."""
        return float((self.shares.T @ np.asarray(levels)).max())

    def add(self, design: Design) -> Candidate:
        """Bound a shaper; for a move that of the fastest one through it, by the product of both bounds."""
        bounds, places = self._bounded(design.sequence)
        total = tuple(float(b) for b in self._base_bounds * np.array(bounds))
        name = design.name if self._base is None else f"{words(self._base.kind.name)}, {design.name}"
        return self._keep(Candidate(name, design, self._base, design.delay, total, tuple(places), self.together(total)))

    def add_profile(self, law: Profile) -> Candidate:
        """Bound a profile."""
        assert self._base is not None  # profiles are proposed for moves only
        bounds, places = self._bounded(as_impulses(law, self._highest))
        delay = max(0.0, law.duration - self._base.duration)
        name = f"{words(law.kind.name)} in {law.duration:.4g} s"
        return self._keep(Candidate(name, Design(()), law, delay, tuple(bounds), tuple(places), self.together(bounds)))

    def levels(self, left: Sequence[np.ndarray]) -> float:
        """The worst case of the fastest move through a shaper of which F is known at some points of each box."""
        return self.together(self._base_bounds * np.array([float(np.abs(values).max()) for values in left]))

    def _keep(self, candidate: Candidate) -> Candidate:
        self.candidates.append(candidate)
        return candidate

    def _bounded(self, sequence: ImpulseSequence) -> tuple[list[float], list[tuple[float, float]]]:
        proofs = [proven(sequence, box) for box in self.boxes]
        return [proof.bound for proof in proofs], [proof.at for proof in proofs]


def _mix(search: Search, found: Designs) -> None:
    """Bound the combinations that could be of use; the others are dominated by what is bounded already."""
    left = {
        id(factor): [remaining(factor.sequence, box) for box in search.boxes] for factors in found.by_mode for factor in factors
    }
    best: list[Candidate] = []  # of rising delay and falling worst case
    for candidate in sorted(search.candidates, key=_order):
        if not best or candidate.worst_case < best[-1].worst_case:
            best.append(candidate)
    for design in sorted(found.mixed(), key=lambda one: one.delay):
        values = [np.ones(1, complex)] * len(search.boxes)
        for factor in design.factors:
            values = [a * b for a, b in zip(values, left[id(factor)], strict=True)]
        level = search.levels(values)
        winner = next((one for one in best if one.delay <= design.delay and one.worst_case <= level), None)
        if winner is not None:
            search.dominated.append(Dominated(design, level, winner))
        elif len(design.sequence.delays) > MOST_CUSTOM and not design.by_kind:
            found.left_out.append(
                LeftOut(design.name, f"{len(design.sequence.delays)} impulses; an InputShaper takes {MOST_CUSTOM}")
            )
        else:
            best.append(search.add(design))


def _order(candidate: Candidate) -> tuple[float, float]:
    return candidate.delay, candidate.worst_case


def _front(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Those that leave less than all shorter ones; candidates by rising delay."""
    front: list[Candidate] = []
    for candidate in candidates:
        if not front or candidate.worst_case < front[-1].worst_case:
            front.append(candidate)
    return front


def shortest(boxes: Sequence[ModeBox], tolerance: float) -> float | None:
    """A floor [s]: no shaper of positive impulses whose worst case is within the tolerance is shorter. None if unknown.

    Each mode alone may then leave V <= tolerance / share at most. The shortest sequence for all these bands, each at one damping
    ratio of the box, is the specified-insensitivity design; modes that may leave more than half are no condition. 0 if none is.
    """
    allowed = tolerance / shares(boxes).max(axis=1).clip(1e-300)
    bands = [
        Band(*box.frequencies, max(float(v), TOLERANCES[0]), min(box.centre[1], MOST_DAMPED))
        for box, v in zip(boxes, allowed, strict=True)
        if v < TOLERANCES[1] and box.dampings[0] <= MOST_DAMPED
    ]
    if not bands:
        return 0.0
    first = bands[0]
    try:
        return specified_insensitivity(first.low, first.high, first.tolerance, first.damping_ratio, bands[1:]).duration
    except ComponentError:
        return None
