"""The result of a choice, and the test whether a candidate fits the requirements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from shaper_fmu.renamed import warn_renamed
from shaper_fmu.tune.choice.bands import shortest
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.candidates import LeftOut
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.search import SAME, Candidate, Dominated


@dataclass(frozen=True, repr=False)
class Choice:
    """The result of `choose`.

    Attributes:
        boxes: the modes with the required margins.
        requirements: the requirements.
        candidates: all candidates that were bounded, by rising delay.
        dominated: combinations of shapers that were not bounded, since other candidates are no worse.
        front: the Pareto front in delay, worst case and nominal level (levels within the nominal tolerance count as equal), with
            the recommended candidate, by rising delay.
        recommended: the shortest candidate that fits, or a little longer one of a kind (see `preferred`); None if none fits.
        nearest: the recommended candidate, or the one within the delay that leaves least relative to the tolerances.
        floor: shortest duration of a shaper of positive impulses that fits [s]; for a move the least delay of any that fits,
            whatever the profile and the shaper. None if unknown.
        reason: the reason for the recommendation, or the changes with which a candidate would fit.
        left_out: designs that could not be made, with reasons.
        refuted: candidates that fit by their bounds, but were tried before and did not hold on the plant, with reasons.
    """

    boxes: tuple[ModeBox, ...]
    requirements: Requirements
    candidates: tuple[Candidate, ...]
    dominated: tuple[Dominated, ...]
    front: tuple[Candidate, ...]
    recommended: Candidate | None
    nearest: Candidate
    floor: float | None
    reason: str
    left_out: tuple[LeftOut, ...]
    refuted: tuple[tuple[Candidate, str], ...] = ()

    @property
    def wish(self) -> Requirements:
        """The old name of `requirements`."""
        warn_renamed("Choice.wish", "requirements")
        return self.requirements

    def to_floor(self, candidate: Candidate) -> float | None:
        """How much longer a candidate is than the shortest positive shaper that leaves no more than it, as a share.

        None where no floor is known: negative impulses, a profile, no impulse after the first, or a box that is too wide.
        """
        if self.requirements.move is not None or min(candidate.sequence.amplitudes) < 0.0 or not 0.0 < candidate.worst_case < 1.0:
            return None
        nominal = max(candidate.nominal, self.requirements.nominal_tolerance)
        floor = shortest(self.boxes, candidate.worst_case, nominal)
        return candidate.delay / floor - 1.0 if floor else None

    def plot(self, axes: Any = None) -> Any:
        """Draw what candidates leave over their delays; see `Results.plot` for axes, what is returned, and errors."""
        from shaper_fmu.notebook.plots import plot
        from shaper_fmu.tune.choice.shown import trade_off

        return plot([trade_off(self)], axes)

    def __repr__(self) -> str:
        from shaper_fmu.tune.choice.shown import choice_text

        return f"<Choice of {len(self.candidates)}: {choice_text(self)}>"

    def _repr_html_(self) -> str:
        from shaper_fmu.notebook.html import page
        from shaper_fmu.tune.choice.shown import choice_facts, front_table, modes_table

        return page(f"Choice of {len(self.candidates)}", choice_facts(self), [modes_table(self), front_table(self)])


def quick(candidate: Candidate, requirements: Requirements) -> bool:
    """Whether a candidate is within the longest delay."""
    return candidate.delay <= requirements.longest_delay * (1.0 + SAME)


def fits(candidate: Candidate, requirements: Requirements) -> bool:
    """Whether a candidate is within both tolerances and the longest delay."""
    return (
        candidate.worst_case <= requirements.tolerance
        and candidate.nominal <= requirements.nominal_tolerance
        and quick(candidate, requirements)
    )


def preferred(candidates: Sequence[Candidate], requirements: Requirements) -> Candidate:
    """The shortest candidate; of those not longer by more than `least_saving` one that an InputShaper designs by its kind."""
    best = shortest_of(candidates)
    named = [one for one in candidates if one.design.by_kind]
    if best.design.by_kind or not named:
        return best
    other = shortest_of(named)
    return other if best.delay > other.delay * (1.0 - requirements.least_saving) else best


def shortest_of(candidates: Sequence[Candidate]) -> Candidate:
    """The shortest candidate; of equally short ones one that an InputShaper designs by its kind, and then that which leaves least.

    Such a shaper follows the mode while it runs; a custom sequence does not.
    """
    least = min(one.delay for one in candidates)
    same = [one for one in candidates if one.delay <= least * (1.0 + SAME)]
    return min(same, key=lambda one: (not one.design.by_kind, one.worst_case, one.delay, len(one.sequence.delays)))
