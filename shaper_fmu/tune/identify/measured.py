"""Modes from measured responses: tables with a time column, in CSV or Parquet files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shaper_fmu.analysis.identification import (
    Finding,
    FreeResponse,
    IdentificationError,
    free_response,
    identify,
)
from shaper_fmu.analysis.identification.beginning import Beginnings, cut, first_free
from shaper_fmu.analysis.identification.clipping import check_clipping
from shaper_fmu.analysis.identification.forced import identify_forced
from shaper_fmu.analysis.identification.record import FEWEST_SAMPLES, scaled
from shaper_fmu.analysis.identification.swept import Sweep, find_sweep
from shaper_fmu.errors import nearest
from shaper_fmu.tune.identify.measured_clock import time_column
from shaper_fmu.tune.identify.measured_grid import check_times, quantisation, uniform_samples
from shaper_fmu.tune.identify.measured_lines import without_lines
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.measured_sweep import of_sweep
from shaper_fmu.tune.identify.measured_table import Table, read_table

_CHANGES = 1e-6
"""Steps of an input above this share of its range are changes."""
_MOSTLY = 0.5
"""Of the steps, at most, that are changes where an input is a command and no measurement."""
_TAIL, _FEWEST = 20, 16
_DEVIATION, _ALIKE = 6.0, 0.3
_LEFT = 0.95
"""Share of the record up to which a sweep may last, so that what is behind it is looked at."""
_FREE = "the whole record is taken to be free: its modes are the same from its first sample on as from later beginnings"
_ASSUMED = (
    "it was not given when the response becomes free. It seems to be free from {:.4g} s on: its modes are the same from there as "
    "from later times, but modes that have decayed by then are not seen. Give the end of the excitation (excitation_end, "
    "--excitation-end), or its column (input, --input)"
)
_MOST_FOR_HINT = 6
"""Modes up to which a hint is looked for, at which time a response becomes free: with more it takes too long."""
_UNKNOWN = (
    "it is unknown when the response becomes free: there is no time from which on its modes stay the same. Give the end of the "
    "excitation (excitation_end, --excitation-end), or its column (input, --input)"
)


def identify_measured(
    source: Path | str | Table,
    outputs: Sequence[str] | None = None,
    *,
    time: str | None = None,
    input: str | None = None,
    command: str | None = None,
    excitation_end: float | None = None,
    units: Mapping[str, str] | None = None,
    time_unit: str | None = None,
    smallest_share: float = 1e-3,
) -> MeasuredIdentification:
    """Identify the modes in a measured response.

    Args:
        source: a CSV or Parquet file, or a `Table`.
        outputs: columns to look at; all but time and input if none are named.
        time: the time column; by default one whose name says so ("time", "t", "time_ms", "Time/ms"), else the first.
        input: the column of the excitation: the response is free after its last change.
        command: the column of the command that excites the response throughout, such as a swept sine: the modes are those from it
            to the outputs, and their amplitudes those after a unit step of it. In place of `input` and `excitation_end`.
        excitation_end: when the response becomes free, on the file's clock, in s. Without this and `input` it is found from the
            response by its modes (`first_free`), and a finding reports it; but if the motion sweeps, its frequency a straight line
            over time, the modes are those from that sweep to the outputs (without `outputs`, to the one that moves most).
        units: of columns whose header has none; a header may read "position [mm]". Time may be in s, ms, us,
            ns, min or h.
        time_unit: of the time column, whatever its header says.
        smallest_share: modes with less of the amplitude than this, in each column, are not listed.

    Raises IdentificationError for tables that make no sense, and where the data do not support an answer.
    """
    table = source if isinstance(source, Table) else read_table(source)
    known = {**table.units, **(units or {})}
    clock, t, assumed = time_column(table, time, known, time_unit)
    if input is not None and not np.isfinite(column := table[_column(table, input)]).all():
        row = int(np.flatnonzero(~np.isfinite(column))[0])
        raise IdentificationError(f"{input} is not a finite number at row {row + 1}: {column[row]:g}")
    names = [_column(table, name) for name in outputs or [n for n in table.names if n not in (clock, input, command)]]
    if not names:
        raise IdentificationError("there is no column of a response besides the time")
    values = np.column_stack([table[name] for name in names])
    check_times(t)
    findings: list[Finding] = [*table.notes, *assumed]
    if command is not None:
        if input is not None or excitation_end is not None:
            raise IdentificationError("a command's column tells the excitation: give neither input nor excitation_end beside it")
        labels = tuple(names), tuple(known.get(name, "") for name in names)
        return _of_command(t, values, table[_column(table, command)], labels, smallest_share, findings)
    start: int | None = 0
    looks: Beginnings | None = None
    first, note = _beginning(t, table[input] if input else None, excitation_end)
    findings += [Finding("input_constant", note)] if note else []
    grid, uniform, note = uniform_samples(t[first or 0 :], values[first or 0 :])
    findings += [Finding("resampled", note)] if note else []
    step = float(grid[-1] - grid[0]) / (len(grid) - 1)
    response = free_response(uniform, step, names, quantisation(values))
    sweep = find_sweep(response)
    units_of = tuple(known.get(name, "") for name in names)
    if sweep is not None and first is None:
        swept = of_sweep(response, sweep, (t, values), units_of, smallest_share, findings, named=outputs is not None)
        if swept is not None:
            return swept
    behind = _behind_sweep(sweep, response, grid, given=first is not None)
    if first is None:
        whole = cut(response, behind)
        looks = Beginnings(whole, smallest_share)
        start = first_free(whole, smallest_share, looks)
        if start is None:
            scaled([whole], 0.0)  # refuses what does not move at all
            raise IdentificationError(_UNKNOWN)
        start += behind
        grid, uniform, response = grid[start:], uniform[start:], cut(response, start)
        findings.append(Finding("assumed_free", _ASSUMED.format(grid[0])) if start else Finding("found_free", _FREE))
        end = float(grid[0])
    else:
        end = float(excitation_end if excitation_end is not None else t[first - 1])
    found, lines = without_lines(identify(response, smallest_share=smallest_share), _before(t, values, grid, response))
    findings += [*found.findings, *lines]
    if first is not None or not start:
        findings += _unconfirmed(response, looks or Beginnings(response, smallest_share), smallest_share, end)
    cut_out = (t, values) if grid[0] > t[0] + step else None
    return MeasuredIdentification(found, grid, uniform, tuple(names), units_of, end, tuple(findings), None, cut_out)


def _of_command(
    t: np.ndarray, values: np.ndarray, command: np.ndarray, labels: tuple[tuple[str, ...], tuple[str, ...]], smallest_share: float,
    findings: list[Finding],
) -> MeasuredIdentification:  # fmt: skip
    """The modes that a command excites."""
    grid, uniform, note = uniform_samples(t, np.column_stack([values, command]))
    findings += [Finding("resampled", note)] if note else []
    response = free_response(uniform[:, :-1], float(grid[-1] - grid[0]) / (len(grid) - 1), labels[0], quantisation(values))
    if not np.isfinite(uniform[:, -1]).all():
        raise IdentificationError("the command's column has values that are not finite numbers")
    check_clipping(response)
    found = identify_forced(response, uniform[:, -1], smallest_share)
    times = grid[0] + found.identification.step * np.arange(len(found.response.values))
    findings += found.identification.findings
    return MeasuredIdentification(
        found.identification, times, found.response.values, *labels, float(grid[0]), tuple(findings), found
    )  # fmt: skip


def _before(t: np.ndarray, values: np.ndarray, grid: np.ndarray, response: FreeResponse) -> FreeResponse | None:
    """The response up to the first sample of the free one, at the same distances; None if there is too little of it."""
    times = np.arange(grid[0] - response.step, t[0] - 1e-9 * response.step, -response.step)[::-1]
    if len(times) < FEWEST_SAMPLES or t[0] > times[0] + 1e-6 * response.step:
        times = times[1:]
    if len(times) < FEWEST_SAMPLES:
        return None
    known = t < grid[0] + response.step
    return replace(response, values=np.column_stack([np.interp(times, t[known], column[known]) for column in values.T]))


def _behind_sweep(found: Sweep | None, response: FreeResponse, grid: np.ndarray, *, given: bool) -> int:
    """The sample behind a swept motion, 0 without one. Raises IdentificationError where that should be free, or nothing is left."""
    if found is None:
        return 0
    first = round(found.end / response.step)
    if given or first > _LEFT * len(response.values):
        raise IdentificationError(
            f"this is no free response: from {grid[0] + found.begin:.4g} to {grid[0] + found.end:.4g} s the motion sweeps from "
            f"{found.first:.3g} to {found.last:.3g} Hz, as a swept excitation drives it. Give the column of the command (command, "
            "--command), or the part after the excitation (excitation_end, --excitation-end)"
        )
    return first


def _column(table: Table, name: str) -> str:
    if name not in table.names:
        raise IdentificationError(f"the table has no column {name!r}.{nearest(name, table.names)}")
    return name


def _beginning(t: np.ndarray, excitation: np.ndarray | None, given: float | None) -> tuple[int | None, str]:
    """The first row of the free response; None, with the reason, if neither the input nor the user determines it."""
    if given is not None:
        if not np.isfinite(given):
            raise IdentificationError(f"the end of the excitation, {given:g} s, is not a finite number")
        first = int(np.count_nonzero(t <= given + 1e-9 * (t[-1] - t[0])))
    elif excitation is not None:
        last = last_change(excitation)
        if last is None:
            return None, "the column of the excitation does not change, so it does not show when the response becomes free"
        first = last + 1
    else:
        return None, ""
    if len(t) - first < 2:
        end = given if given is not None else t[min(first, len(t)) - 1]
        raise IdentificationError(f"nothing is left after the end of the excitation at {end:g} s; the table ends at {t[-1]:g} s")
    return first, ""


def last_change(excitation: np.ndarray) -> int | None:
    """The row in which an input has changed last; None if it never does.

    From there on it is constant, but for white noise. Raises IdentificationError for one that never comes to rest.
    """
    spread = float(np.ptp(excitation))
    steps = np.abs(np.diff(excitation))
    if spread == 0.0:
        return None
    if np.count_nonzero(steps > _CHANGES * spread) <= _MOSTLY * len(steps):  # a command, as it was computed
        return int(np.flatnonzero(steps > _CHANGES * spread)[-1]) + 1
    tail = excitation[-max(_FEWEST, len(excitation) // _TAIL) :]
    noise = float(np.std(tail))
    off = np.abs(excitation - tail.mean()) > _DEVIATION * noise
    first = int(np.flatnonzero(off)[-1]) + 1 if off.any() else 0
    rest = excitation[first:] - excitation[first:].mean()
    alike = float(rest[1:] @ rest[:-1] / max(1e-300, float(rest @ rest)))
    if len(rest) < _FEWEST or alike > _ALIKE + 4.0 / math.sqrt(len(rest)):
        raise IdentificationError(
            "the column of the excitation does not come to rest: it is noisy or follows the response; give the time at which the "
            "response becomes free (excitation_end, --excitation-end), or, if it excites throughout, the column as the command "
            "(command, --command)"
        )
    return first if first else None


def _unconfirmed(response: FreeResponse, looks: Beginnings, smallest_share: float, end: float) -> list[Finding]:
    """A finding if later beginnings contradict a mode: then the response is not free yet, or its modes change."""
    mode = looks.contradicted(0)
    if mode is None:
        return []
    seen = looks.seen(0)
    few = seen is not None and len(seen.modes) <= _MOST_FOR_HINT
    later = first_free(response, smallest_share, looks) if few else None
    hint = f"; it seems to be free from {end + later * response.step:.4g} s on" if later else ""
    text = (
        f"the mode at {mode.natural_frequency:.4g} rad/s is not the same, or hardly known, where one begins later: the response is "
        f"not free after {end:g} s, or its modes change as it decays{hint}"
    )
    return [Finding("not_free", text)]
