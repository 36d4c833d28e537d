"""The opening of a tuning's report: the sentence and the picture that decide; all the rest is behind them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from shaper_fmu.page.blocks import Block, Text
from shaper_fmu.page.figures import UNSHAPED_AND_SHAPED, Figure, Line, Panels, label
from shaper_fmu.report.sweep.curves import thinned
from shaper_fmu.report.tune.choice import left_of, role, shown_range
from shaper_fmu.report.tune.modes import both_units, percent
from shaper_fmu.report.tune.plant import shown_unit
from shaper_fmu.tune.choice.boxes import shares
from shaper_fmu.tune.choice.result import Choice, fits
from shaper_fmu.tune.choice.search import Candidate
from shaper_fmu.tune.tuning import Tuning, Verdict
from shaper_fmu.tune.verification.move import MoveCommand

VERDICTS: Mapping[Verdict, str] = {
    "tuned": "Tuned: the shaper below meets the requirements, and holds on the plant.",
    "for_modes_found": "The shaper below meets the requirements for the modes found in the recording; it was not tried.",
    "no_vibration": "No shaper is needed: nothing vibrates.",
    "unstable": "No shaper can help: the plant is unstable.",
    "nothing_fits": "No shaper meets the requirements. The one below comes nearest.",
    "not_held": "The shaper below fits the identified modes, but the plant does not show that it meets the requirements.",
    "not_proven": "Nothing is proven: findings contradict the modes, or the absence of modes.",
    "not_verified": "The shaper below fits the identified modes. It could not be tried on the plant.",
}
_POINTS = 401


def opening_blocks(tuning: Tuning) -> list[Block]:
    """The verdict with its numbers, the picture, and the reasons in words, folded."""
    sentence = " ".join(filter(None, [VERDICTS[tuning.verdict], decision_text(tuning)]))
    blocks: list[Block] = [Text(sentence)]
    panels = decision_panels(tuning)
    if panels is not None:
        blocks.append(panels)
    if tuning.summary:
        blocks.append(Text(tuning.summary[:1].upper() + tuning.summary[1:] + ".", folded="In words"))
    return blocks


def decision_text(tuning: Tuning) -> str:
    """The shaper, its delay, what it leaves before and after, and the runner-up; "" where there is nothing to choose."""
    choice = tuning.choice
    if choice is None:
        return ""
    best, wanted = choice.nearest, choice.requirements
    for_whom = "" if tuning.verdict == "tuned" else " for the modes found"
    text = (
        f"{best.name}: {best.delay:.4g} s of delay, at most {percent(best.worst_case)} of the unshaped vibration{for_whom} "
        f"(tolerance {percent(wanted.tolerance)})"
    )
    return f"{text}{_seen_text(tuning)}; {runner_up_text(choice)}."


def _seen_text(tuning: Tuning) -> str:
    """What was seen on the plant, in the units for people: of the output that keeps most, at the worst point."""
    found = tuning.verification
    if found is None:
        return ""
    worst = found.worst
    j = max(range(len(found.outputs)), key=lambda k: worst.shares[k])
    unit, factor = shown_unit(tuning, found.outputs[j])
    before, after = (f"{abs(factor) * value:.4g}" for value in (worst.before[j], worst.after[j]))
    where = "on the plant at worst" if worst.values else "on the plant"
    return f", {where} {found.outputs[j]} ± {f'{before} {unit}'.rstrip()} before and ± {f'{after} {unit}'.rstrip()} after"


def runner_up(choice: Choice) -> Candidate | None:
    """The candidate that would be taken next: the shortest of other kinds that fits, else the nearest one of the front."""
    best, refuted = choice.nearest, [one for one, _ in choice.refuted]
    others = [one for one in choice.candidates if _kinds(one) != _kinds(best) and not any(one is other for other in refuted)]
    fitting = [one for one in others if fits(one, choice.requirements)]
    front = [one for one in choice.front if one is not best and one.delay > 0.0]
    found = sorted(fitting or front, key=lambda one: (one.delay if fitting else abs(one.delay - best.delay), one.worst_case))
    return found[0] if found else None


def _kinds(candidate: Candidate) -> str:
    """Its name without the modes that it is designed for: the same kind for a little different mode is no other choice."""
    return re.sub(r" on [^,]*", "", candidate.name)


def runner_up_text(choice: Choice) -> str:
    """The runner-up, and why it is not recommended."""
    one, best, wanted = runner_up(choice), choice.nearest, choice.requirements
    if one is None:
        return "there is no runner-up"
    text = f"the runner-up {one.name}, {one.delay:.4g} s and at most {percent(one.worst_case)},"
    if one.worst_case > wanted.tolerance:
        return f"{text} leaves more than the tolerance"
    if one.nominal > wanted.nominal_tolerance:
        return f"{text} leaves {percent(one.nominal)} nominally, more than {percent(wanted.nominal_tolerance)}"
    if one.delay > wanted.longest_delay:
        return f"{text} takes longer than {wanted.longest_delay:.4g} s"
    more = one.delay - best.delay
    if more > 0.0 and f"{more:.1g}" != "0":
        return f"{text} takes {more:.3g} s more"
    return f"{text} saves {-more:.3g} s, and does not follow the mode while it runs" if more < 0.0 else f"{text} takes as long"


def decision_panels(tuning: Tuning) -> Panels | None:
    """The response at the worst place, before and after, and V over the range of the mode that decides."""
    choice = tuning.choice
    if choice is None:
        return None
    figures = [_response(tuning)] if tuning.responses and tuning.verification is not None else []
    return Panels("decision", "What decides", [*figures, _sensitivity(choice)])


def _response(tuning: Tuning) -> Figure:
    seen, found = tuning.responses[-1], tuning.verification
    assert found is not None
    kept = [name for name in found.outputs if name in seen.outputs] or list(seen.outputs)
    output = max(kept, key=lambda name: found.worst.shares[found.outputs.index(name)] if name in found.outputs else 0.0)
    unit, factor = shown_unit(tuning, output)
    names = ("fastest within limits", "recommended") if isinstance(tuning.command, MoveCommand) else ("unshaped", "shaped")
    lines = [
        Line(name, *thinned(seen.time, factor * values), style=style)
        for name, values, style in zip(names, seen.outputs[output], UNSHAPED_AND_SHAPED, strict=True)
    ]
    title = f"{output}, before and after, {'nominal' if seen.case == 'nominal' else 'at worst'}"
    return Figure("decision_response", title, "time [s]", label(output, unit), lines)


def _sensitivity(choice: Choice) -> Figure:
    """V of the recommended shaper and of the runner-up over the mode of which the recommended one leaves most."""
    parts = shares(choice.boxes).max(axis=1) * np.array(choice.nearest.bounds)
    k = int(np.argmax(parts))
    box = choice.boxes[k]
    (low, high), (w, zeta) = box.frequencies, box.nominal
    at = np.unique(np.concatenate([np.linspace(*shown_range(box), _POINTS), [low, high, w]])) / (2.0 * math.pi)
    other = runner_up(choice)
    shown = [(role(choice, choice.nearest), choice.nearest, 0), *([("runner-up: " + other.name, other, 4)] if other else [])]
    lines = [
        Line(name, at, 100.0 * np.array([left_of(one, 2.0 * math.pi * f, zeta) for f in at]), style=style)
        for name, one, style in shown
    ]
    tolerance = choice.requirements.tolerance
    title = f"Mode {k + 1}, {both_units(low, high)}: what is left over the range (shaded)"
    return Figure(
        "decision_sensitivity", title, "natural frequency [Hz]", "residual vibration V [%]", lines,
        [(100.0 * tolerance, f"tolerance {percent(tolerance)}")],
        bands=[(0.5 * low / math.pi, 0.5 * high / math.pi)],
    )  # fmt: skip
