"""The report of a tuning: the recommendation, its evidence, and its verification on the plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from shaper_fmu.analysis.identification import CONTRADICTING
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.page.blocks import Block, Heading, Table, Text
from shaper_fmu.report.modes import impulses_table
from shaper_fmu.report.run import system_drawing
from shaper_fmu.report.tune.choice import alternative_blocks, sensitivity_blocks, trade_off_blocks
from shaper_fmu.report.tune.evidence import Evidence, evidence, recording_blocks, ring_down_blocks, spectrum_blocks
from shaper_fmu.report.tune.modes import mode_blocks, percent
from shaper_fmu.report.tune.opening import opening_blocks
from shaper_fmu.report.tune.plant import effort_blocks, response_blocks, verification_blocks
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.tune.tuning import Tuning, Verdict

_OF_MODES = {"Sensitivity", "Trade-off", "Alternatives"}
_NO_LIMIT = 1e299
_IF = "All this is for the modes found, which findings contradict: nothing of it is proven."
_MEASURED = "All this is for the modes found in the recording, within their ranges. The machine may have others."
_PROVEN: tuple[Verdict, ...] = ("tuned", "nothing_fits")
"""Verdicts that do not contradict a bound for the modes found."""


def tuning_blocks(tuning: Tuning, system: SystemStructure | None = None, panel: Sequence[Block] = ()) -> list[Block]:
    """Blocks of the page; sections for which there is nothing are left out.

    `system` is the shaped plant, to be drawn; `panel` the live panel.
    """
    found, choice = evidence(tuning), tuning.choice
    sections: dict[str, list[Block]] = {
        "Recommendation": recommendation_blocks(tuning, system, panel),
        "Modes": mode_blocks(tuning, found),
        "Spectrum": [*_fewer(tuning, found), *spectrum_blocks(found)],
        "Ring-down and fit": [*recording_blocks(tuning.measured, found.shown), *ring_down_blocks(found)],
    }
    if choice is not None:
        sections["Sensitivity"] = sensitivity_blocks(choice)
        sections["Trade-off"] = trade_off_blocks(choice)
    sections["Before and after"] = response_blocks(tuning, found.shown)
    if choice is not None:
        sections["Alternatives"] = alternative_blocks(choice)
    words = _IF if tuning.verdict == "not_proven" else _MEASURED if tuning.plant is None else ""
    for title in sections.keys() & _OF_MODES if words else ():
        sections[title].insert(0, Text(words))
    sections["Verification"] = verification_blocks(tuning)
    sections["What it cost"] = effort_blocks(tuning)
    shown = [block for title, blocks in sections.items() if blocks for block in (Heading(title), *blocks)]
    return [replace(block, folded=True) if isinstance(block, Table) else block for block in shown]


def recommendation_blocks(tuning: Tuning, system: SystemStructure | None = None, panel: Sequence[Block] = ()) -> list[Block]:
    """The verdict, the picture, and behind them the shaper with its start values."""
    blocks = opening_blocks(tuning)
    choice, candidate = tuning.choice, tuning.candidate
    if choice is None or candidate is None:
        return blocks
    blocks += panel
    blocks += system_drawing(system) if system is not None else []
    blocks.append(summary_table(tuning, choice))
    if candidate.profile is not None:
        blocks.append(start_values_table("MotionProfile", candidate.profile.start_values()))
        if not candidate.design.factors:
            return blocks
        blocks.append(Text("The profile goes through an InputShaper:"))
    return [*blocks, start_values_table("InputShaper", candidate.start_values()), impulses_table(candidate.sequence, digits=4)]


def summary_table(tuning: Tuning, choice: Choice) -> Table:
    """The shaper's numbers and the requirements."""
    one, requirements, seen = choice.nearest, choice.requirements, tuning.verification
    against = any(one.code in CONTRADICTING for one in tuning.findings)
    known = "proven" if tuning.verdict in _PROVEN and tuning.plant is not None and not against else "for the modes found,"
    rows = [
        ["shaper" if choice.recommended is not None else "shaper (nearest)", one.name],
        ["delay", f"{one.delay:.4g} s"],
        [f"worst case, {known} over the ranges", f"{percent(one.worst_case)} of the unshaped vibration"],
        [f"nominally, {known}", percent(one.nominal)],
    ]
    if seen is not None:
        rows.append(["on the plant, nominal", percent(seen.nominal.share)])
        rows.append(["on the plant, worst", percent(seen.worst.share)])
    rows.append(["tolerance", percent(requirements.tolerance)])
    if requirements.nominal_tolerance < 1.0:
        rows.append(["nominal tolerance", percent(requirements.nominal_tolerance)])
    if requirements.longest_delay < float("inf"):
        rows.append(["longest delay", f"{requirements.longest_delay:.4g} s"])
    rows += [["margin of the frequencies", percent(requirements.frequency_margin)]] if requirements.frequency_margin else []
    rows += [["margin of the damping ratios", percent(requirements.damping_margin)]] if requirements.damping_margin else []
    if choice.floor:
        what = "no positive shaper that fits is shorter" if requirements.move is None else "no move that fits has less delay"
        rows.append([f"floor: {what}", f"{choice.floor:.4g} s"])
    rows += [[f"varied: {name}", f"± {percent(share)}"] for name, share in tuning.spread.items()]
    return Table("The shaper", ["what", "value"], rows, left_aligned=True)


def start_values_table(component: str, values: Mapping[str, Any]) -> Table:
    """Start values of a component, element by element, with four digits: whoever needs all takes them from the files."""
    rows = []
    for name, value in values.items():
        elements = enumerate(value, 1) if isinstance(value, list | tuple) else [(0, value)]
        rows += [[f"{name}[{i}]" if i else name, short_number(v)] for i, v in elements]
    return Table(f"Start values of the {component} (rounded; all digits are in the .ssv and .json)", ["parameter", "value"], rows)


def short_number(value: Any) -> str:
    """A number with four digits; what is no limit is told so."""
    if not isinstance(value, float):
        return str(value)
    return "no limit" if abs(value) >= _NO_LIMIT else f"{value:.4g}"


def _fewer(tuning: Tuning, found: Evidence) -> list[Block]:
    """A sentence on which outputs are shown, if there are many."""
    if len(found.shown) == len(tuning.outputs):
        return []
    number, most = len(tuning.outputs), len(found.shown)
    return [Text(f"Of {number} outputs the {most} are shown that vibrate most, compared with others of the same unit.")]
