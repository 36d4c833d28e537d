"""The reasons for a choice, or the changes with which a candidate would fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from shaper_fmu.tune.choice.bounds import remaining
from shaper_fmu.tune.choice.boxes import UNDAMPED, ModeBox
from shaper_fmu.tune.choice.result import Choice, fits, preferred, quick
from shaper_fmu.tune.choice.search import SAME, Candidate, Search

_BISECTIONS = 12
_NOTHING = 1e-5
"""Smaller levels are shown as less than this one."""
_NOT_SEEN = 0.998
"""By how much a range is narrowed further for what lies between the points at which V was looked at."""


def recommendation(choice: Choice) -> str:
    """The reason of a recommendation; where nothing fits, which comes nearest and what would make it fit."""
    if choice.recommended is None:
        return _nothing_fits(choice)
    best, requirements = choice.recommended, choice.requirements
    where = f"within {percent(requirements.tolerance)} over {ranges(choice.boxes)}"
    if requirements.nominal_stricter:
        where += f" and within {percent(requirements.nominal_tolerance)} nominally"
    if best.delay == 0.0:
        return f"{best.name}: no shaper is needed, it is {where} and leaves at most {left(best)}{_nominally(choice, best)}"
    saving, refuted = _shorter_custom(choice, best), [one for one, _ in choice.refuted]
    text = (
        f"{best.name}: shortest{' of a kind' if saving else ''} of those {where}{' that hold on the plant' if refuted else ''}, "
        f"{best.delay:.4g} s later than unshaped; it leaves at most {left(best)}{_nominally(choice, best)}"
    )
    text += "".join(f". {one.name} ({one.delay:.4g} s) fits by its bound, but {why}" for one, why in choice.refuted)
    if saving:
        text += (
            f". {saving.name} is {percent(1.0 - saving.delay / best.delay)} shorter, but a custom sequence, which neither follows "
            "its modes while it runs nor can be set by hand"
        )
    shorter = [one for one in choice.front if one.delay < best.delay * (1.0 - SAME) and not fits(one, requirements)]
    if len(shorter) > 1:  # the first is unshaped
        other = shorter[-1]
        only_nominally = other.worst_case <= requirements.tolerance
        leaves = f"leaves {percent(other.nominal)} nominally" if only_nominally else f"may leave {left(other)}"
        text += f". {other.name} is {best.delay - other.delay:.3g} s shorter but {leaves}"
    return text + _floor(choice, best)


def _shorter_custom(choice: Choice, best: Candidate) -> Candidate | None:
    """The shortest candidate that fits, is not refuted and was not recommended, since it saves too little."""
    refuted = {id(one) for one, _ in choice.refuted}
    fitting = (one for one in choice.candidates if fits(one, choice.requirements) and id(one) not in refuted)
    return next((one for one in fitting if one.delay < best.delay * (1.0 - SAME)), None)


def _nominally(choice: Choice, candidate: Candidate) -> str:
    """The nominal level of a candidate, if the boxes are more than points."""
    if _exactly_known(choice.boxes):
        return ""
    if candidate.nominal < _NOTHING:
        return f", nominally less than {percent(_NOTHING)}"
    return f", nominally {percent(candidate.nominal)}"


def _exactly_known(boxes: Sequence[ModeBox]) -> bool:
    return all(box.frequencies[0] == box.frequencies[1] and box.dampings[0] == box.dampings[1] for box in boxes)


def percent(share: float) -> str:
    """A share in percent, with three digits."""
    return f"{100.0 * share:.3g} %"


def percent_beside(share: float, limit: float) -> str:
    """A share in percent, with as many digits as tell it from a limit, and three at least."""
    texts = (f"{100.0 * share:.{digits}g}" for digits in range(3, 17))
    return next((text for text in texts if text != f"{100.0 * limit:.3g}"), f"{100.0 * share:.17g}") + " %"


def left(candidate: Candidate) -> str:
    """The bound of a candidate, in percent."""
    return percent(candidate.worst_case)


def ranges(boxes: Sequence[ModeBox]) -> str:
    """The boxes as a text."""
    found = []
    for box in boxes:
        (low, high), (light, heavy) = box.frequencies, box.dampings
        text = f"{low:.4g} to {high:.4g} rad/s" if low < high else f"{low:.4g} rad/s"
        if light < heavy and heavy > UNDAMPED:
            text += f" (damping ratio {light:.3g} to {heavy:.3g})"
        elif heavy > UNDAMPED:
            text += f" (damping ratio {heavy:.3g})"
        found.append(text)
    return " and ".join(found)


def _floor(choice: Choice, best: Candidate) -> str:
    if not choice.floor:
        return ""
    share = 1.0 - choice.floor / best.delay
    if choice.requirements.move is not None:
        return f". No move within these limits that fits ends less than {choice.floor:.4g} s later than the fastest one"
    if share < -1e-6:
        return f". It is {percent(-share)} shorter than any shaper of positive impulses could be"
    if share < 1e-3:
        return ". It is on the floor: no shaper of positive impulses that fits is shorter by 0.1 %"
    return f". The floor is {percent(share)} below: no shaper of positive impulses that fits is shorter than {choice.floor:.4g} s"


def _nothing_fits(choice: Choice) -> str:
    requirements, nearest = choice.requirements, choice.nearest
    asked = [f"a tolerance of {percent(requirements.tolerance)}"]
    if requirements.nominal_stricter:
        asked.append(f"a nominal tolerance of {percent(requirements.nominal_tolerance)}")
    if math.isfinite(requirements.longest_delay):
        asked.append(f"a delay of {requirements.longest_delay:.4g} s")
    text = (
        f"nothing fits {', '.join(asked[:-1])}{' and ' if len(asked) > 1 else ''}{asked[-1]} over {ranges(choice.boxes)}. "
        f"{nearest.name} comes nearest: {nearest.delay:.4g} s later than unshaped, it may leave {left(nearest)}"
    )
    if requirements.nominal_stricter:
        text += _nominally(choice, nearest)
    ways = _larger_tolerances(choice)
    good = [one for one in choice.candidates if fits(one, replace(requirements, longest_delay=math.inf))]
    if good:
        best = preferred(good, requirements)
        ways.append(f"a delay of {rounded_up(best.delay):.4g} s ({best.name})")
    narrower = narrowed(choice)
    if narrower is not None:
        ways.append(f"modes that stay within {ranges(narrower[1])} ({narrower[0].name})")
    if not requirements.allow_negative and requirements.kinds is None and not good:
        ways.append("perhaps negative impulses, if the actuator can follow them (allow_negative)")
    if not ways:
        return f"{text}. Neither a longer delay nor a narrower range makes one of these kinds fit"
    return f"{text}. These changes would make one fit: {', or '.join(ways)}"


def _larger_tolerances(choice: Choice) -> list[str]:
    """The least tolerance, and the least nominal one, for which a candidate within the delay fits; both where one is not enough."""
    requirements = choice.requirements
    candidates = [one for one in choice.candidates if quick(one, requirements)]
    if not requirements.nominal_stricter:
        return [f"a tolerance of {text} ({one.name})" for one in [choice.nearest] if (text := _as_much(one.worst_case))]
    ways = []
    nominally = [one for one in candidates if one.nominal <= requirements.nominal_tolerance]
    if nominally:
        one = min(nominally, key=lambda one: (one.worst_case, one.delay))
        ways += [f"a tolerance of {text} ({one.name})"] if (text := _as_much(one.worst_case)) else []
    in_range = [one for one in candidates if one.worst_case <= requirements.tolerance]
    if in_range:
        one = min(in_range, key=lambda one: (one.nominal, one.delay))
        ways.append(f"a nominal tolerance of {_as_much(one.nominal)} ({one.name})")
    if not ways and (text := _as_much(choice.nearest.worst_case)):
        nominal = _as_much(choice.nearest.nominal)
        ways.append(f"a tolerance of {text} and a nominal tolerance of {nominal} ({choice.nearest.name})")
    return ways


def _as_much(level: float) -> str:
    """A level rounded up, in percent; nothing if that is no tolerance."""
    larger = rounded_up(level)
    return f"{100.0 * larger:.3g} %" if larger < 1.0 else ""


def rounded_up(value: float) -> float:
    """A value rounded up to three digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / step * (1.0 - 1e-12)) * step


