"""A choice in words: why this shaper, or what would have to change so that one fits."""

from __future__ import annotations

import math
from collections.abc import Sequence

from shaper_fmu.tune.boxes import UNDAMPED, ModeBox
from shaper_fmu.tune.candidates import remaining
from shaper_fmu.tune.choice import Candidate, Choice, Search, shortest_of

_BISECTIONS = 12
_NOT_SEEN = 0.998
"""By how much a range is narrowed further for what lies between the points at which V was looked at."""


def recommendation(choice: Choice) -> str:
    """The reason of a recommendation; where nothing fits, which comes nearest and what would make it fit."""
    if choice.recommended is None:
        return _nothing_fits(choice)
    best, wish = choice.recommended, choice.wish
    where = f"within {percent(wish.tolerance)} over {ranges(choice.boxes)}"
    if best.delay == 0.0:
        return f"{best.name}: no shaper is needed, it is {where} and leaves at most {percent(best.worst_case)}"
    text = f"{best.name}: shortest of those {where}, {best.delay:.4g} s later than unshaped; it leaves at most {left(best)}"
    shorter = [one for one in choice.front if one.delay < best.delay]
    if len(shorter) > 1:  # the first is unshaped
        other = shorter[-1]
        text += f". {other.name} is {best.delay - other.delay:.3g} s shorter but may leave {left(other)}"
    return text + _floor(choice, best)


def percent(share: float) -> str:
    """A share in percent, with three digits."""
    return f"{100.0 * share:.3g} %"


def left(candidate: Candidate) -> str:
    """What a candidate leaves, in percent."""
    return percent(candidate.worst_case)


def ranges(boxes: Sequence[ModeBox]) -> str:
    """The boxes in words."""
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
    if share < -1e-6:
        return f". It is {percent(-share)} shorter than any shaper of positive impulses could be"
    if share < 1e-3:
        return ". It is on the floor: no shaper of positive impulses that fits is shorter by 0.1 %"
    return f". The floor is {percent(share)} below: no shaper of positive impulses that fits is shorter than {choice.floor:.4g} s"


def _nothing_fits(choice: Choice) -> str:
    wish, nearest = choice.wish, choice.nearest
    limit = f" and a delay of {wish.longest_delay:.4g} s" if math.isfinite(wish.longest_delay) else ""
    text = (
        f"nothing fits a tolerance of {percent(wish.tolerance)}{limit} over {ranges(choice.boxes)}. {nearest.name} comes nearest: "
        f"{nearest.delay:.4g} s later than unshaped, it may leave {left(nearest)}"
    )
    larger = rounded_up(nearest.worst_case)
    ways = [f"a tolerance of {100.0 * larger:.3g} % ({nearest.name})"] if larger < 1.0 else []
    good = [one for one in choice.candidates if one.worst_case <= wish.tolerance]
    if good:
        best = shortest_of(good)
        ways.append(f"a delay of {rounded_up(best.delay):.4g} s ({best.name})")
    narrower = narrowed(choice)
    if narrower is not None:
        ways.append(f"modes that stay within {ranges(narrower[1])} ({narrower[0].name})")
    if not wish.allow_negative and wish.kinds is None and not good:
        ways.append("perhaps negative impulses, if the actuator can follow them (allow_negative)")
    if not ways:
        return f"{text}. Neither a longer delay nor a narrower range makes one of these kinds fit"
    return f"{text}. What would make one fit: {', or '.join(ways)}"


def rounded_up(value: float) -> float:
    """A value rounded up to three digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.ceil(value / step * (1.0 - 1e-12)) * step


def narrowed(choice: Choice) -> tuple[Candidate, list[ModeBox]] | None:
    """The widest boxes about the same centres for which a candidate within the delay, as it is designed, fits, and which one.

    Proven for that candidate; None if even exactly known modes do not help.
    """
    wish = choice.wish
    if all(box.frequencies[0] == box.frequencies[1] and box.dampings[0] == box.dampings[1] for box in choice.boxes):
        return None
    widest, chosen = 0.0, None
    for candidate in choice.candidates:
        if candidate.delay <= wish.longest_delay and candidate.profile is None and candidate.delay > 0.0:
            factor = _widest(choice, candidate)
            if factor > widest:
                widest, chosen = factor, candidate
    for _ in range(_BISECTIONS if chosen is not None else 0):
        widest *= _NOT_SEEN
        boxes = [box.scaled(widest) for box in choice.boxes]
        assert chosen is not None
        proven = Search(boxes, wish).add(chosen.design)
        if proven.worst_case <= wish.tolerance:
            return proven, boxes
    return None


def _widest(choice: Choice, candidate: Candidate) -> float:
    """The largest factor for the widths of the boxes at which the candidate seems to fit; 0 if there is none."""
    search = Search([box.scaled(1.0) for box in choice.boxes], choice.wish)

    def fitting(factor: float) -> bool:
        boxes = [box.scaled(factor) for box in choice.boxes]
        return search.levels([remaining(candidate.sequence, box) for box in boxes]) <= choice.wish.tolerance

    low, high = 0.0, 1.0
    if not fitting(low):
        return 0.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fitting(middle) else (low, middle)
    return low
