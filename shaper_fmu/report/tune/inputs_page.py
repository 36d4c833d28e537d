"""The report of several inputs that were tuned together: what all commands at once leave, and each input's decision."""

from __future__ import annotations

from dataclasses import replace

from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.page.blocks import Block, Heading, Table, Text
from shaper_fmu.page.figures import Panels
from shaper_fmu.report.run import system_drawing
from shaper_fmu.report.tune.modes import percent
from shaper_fmu.report.tune.opening import opening_blocks
from shaper_fmu.report.tune.plant import points_table
from shaper_fmu.tune.tuning import Tuning, Verdict
from shaper_fmu.tune.tuning_inputs import InputsTuning, folder_name

_WORDS: dict[Verdict, str] = {
    "tuned": "Tuned: the shapers below meet the requirements on the plant, whichever inputs get commands.",
    "no_vibration": "No shaper is needed: no input makes anything vibrate.",
}


def inputs_blocks(found: InputsTuning, system: SystemStructure | None = None) -> list[Block]:
    """Blocks of the page; `system` is the plant with its shapers, to be drawn."""
    verdict = found.verdict.replace("_", " ")
    words = _WORDS.get(found.verdict, f"Not all that was asked for is shown to hold: {verdict}.")
    blocks: list[Block] = [Heading("Result"), Text(f"{words}{_left_text(found)}"), inputs_table(found)]
    blocks += system_drawing(system) if system is not None else []
    first = next(iter(found.tunings.values()))
    blocks += [Heading("All inputs at once"), Text(found.together_words[:1].upper() + found.together_words[1:] + ".")]
    if found.together is not None:
        blocks.append(replace(points_table(first, found.together), folded=True))
    for name, one in found.tunings.items():
        blocks += [Heading(f"{name} alone"), *(_own(block, name) for block in opening_blocks(one))]
    return blocks


def _left_text(found: InputsTuning) -> str:
    seen = found.together
    if seen is None:
        return ""
    return (
        f" All commands at once leave at most {percent(seen.worst.share)} of the unshaped vibration (tolerance "
        f"{percent(seen.tolerance)}), nominally {percent(seen.nominal.share)}."
    )


def inputs_table(found: InputsTuning) -> Table:
    """A row for each input: verdict, shaper, delay, and what it leaves alone."""
    rows = [[name, *_row(one), f"{folder_name(name)}/"] for name, one in found.tunings.items()]
    head = ["input", "verdict", "shaper", "delay", "leaves alone, at worst", "its files"]
    return Table("One shaper for all inputs" if found.common else "A shaper for each input", head, rows, left_aligned=True)


def _row(one: Tuning) -> list[str]:
    best, seen = one.candidate, one.verification
    named = [best.name, f"{best.delay:.4g} s"] if best is not None else ["none", ""]
    return [one.verdict.replace("_", " "), *named, percent(seen.worst.share) if seen is not None else ""]


def _own(block: Block, name: str) -> Block:
    """The block with keys of its own: pictures of several inputs are in one page."""
    if not isinstance(block, Panels):
        return block
    own = folder_name(name)
    figures = [replace(figure, key=f"{figure.key}_{own}") for figure in block.figures]
    return replace(block, key=f"{block.key}_{own}", figures=figures)