def narrowed(choice: Choice) -> tuple[Candidate, list[ModeBox]] | None:
    """The widest boxes for which a candidate within the delay, as it is designed, fits, and which one.

    They are about the middles of the boxes, with a nominal condition about the nominal points. Proven for that candidate; None if
    even exactly known modes do not help.
    """
    requirements = choice.requirements
    if _exactly_known(choice.boxes):
        return None
    widest, chosen = 0.0, None
    for candidate in choice.candidates:
        if candidate.delay <= requirements.longest_delay and candidate.profile is None and candidate.delay > 0.0:
            factor = _widest(choice, candidate)
            if factor > widest:
                widest, chosen = factor, candidate
    for _ in range(_BISECTIONS if chosen is not None else 0):
        widest *= _NOT_SEEN
        boxes = _scaled(choice, widest)
        assert chosen is not None
        proven = Search(boxes, requirements).add(chosen.design)
        if fits(proven, requirements):
            return proven, boxes
    return None


def _scaled(choice: Choice, factor: float) -> list[ModeBox]:
    return [box.scaled(factor, nominally=choice.requirements.nominal_asked) for box in choice.boxes]


def _widest(choice: Choice, candidate: Candidate) -> float:
    """The largest factor for the widths of the boxes at which the candidate seems to fit; 0 if there is none."""
    requirements = choice.requirements
    search = Search(_scaled(choice, 1.0), requirements)

    def fitting(factor: float) -> bool:
        level, nominal = search.levels([remaining(candidate.sequence, box) for box in _scaled(choice, factor)])
        return level <= requirements.tolerance and nominal <= requirements.nominal_tolerance

    low, high = 0.0, 1.0
    if not fitting(low):
        return 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fitting(middle) else (low, middle)
    return low
