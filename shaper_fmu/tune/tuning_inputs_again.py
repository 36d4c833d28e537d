"""Chooses shapers for several inputs again: a common one, or tighter ones, and verifies them before each input alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from shaper_fmu.tune.choice.boxes import ModeBox, merged_boxes, mode_boxes
from shaper_fmu.tune.choice.choice import choose
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.meter import BudgetError
from shaper_fmu.tune.tuning import Say, Tuning
from shaper_fmu.tune.tuning_plant import tried_within
from shaper_fmu.tune.tuning_trial import tightened, untried

_ATTEMPTS = 5
"""Common shapers that are tried, each for tighter requirements."""


def with_common(tunings: Mapping[str, Tuning], asked: Requirements, say: Say) -> Mapping[str, Tuning]:
    """The tunings with one shaper for the modes of all inputs, verified before each of them.

    Where the plant leaves a little too much behind one, all get what the tightest of the requirements gives.
    """
    if sum(one.choice is not None for one in tunings.values()) < 2:
        return tunings
    tighter = asked
    for _ in range(_ATTEMPTS):
        tunings = chosen_again(tunings, asked, tighter, say, common=True)
        missed = [tightened(one, asked) for one in tunings.values() if one.verdict == "not_held" and one.verification is not None]
        if not missed or None in missed:
            break
        tolerances = [(one.tolerance, one.nominal_tolerance) for one in missed if one is not None]
        tighter = replace(asked, tolerance=min(one[0] for one in tolerances), nominal_tolerance=min(one[1] for one in tolerances))
    return tunings


def chosen_again(
    tunings: Mapping[str, Tuning], asked: Requirements, tighter: Requirements, say: Say, *, common: bool
) -> dict[str, Tuning]:
    """The tunings with shapers for tighter requirements, each verified alone; or with a common one for the modes of all."""
    shaped = {name: one for name, one in tunings.items() if one.choice is not None}
    sets = {name: _own_boxes(one) for name, one in shaped.items()}
    found, choice = dict(tunings), None
    for name, one in shaped.items():
        assert one.system is not None
        if choice is None or not common:
            say(f"choosing a shaper for {'all inputs' if common else name}")
            choice = choose(merged_boxes(list(sets.values())) if common else sets[name], tighter)
        fresh = replace(one, choice=choice, verification=None, responses=(), verdict="nothing_fits", summary=choice.reason)
        if choice.recommended is not None:
            say(f"verifying it on {name}")
            try:
                fresh = tried_within(fresh, asked, one.system)
            except BudgetError as error:
                fresh = untried(fresh, str(error))
        found[name] = replace(fresh, efforts=one.system.meter.efforts)
    return found


def _own_boxes(one: Tuning) -> list[ModeBox]:
    """The boxes of an input's own modes."""
    assert one.plant is not None
    assert one.system is not None
    return mode_boxes(one.plant, [one.system.full(name) for name in one.outputs])
