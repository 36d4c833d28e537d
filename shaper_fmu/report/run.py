"""The report of runs: the system's drawing, commands over what they shape, and time responses with one figure per unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from shaper_fmu.drawing.diagram import MOST_DRAWN
from shaper_fmu.drawing.svg import svg_of
from shaper_fmu.master.diagram import diagram_of
from shaper_fmu.master.results import Results
from shaper_fmu.master.time_figures import number_text, time_figures
from shaper_fmu.page.blocks import Block, Drawing, Table
from shaper_fmu.page.figures import UNSHAPED_AND_SHAPED, Figure, Line, label

if TYPE_CHECKING:
    from shaper_fmu.master.structure import SystemStructure

_SHAPED = (("command", "shaped"), ("reference", "pulse"))
"""Input and output of the components that make a command of another: shapers, and the pulse width modulator."""


def run_blocks(results: Results | Mapping[str, Results], system: SystemStructure | None = None) -> list[Block]:
    """Blocks of the page of one run, or of several over each other by their names; constant variables are only in the table.

    With the `system` that was run it is drawn, and shaped commands are drawn over what they shape.
    """
    runs = {"": results} if isinstance(results, Results) else dict(results)
    blocks: list[Block] = system_drawing(system) if system is not None else []
    commands = command_figures(runs, system) if system is not None else []
    figures = [figure for found in time_figures(runs) for figure in _by_kind(found)]
    tables = [_table(name, run) for name, run in runs.items()]
    return [*blocks, *commands, *figures, *tables]


def system_drawing(system: SystemStructure) -> list[Block]:
    """A system with its connections, if it is not too large to be looked at."""
    if not 0 < len(system.fmus) <= MOST_DRAWN:
        return []
    return [Drawing("The system", svg_of(diagram_of(system)))]


def command_figures(runs: Mapping[str, Results], system: SystemStructure) -> list[Figure]:
    """For each shaper what it gets, in its own measure, and what it makes of that; for all runs that have recorded both."""
    figures = []
    for target, source in system.connections.items():
        for given, made in _SHAPED:
            shaped = f"{target[0]}.{made}"
            lines = _lines(runs, system, target, ".".join(source), shaped) if target[1] == given else []
            if lines:
                unit = system.unit(source) if target not in system.scalings else ""
                title = f"{shaped} over {'.'.join(source)}"
                figures.append(Figure(f"command_{len(figures) + 1}", title, "time [s]", label("command", unit), lines))
    return figures


def _lines(runs: Mapping[str, Results], system: SystemStructure, target: tuple[str, str], source: str, shaped: str) -> list[Line]:
    gain, offset = system.scalings.get(target, (1.0, 0.0))
    added = f" + {offset:g}" if offset else ""
    scaled = f"{source} (* {gain:g}{added})" if (gain, offset) != (1.0, 0.0) else source
    lines = []
    for k, (name, run) in enumerate(runs.items()):
        if source in run.values and shaped in run.values:
            own = f", {name}" if name else ""
            columns = np.asarray(gain * run.values[source] + offset), np.asarray(run.values[shaped])
            lines += [
                Line(f"{text}{own}", run.time, column, style=2 * k + style)
                for text, column, style in zip((scaled, shaped), columns, UNSHAPED_AND_SHAPED, strict=True)
            ]
    return lines


def _by_kind(figure: Figure) -> list[Figure]:
    """Values that are 0 or 1 have a figure of their own: beside numbers nobody reads them."""
    if figure.y_label:
        return [figure]
    switches = [line for line in figure.lines if np.isin(line.y, (0.0, 1.0)).all()]
    numbers = [line for line in figure.lines if not any(line is one for one in switches)]
    found = [Figure(figure.key, figure.title, figure.x_label, "number", numbers)] if numbers else []
    return [*found, Figure("response_switches", "On (1) and off (0)", figure.x_label, "on", switches)] if switches else found


def _table(name: str, results: Results) -> Table:
    rows = []
    for variable in results.values:
        column, unit = results.display(variable)
        rows.append([variable, *(number_text(value) for value in (column[0], column[-1], column.min(), column.max())), unit])
    title = f"Recorded variables{f', {name}' if name else ''}"
    return Table(title, ["variable", "first", "last", "least", "greatest", "unit"], rows)
