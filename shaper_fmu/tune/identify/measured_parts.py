"""Identifies each ring-down of a recording with several of them, such as a stage that is hit three times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.analysis.identification import Finding, IdentificationError, free_response
from shaper_fmu.analysis.identification.ring_downs import ring_downs
from shaper_fmu.analysis.identification.swept import find_sweep
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_clock import time_column
from shaper_fmu.tune.identify.measured_grid import check_times, quantisation, uniform_samples
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.measured_table import Table, read_table

_TELLS_THE_BEGINNING = ("input", "command", "excitation_end")


def identify_ring_downs(
    source: Path | str | Table, outputs: Sequence[str] | None = None, **options: Any
) -> list[MeasuredIdentification]:
    """Identify the modes in each ring-down of a measured response; in the response as a whole, if it has only one.

    Args:
        source, outputs, options: of `identify_measured`. With one that tells when the response becomes free, the part from there on
            is the only one.

    The finding `ring_downs` of the first one tells the parts, with those that were left out and why. Raises as `identify_measured`.
    """
    table = source if isinstance(source, Table) else read_table(source)
    parts = [] if any(options.get(name) is not None for name in _TELLS_THE_BEGINNING) else _parts(table, outputs, options)
    found, left_out = [], []
    for begin, end, part in parts:
        try:
            found.append(identify_measured(part, outputs, **options))
        except IdentificationError as error:
            left_out.append(f"from {begin:.4g} to {end:.4g} s: {error}")
    if len(found) < 2:
        return [identify_measured(table, outputs, **options)]
    spans = tuple(one.span for one in found)
    told = "; ".join(f"{begin:.4g} to {end:.4g} s" for begin, end in spans)
    text = (
        f"{len(found)} ring-downs were cut out of the recording, where its motion grows at once: {told}. Each was identified, and "
        "the ranges are over all. If these are none, give the time from which it is free (excitation_end, --excitation-end)"
    )
    text += f". Left out: {'; '.join(left_out)}" if left_out else ""
    known = {**table.units, **(options.get("units") or {})}
    _, t, _ = time_column(table, options.get("time"), known, options.get("time_unit"))
    whole = t, np.column_stack([table[name] for name in found[0].outputs])
    first = replace(found[0], findings=(*table.notes, Finding("ring_downs", text), *found[0].findings), parts=spans)
    return [replace(one, recording=whole) for one in (first, *found[1:])]


def _parts(table: Table, outputs: Sequence[str] | None, options: dict[str, Any]) -> list[tuple[float, float, Table]]:
    """The ring-downs as tables, with begin and end [s]; [] where there are not several, or the table has another fault."""
    try:
        known = {**table.units, **(options.get("units") or {})}
        clock, t, _ = time_column(table, options.get("time"), known, options.get("time_unit"))
        names = list(outputs or [name for name in table.names if name != clock])
        values = np.column_stack([table[name] for name in names])
        check_times(t)
        grid, uniform, _ = uniform_samples(t, values)
        response = free_response(uniform, float(grid[-1] - grid[0]) / (len(grid) - 1), names, quantisation(values))
    except (IdentificationError, ValueError):
        return []  # which `identify_measured` tells
    if not np.isfinite(uniform).all() or find_sweep(response) is not None:
        return []
    found = []
    for one in ring_downs(response):
        begin, end = float(grid[one.first]), float(grid[min(one.last, len(grid)) - 1])
        rows = (t >= begin) & (t <= end)
        columns = {name: column[rows] for name, column in table.columns.items()}
        found.append((begin, end, Table(columns, table.units)))
    return found
