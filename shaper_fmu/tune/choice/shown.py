"""What a choice shows of itself at the prompt and in a notebook."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from shaper_fmu.notebook.texts import percent
from shaper_fmu.page.blocks import Table
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.tune.choice.search import Candidate

if TYPE_CHECKING:
    from shaper_fmu.tune.choice.result import Choice


def choice_text(choice: Choice) -> str:
    """A choice in one line."""
    what = "recommended" if choice.recommended is not None else "nothing fits, nearest"
    return f"{what}: {candidate_text(choice.nearest)}"


def candidate_text(candidate: Candidate) -> str:
    """A candidate in one line: name, delay, what it leaves."""
    left = f"{percent(candidate.nominal)} nominally, {percent(candidate.worst_case)} at worst"
    return f"{candidate.name}, delay {candidate.delay:.4g} s, leaves {left}"


def choice_facts(choice: Choice) -> dict[str, str]:
    """The facts of a choice."""
    requirements = choice.requirements
    longest = f", delay at most {requirements.longest_delay:g} s" if math.isfinite(requirements.longest_delay) else ""
    return {
        "recommended" if choice.recommended is not None else "nothing fits, nearest": candidate_text(choice.nearest),
        "asked for": f"{percent(requirements.tolerance)}, nominally {percent(requirements.nominal_tolerance)}{longest}",
        "floor": f"{choice.floor:.4g} s" if choice.floor is not None else "",
        "reason": choice.reason,
    }


def modes_table(choice: Choice) -> Table:
    """The modes with the required margins."""
    rows = []
    for k, box in enumerate(choice.boxes):
        (low, high), (light, heavy), w = box.frequencies, box.dampings, box.natural_frequency.nominal
        hertz = f"{w / (2.0 * math.pi):.4g}"
        rows.append([str(k + 1), f"{w:.5g}", hertz, f"{low:.5g} to {high:.5g}", f"{light:.3g} to {heavy:.3g}"])
    return Table("Modes", ["mode", "frequency [rad/s]", "[Hz]", "range [rad/s]", "damping ratio"], rows)


def front_table(choice: Choice) -> Table:
    """The Pareto front."""
    rows = [[one.name, f"{one.delay:.4g}", percent(one.nominal), percent(one.worst_case)] for one in choice.front]
    return Table("No other is as short and leaves less", ["shaper", "delay [s]", "leaves nominally", "at worst"], rows)


def trade_off(choice: Choice) -> Figure:
    """The worst case of all candidates over their delay [s], the front joined."""

    def line(name: str, some: Sequence[Candidate], joined: bool, style: int) -> Line:
        left = np.array([100.0 * one.worst_case for one in some])
        return Line(name, np.array([one.delay for one in some]), left, markers=True, joined=joined, style=style)

    lines = [line("candidates", choice.candidates, False, 6), line("front", choice.front, True, 0)]
    lines.append(line(choice.nearest.name, [choice.nearest], False, 1))
    tolerance = choice.requirements.tolerance
    levels = [(100.0 * tolerance, f"tolerance {percent(tolerance)}")]
    return Figure("trade_off", "Delay against what is left", "delay [s]", "worst case [%]", lines, levels)
