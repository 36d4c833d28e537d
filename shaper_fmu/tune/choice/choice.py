"""Chooses a shaper: compares the delay and the residual vibration of all candidates, and recommends one.

What each candidate leaves is bounded in shaper_fmu/tune/choice/search.py; here the shortest one that fits is recommended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from shaper_fmu.errors import ArgumentError
from shaper_fmu.renamed import renamed_argument
from shaper_fmu.tune.choice.bands import shortest
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.candidates import designs
from shaper_fmu.tune.choice.move_floor import least_delay
from shaper_fmu.tune.choice.moves import profiles, without_vibration
from shaper_fmu.tune.choice.names import told_apart
from shaper_fmu.tune.choice.reasons import recommendation
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import Choice, fits, preferred, quick
from shaper_fmu.tune.choice.search import Candidate, Search, front, order


@renamed_argument("wish", "requirements")
def choose(modes: Sequence[ModeBox], requirements: Requirements | None = None, *, floor: bool = True) -> Choice:
    """Bound every shaper (and profile, for a move) over the modes' boxes, and recommend the shortest that fits the requirements.

    A custom sequence is recommended only where it saves `least_saving` of the delay of the shortest shaper of a kind.

    Without `floor` it is not computed, which may save up to a second for several damped modes, and some seconds for a move.

    Raises ArgumentError for no modes, and for modes of which none swings.
    """
    requirements = requirements or Requirements()
    if not modes:
        raise ArgumentError("there is no mode: nothing vibrates, so that no shaper is needed")
    boxes = tuple(box.widened(requirements.frequency_margin, requirements.damping_margin) for box in modes)
    found = designs(boxes, requirements)
    search = Search(boxes, requirements)
    for design in found.plain:
        search.add(design)
    fastest = without_vibration(boxes, requirements, found.left_out)
    for law in [*profiles(boxes, requirements, found.left_out), *([fastest] if fastest is not None else [])]:
        search.add_profile(law)
    search.mix(found)
    candidates, dominated = told_apart(sorted(search.candidates, key=order), search.dominated)
    fitting = [one for one in candidates if fits(one, requirements)]
    recommended = preferred(fitting, requirements) if fitting else None
    least = _floor(boxes, requirements) if floor else None
    choice = Choice(
        boxes, requirements, candidates, dominated, _front(candidates, requirements, recommended), recommended,
        recommended or nearest_of([one for one in candidates if quick(one, requirements)], requirements),
        least, "", tuple(found.left_out),
    )  # fmt: skip
    return replace(choice, reason=recommendation(choice))


def choose_another(choice: Choice, recommended: Candidate, refuted: Sequence[tuple[Candidate, str]]) -> Choice:
    """The choice with another of its candidates, after those that the plant has refuted, each with its reason."""
    found = replace(
        choice, recommended=recommended, nearest=recommended, refuted=tuple(refuted),
        front=_front(choice.candidates, choice.requirements, recommended),
    )  # fmt: skip
    return replace(found, reason=recommendation(found))


def _floor(boxes: Sequence[ModeBox], requirements: Requirements) -> float | None:
    if requirements.move is not None:
        return least_delay(boxes, requirements)
    return shortest(boxes, requirements.tolerance, requirements.nominal_tolerance)


def nearest_of(candidates: Sequence[Candidate], requirements: Requirements) -> Candidate:
    """The candidate that leaves least, in terms of the tolerances."""
    return min(
        candidates,
        key=lambda one: (
            max(one.worst_case / requirements.tolerance, one.nominal / requirements.nominal_tolerance),
            one.worst_case,
            one.delay,
        ),
    )


def _front(candidates: Sequence[Candidate], requirements: Requirements, recommended: Candidate | None) -> tuple[Candidate, ...]:
    """The front; the one recommended is on it, even if a custom sequence of the same length leaves less."""
    kept = front(candidates, requirements)
    if recommended is not None and not any(one is recommended for one in kept):
        kept.append(recommended)
    return tuple(sorted(kept, key=order))
