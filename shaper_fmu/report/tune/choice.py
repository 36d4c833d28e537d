"""The choice of a tuning: sensitivity of the shapers, trade-off between delay and residual, alternatives."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.tune.modes import both_units, percent, span
from shaper_fmu.tune.choice.boxes import UNDAMPED, ModeBox, shares
from shaper_fmu.tune.choice.result import Choice, fits
from shaper_fmu.tune.choice.search import Candidate

_POINTS = 601
_COMPARED = 3
_AROUND = (0.7, 1.4)
"""Frequencies that are shown at least, over the ends of the range."""
_NEAR = 0.12
"""Marks that are closer than this share of the axis have one label."""
_LEAST = 1e-3
"""Worst case at the left end of the trade-off [%]: less is as good as nothing."""
_MOST_ROWS = 40


def sensitivity_blocks(choice: Choice) -> list[Block]:
    """The range of each mode, the bound of the shaper, and V over the mode's frequency for some shapers."""
    text = (
        "V is the residual vibration when the command ends, as a share of what the unshaped step excites at its time. Each mode "
        "counts with its share of the response: the sum over the modes, in the worst output, is within the tolerance."
    )
    several = [Text(text)] if len(choice.boxes) > 1 else [Text(text.partition(" Each")[0])]
    compared = compared_with(choice)
    return [
        *several,
        bounds_table(choice),
        *(sensitivity_figure(choice, k, compared) for k in range(len(choice.boxes))),
    ]


def bounds_table(choice: Choice) -> Table:
    """The boxes, margins included, and the proven bounds of V."""
    parts, best = shares(choice.boxes).max(axis=1), choice.nearest
    rows = []
    for k, box in enumerate(choice.boxes):
        (low, high), (light, heavy), (w, zeta) = box.frequencies, box.dampings, best.at[k]
        where = f"{w:.4g} rad/s, {zeta if zeta > UNDAMPED else 0.0:.3g}"
        dampings = span(light, heavy, 3) if heavy > UNDAMPED else "0"
        share, most = percent(float(parts[k])), percent(best.bounds[k])
        rows.append(
            [str(k + 1), span(low, high, 4), span(low / (2.0 * math.pi), high / (2.0 * math.pi), 4), dampings, share, most, where]
        )
    head = ["mode", "natural frequency [rad/s]", "[Hz]", "damping ratio", "largest share", "V at most (bound)", "at"]
    return Table(f"What {best.name} leaves of each mode", head, rows)


def compared_with(choice: Choice) -> list[Candidate]:
    """The recommended (or nearest) candidate, then its neighbours on the front: the next shorter one and longer ones."""
    best = choice.nearest
    shorter = [one for one in choice.front if 0.0 < one.delay < best.delay and one is not best]
    longer = [one for one in choice.front if one.delay > best.delay]
    return [best, *shorter[-1:], *longer][: 1 + _COMPARED]


def left_of(candidate: Candidate, natural_frequency: float, damping_ratio: float) -> float:
    """V of a candidate; for a move that of the profile and the shaper together."""
    v = candidate.sequence.residual_vibration(natural_frequency, damping_ratio)
    law = candidate.profile
    return v * law.residual_vibration(natural_frequency, damping_ratio) if law is not None and law.duration > 0.0 else v


def sensitivity_figure(choice: Choice, k: int, compared: Sequence[Candidate]) -> Figure:
    """V in percent over the natural frequency of one mode, at its nominal damping ratio."""
    box = choice.boxes[k]
    (low, high), (_, zeta) = box.frequencies, box.nominal
    w = np.unique(np.concatenate([np.linspace(*shown_range(box), _POINTS), [low, high, box.natural_frequency.nominal]]))
    lines = [
        Line(role(choice, one), w, 100.0 * np.array([left_of(one, float(x), zeta) for x in w])) for one in compared
    ]  # fmt: skip
    tolerance = choice.requirements.tolerance
    title = f"Mode {k + 1}, identified as {both_units(low, high)}: residual vibration (damping ratio {zeta:.3g})"
    levels = [(100.0 * tolerance, f"tolerance {percent(tolerance)}")]
    ends = [(low, f"{low:.4g}"), (box.natural_frequency.nominal, "nominal"), (high, f"{high:.4g}")]
    marks = apart(ends, float(w[-1] - w[0]))
    return Figure(
        f"sensitivity_{k + 1}",
        title,
        "natural frequency [rad/s]",
        "residual vibration V [%]",
        lines,
        levels,
        marks,
        bands=[(low, high)],
    )


def shown_range(box: ModeBox) -> tuple[float, float]:
    """The range of a mode [rad/s], and as much of its surroundings as shows where V rises."""
    (low, high), (below, above) = box.frequencies, _AROUND
    width = high - low
    return max(0.05 * low, min(below * low, low - width)), max(above * high, high + width)


