"""Modes from measured responses: tables with a time column, in CSV or Parquet files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from shaper_fmu.analysis.identification import Finding, Identification, IdentificationError, free_response, identify
from shaper_fmu.errors import nearest
from shaper_fmu.tune.measured_table import Table, read_table

_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0}
_UNIFORM = 1e-3
_GAP = 4.0


@dataclass(frozen=True)
class MeasuredIdentification:
    """What a measured response has shown.

    Attributes:
        identification: modes and other poles; time 0 is the first sample after the excitation.
        time: of the samples that were used [s], shape (n,), on the file's clock.
        response: shape (n, m), as it was fitted.
        outputs, units: names and units of the columns, "" where none is told.
        excitation_end: after which the response was taken to be free [s], on the file's clock.
        findings: what the user should know, of the table and of the identification.
    """

    identification: Identification
    time: np.ndarray
    response: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    excitation_end: float
    findings: tuple[Finding, ...]


def identify_measured(
    source: Path | str | Table,
    outputs: Sequence[str] | None = None,
    *,
    time: str | None = None,
    input: str | None = None,
    excitation_end: float | None = None,
    units: Mapping[str, str] | None = None,
    smallest_share: float = 1e-3,
) -> MeasuredIdentification:
    """Identify the modes in a measured response.

    Args:
        source: a CSV or Parquet file, or a `Table`.
        outputs: columns to look at; all but time and input if none are named.
        time: the time column; by default one called time or t, else the first.
        input: the column of the excitation: the response is free after its last change.
        excitation_end: when the response becomes free, on the file's clock, in s. Without this and `input` it is
            taken to be free from its largest deviation on, and a finding says so.
        units: of columns whose header tells none; a header may read "position [mm]". Time may be in s, ms, us or min.
        smallest_share: modes with less of the amplitude than this, in each column, are not told.

    Raises IdentificationError for tables that make no sense, and where the data do not support an answer.
    """
    table = source if isinstance(source, Table) else read_table(source)
    known = {**table.units, **(units or {})}
    clock = _column(table, time or next((n for n in table.names if n.casefold() in ("time", "t")), table.names[0]))
    if input is not None:
        _column(table, input)
    names = [_column(table, name) for name in outputs or [n for n in table.names if n not in (clock, input)]]
    if not names:
        raise IdentificationError("there is no column of a response beside the time")
    unit = known.get(clock, "").strip()
    if unit not in _SECONDS:
        raise IdentificationError(f"the time column {clock!r} is in {unit!r}; s, ms, us and min are understood")
    t = table[clock] * _SECONDS[unit]
    values = np.column_stack([table[name] for name in names])
    _check_times(t)
    findings: list[Finding] = []
    end = excitation_end
    if end is None:
        end, note = _excitation_end(t, values, table[input] if input else None)
        findings += [Finding("assumed_free", note)] if note else []
    free = t > end + 1e-9 * (t[-1] - t[0]) if input or excitation_end is not None else t >= end
    if np.count_nonzero(free) < 2:
        raise IdentificationError(f"nothing is left after the end of the excitation at {end:g} s; the table ends at {t[-1]:g} s")
    grid, uniform, note = _uniform(t[free], values[free])
    findings += [Finding("resampled", note)] if note else []
    step = float(grid[-1] - grid[0]) / (len(grid) - 1)
    found = identify(free_response(uniform, step, names), smallest_share=smallest_share)
    return MeasuredIdentification(
        found, grid, uniform, tuple(names), tuple(known.get(name, "") for name in names), float(end),
        (*findings, *found.findings),
    )  # fmt: skip


def _column(table: Table, name: str) -> str:
    if name not in table.names:
        raise IdentificationError(f"the table has no column {name!r}.{nearest(name, table.names)}")
    return name


def _check_times(t: np.ndarray) -> None:
    steps = np.diff(t)
    if len(t) < 3 or not (steps > 0.0).all():
        row = int(np.argmax(steps <= 0.0)) if len(t) > 1 else 0
        raise IdentificationError(f"time does not increase from row {row + 1} on ({t[row] if len(t) else 0.0:g} s)")


def _excitation_end(t: np.ndarray, values: np.ndarray, excitation: np.ndarray | None) -> tuple[float, str]:
    """When the response becomes free, and a note if that is a guess."""
    if excitation is not None:
        changes = np.flatnonzero(np.abs(np.diff(excitation)) > 1e-6 * max(1e-300, float(np.ptp(excitation))))
        return (float(t[changes[-1] + 1]) if len(changes) else float(t[0])), ""
    centred = values - np.median(values[len(values) // 2 :], axis=0)
    size = np.max(np.abs(centred) / np.maximum(1e-300, np.abs(centred).max(axis=0)), axis=1)
    end = float(t[int(np.argmax(size))])
    return end, f"the response is taken to be free from its largest deviation on, at {end:g} s; tell the end of the excitation"


def _uniform(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, str]:
    """The response at equal distances, and a note where it had to be interpolated. Raises IdentificationError for gaps."""
    steps = np.diff(t)
    usual = float(np.median(steps))
    if steps.max() > _GAP * usual:
        row = int(np.argmax(steps))
        raise IdentificationError(
            f"samples are missing: from {t[row]:g} s to {t[row + 1]:g} s there are none, otherwise every {usual:.3g} s; "
            "use the part before or after"
        )
    even = np.linspace(t[0], t[-1], len(t))
    if np.abs(t - even).max() <= _UNIFORM * usual or _is_rounded(t, even, usual):
        return even, values, ""
    grid = np.linspace(t[0], t[-1], max(2, round((t[-1] - t[0]) / usual) + 1))
    note = (
        f"samples are not at equal distances ({steps.min():.3g} s to {steps.max():.3g} s): they were interpolated by cubic "
        "splines, so that uncertainties are approximate"
    )
    return grid, CubicSpline(t, values)(grid), note


def _is_rounded(t: np.ndarray, even: np.ndarray, usual: float) -> bool:
    """Whether times lie on an even grid but for their last written digit, which is much less than a step."""
    return bool(np.abs(t - even).max() <= 0.02 * usual)
