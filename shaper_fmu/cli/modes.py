"""The option --modes of `shaper-fmu design`: selects the modes to shape."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from shaper_fmu.cli.arguments import PICTURE, wrong_usage
from shaper_fmu.cli.paths import wrote
from shaper_fmu.console import out, show
from shaper_fmu.page.blocks import Table, Text

if TYPE_CHECKING:
    from shaper_fmu.page.blocks import Block


def design_for_modes(path: Path, kinds: list[str], tolerance: float, settling: bool, plot: Path | None, **options: Any) -> None:
    """Read the modes, choose, print the tables and the reason; exit code 1 if no set is good enough."""
    from shaper_fmu.design.mode_file import read_modes
    from shaper_fmu.design.mode_selection import distinct_kinds, select_modes
    from shaper_fmu.design.shapers import shaper
    from shaper_fmu.report.modes import mode_blocks

    with wrong_usage("KIND"):
        for kind in distinct_kinds(kinds):
            shaper(kind, 1.0, 0.0, **options)
    response = read_modes(path)
    selection = select_modes(response, kinds, tolerance, objective="settling" if settling else "duration", **options)
    blocks = mode_blocks(response, selection, kinds[0], **options)
    for block in blocks:
        if isinstance(block, Table):
            show(block)
        elif isinstance(block, Text):
            out.print(block.text)
    if plot:
        write_plot(plot, f"Modes to shape: {path.name}", blocks)
    if not selection.feasible:
        raise typer.Exit(1)


def write_plot(path: Path, title: str, blocks: list[Block]) -> None:
    """Write a page with its pictures, or all figures into one picture, by the path's ending; print which files."""
    from shaper_fmu.page.blocks import write_report
    from shaper_fmu.page.figures import Figure

    if path.suffix.lower() in PICTURE:
        from shaper_fmu.page.pictures import write_pictures

        files = [write_pictures([block for block in blocks if isinstance(block, Figure)], path)]
    else:
        files = write_report(path, title, blocks)
    for written in files:
        wrote(written)