def apart(marks: Sequence[tuple[float, str]], width: float) -> list[tuple[float, str]]:
    """Marks at different places; of those too close to be labelled side by side the inner ones go first."""
    (first, *_), (*_, last) = marks, marks
    if last[0] - first[0] <= 1e-9 * width:
        return [(first[0], f"{first[1]} rad/s")]
    if last[0] - first[0] < _NEAR * width:
        return [(first[0], ""), (last[0], f"{first[1]} to {last[1]}")]
    inner = [one for one in marks[1:-1] if min(one[0] - first[0], last[0] - one[0]) >= _NEAR * width]
    return [first, *inner, last]


def role(choice: Choice, candidate: Candidate) -> str:
    """A candidate's name, and whether it is the recommended or the nearest one."""
    if candidate is not choice.nearest:
        return candidate.name
    return f"{candidate.name} ({'recommended' if choice.recommended is not None else 'nearest'})"


def trade_off_blocks(choice: Choice) -> list[Block]:
    """The trade-off between delay and residual vibration."""
    text = "The front is the Pareto front: no other shaper is as short as one of these and leaves less."
    if choice.requirements.nominal_tolerance < choice.requirements.tolerance:
        text = (
            "The front is the Pareto front: no other shaper is as short as one of these and leaves less in the worst case and "
            "nominally. Levels within the nominal tolerance count as equal."
        )
    if choice.floor:
        what = "shaper of positive impulses" if choice.requirements.move is None else "move within these limits"
        text += f" Below the floor no {what} is within the tolerance."
    return [Text(text), trade_off_figure(choice)]


def least(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that leave less in the worst case than all shorter ones; `candidates` by rising delay."""
    found: list[Candidate] = []
    for one in candidates:
        if not found or one.worst_case < found[-1].worst_case:
            found.append(one)
    return found


def trade_off_figure(choice: Choice) -> Figure:
    """Delay [s] over worst case [%]: all candidates, the front, the one recommended."""

    def worst(candidates: Sequence[Candidate]) -> np.ndarray:
        return np.array([max(_LEAST, 100.0 * one.worst_case) for one in candidates])

    def points(name: str, candidates: Sequence[Candidate], style: int) -> Line:
        return Line(name, worst(candidates), np.array([one.delay for one in candidates]), style=style, joined=False)

    best, stairs = choice.nearest, least(choice.candidates)
    x, y = worst(stairs), np.array([one.delay for one in stairs])
    inner = [one for one in choice.candidates if not any(one is other for other in choice.front)]
    lines = [Line("least delay", np.repeat(x, 2)[:-1], np.repeat(y, 2)[1:], style=0), points("the front", choice.front, 0)]
    lines += [points("other shapers", inner, 4)] if inner else []
    lines.append(points(role(choice, best), [best], 1))
    levels = [(choice.floor, f"floor {choice.floor:.4g} s")] if choice.floor else []
    if choice.requirements.longest_delay < math.inf:
        levels.append((choice.requirements.longest_delay, f"longest delay {choice.requirements.longest_delay:.4g} s"))
    marks = [(100.0 * choice.requirements.tolerance, f"tolerance {percent(choice.requirements.tolerance)}")]
    below = f" ({_LEAST:g}: that or less)" if min(100.0 * one.worst_case for one in choice.candidates) < _LEAST else ""
    x_label = f"residual vibration in the worst case, bound [%]{below}"
    return Figure("trade_off", "Delay against robustness", x_label, "delay [s]", lines, levels, marks, log_x=True)


def alternative_blocks(choice: Choice) -> list[Block]:
    """A table of the front, and the designs that were left out, with reasons."""
    blocks: list[Block] = [front_table(choice)]
    if choice.dominated:
        text = f"{len(choice.dominated)} more combinations are dominated: another shaper is no longer and leaves no more."
        blocks.append(Text(text))
    if choice.left_out:
        rows = [[one.name, one.reason] for one in choice.left_out[:_MOST_ROWS]]
        few = f" (the first {_MOST_ROWS} of {len(choice.left_out)})" if len(choice.left_out) > _MOST_ROWS else ""
        blocks.append(Table(f"Left out{few}", ["what", "why"], rows, left_aligned=True))
    return blocks


def front_table(choice: Choice) -> Table:
    """The front by rising delay, and the recommended or nearest candidate, if it is not on it."""
    shown = [*choice.front]
    if not any(one is choice.nearest for one in shown):
        shown = sorted([*shown, choice.nearest], key=lambda one: one.delay)
    rows = []
    for one in shown:
        good = "yes" if fits(one, choice.requirements) else "no"
        rows.append([role(choice, one), f"{one.delay:.4g}", percent(one.worst_case), percent(one.nominal), good])
    return Table("Shapers on the front, by rising delay", ["shaper", "delay [s]", "worst case", "nominal", "fits"], rows)
