"""Robustness curves of a sweep over each varied value, and the insensitivity read from them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.sweep.data import Axis, SweepData
from shaper_fmu.report.sweep.levels import Judged, judged
from shaper_fmu.sweep.refine import tolerated_band

MOST_POINTS = 2000
"""Points that a curve is drawn with."""


@dataclass(frozen=True)
class Insensitivity:
    """The tolerated band around the nominal value.

    Attributes:
        low, high: its ends, in the start value's own unit.
        open_low, open_high: whether the metric is within the level up to that end of the varied range, so that the band may
            be wider.
        spacing: largest distance of the two runs between which an end was read.
    """

    low: float
    high: float
    open_low: bool
    open_high: bool
    spacing: float


def nominal_slice(data: SweepData, case: str, number: int) -> np.ndarray:
    """Indices of a case's completed runs in which all other start values are nominal, by rising value; refined points, too.

    In a plan of the kind zip the others go along.
    """
    chosen = data.of(case)
    for i, axis in enumerate(data.axes):
        if i != number and data.study.plan.kind != "zip":
            chosen &= data.points[:, i] == axis.nominal
    found = np.flatnonzero(chosen)
    return found[np.argsort(data.points[found, number], kind="stable")]


def insensitivity(data: SweepData, metric: Judged, case: str, number: int) -> Insensitivity | None:
    """The tolerated band by straight lines between neighbours; None if the metric is beyond the level at the nominal value."""
    indices = nominal_slice(data, case, number)
    indices = indices[~np.isnan(metric.values[indices])]
    x, y = data.points[indices, number], metric.values[indices]
    band = tolerated_band(list(zip(x.tolist(), y.tolist(), strict=True)), metric.level, data.axes[number].nominal)
    if band is None:
        return None
    low, high = band
    ends = [end == x[at] and y[at] <= metric.level for end, at in ((low, 0), (high, -1))]
    steps = np.diff(x)
    left = 0.0 if ends[0] else steps[max(0, np.searchsorted(x, low, "left") - 1)]
    right = 0.0 if ends[1] else steps[min(len(steps), np.searchsorted(x, high, "right")) - 1]
    return Insensitivity(low, high, ends[0], ends[1], float(max(left, right)))


def robustness_table(data: SweepData, metric: str, number: int) -> Table:
    """A metric of all cases at the lowest, the nominal and the highest value (all of a list of texts), and as shares of the
    reference."""
    axis, quantity, relative = data.axes[number], data.quantities[metric], data.relative(metric)
    columns = list(axis.grid) if axis.texts else list(dict.fromkeys([axis.grid[0], axis.nominal, axis.grid[-1]]))
    rows = []
    for case in data.cases:
        indices = nominal_slice(data, case, number)
        places = dict(zip(data.points[indices, number].tolist(), indices.tolist(), strict=True))
        cells = []
        for value in columns:
            i = places.get(value)
            text = "no result" if i is None else quantity.shown(float(data.metrics[metric][i]))
            if i is not None and case != data.study.reference and not np.isnan(relative[i]):
                text += f" ({100.0 * relative[i]:.3g} %)"
            cells.append(text)
        rows.append([case, *cells])
    head = [f"{axis.shown(value)} ({axis.deviation(value)})".replace(" ()", "") for value in columns]
    share = f" (share of {data.study.reference})" if data.study.reference else ""
    return Table(f"{_capital(quantity.description)} over {axis.name}{share}", ["case", *head], rows)


def insensitivity_table(data: SweepData, metric: str, number: int) -> Table | Text:
    """The tolerated bands of all judged cases, and their widths relative to the nominal value; a sentence if none has one."""
    axis, judgement, rows, some = data.axes[number], judged(data, metric), [], False
    text = data.quantities[metric].description
    for case in judgement.cases:
        band = insensitivity(data, judgement, case, number)
        some |= band is not None
        rows.append([case, *(_band_cells(axis, band) if band else [_no_band(data, judgement, case, number), "", "0", "-"])])
    if not some:
        return Text(f"Insensitivity: with the nominal values, {text} is within {judgement.description} in none of the cases.")
    title = f"Insensitivity: {text} up to {judgement.description}, over {axis.name}"
    width = "relative width" if axis.nominal else f"width {axis.unit}".rstrip()
    return Table(title, ["case", "from", "to", width, "read between runs apart"], rows)


def _no_band(data: SweepData, metric: Judged, case: str, number: int) -> str:
    indices = nominal_slice(data, case, number)
    there = indices[data.points[indices, number] == data.axes[number].nominal]
    if not len(there) or np.isnan(metric.values[there[0]]):
        return "none: no result with the nominal value"
    value, level = metric.shown(float(metric.values[there[0]])), metric.shown(metric.level)
    return f"none: {value} with the nominal value" if value != level else "none: just beyond with the nominal value"


def _band_cells(axis: Axis, band: Insensitivity) -> list[str]:
    ends = [
        ("beyond " if open_ else "") + f"{axis.shown(end)} ({axis.deviation(end)})"
        for end, open_ in ((band.low, band.open_low), (band.high, band.open_high))
    ]
    width = (band.high - band.low) / abs(axis.nominal) if axis.nominal else (band.high - band.low) * axis.factor
    least = "at least " if band.open_low or band.open_high else ""
    return [*ends, f"{least}{width:.4f}", axis.shown(band.spacing) if band.spacing else "-"]


def robustness_figures(data: SweepData, metric: str, number: int) -> list[Figure]:
    """The metric over the varied value: absolute, and relative to the reference if there is one, with the level."""
    axis, quantity, judgement = data.axes[number], data.quantities[metric], judged(data, metric)
    marks = [(axis.nominal * axis.factor, "nominal")]
    key, along = f"robustness_{metric}_{slug(axis.name)}", " and the others with it" if data.study.plan.kind == "zip" else ""
    common = {"log_x": axis.logarithmic, "marks": marks}

    def lines(values: np.ndarray, factor: float, cases: list[str]) -> list[Line]:
        return list(_lines(data, values * factor, cases, number))

    title = f"Robustness: {quantity.description} over {axis.name}{along}"
    absolute = [] if data.study.reference else [(judgement.level * judgement.factor, judgement.description)]
    curves = lines(data.metrics[metric], quantity.factor, data.cases)
    figures = [Figure(key, title, axis.label(), quantity.label(), curves, absolute, **common)]
    if data.study.reference:
        level = [(judgement.level * judgement.factor, judgement.description)]
        curves = lines(judgement.values, judgement.factor, judgement.cases)
        title = f"Robustness: {quantity.description} relative to {data.study.reference}"
        figures.append(Figure(f"{key}_relative", title, axis.label(), judgement.label, curves, level, **common))
    return [figure for figure in figures if figure.lines]


def _lines(data: SweepData, values: np.ndarray, cases: list[str], number: int) -> Iterator[Line]:
    factor = data.axes[number].factor
    for case in cases:
        indices = nominal_slice(data, case, number)
        y = np.where(np.isfinite(values[indices]), values[indices], np.nan)
        x, y = thinned(data.points[indices, number] * factor, y)
        if not np.isnan(y).all():
            yield Line(case, x, y, markers=len(x) <= 100, style=data.cases.index(case))


def thinned(x: np.ndarray, y: np.ndarray, most: int = MOST_POINTS) -> tuple[np.ndarray, np.ndarray]:
    """At most so many points of a curve, shapes (m,): of each stretch the least and the greatest value."""
    if len(x) <= most:
        return x, y
    kept = {0, len(x) - 1}
    for stretch in np.array_split(np.arange(len(x)), most // 2 - 1):
        inside = stretch[~np.isnan(y[stretch])]
        if len(inside):
            kept |= {int(inside[np.argmin(y[inside])]), int(inside[np.argmax(y[inside])])}
    order = sorted(kept)
    return x[order], y[order]


def curve_blocks(data: SweepData) -> list[Block]:
    """Tables and figures of every metric over every varied value; none for sampled plans."""
    if data.sampled or not data.done.any():
        return []
    blocks: list[Block] = []
    if len(data.axes) > 1 and data.study.plan.kind == "grid":
        nominal = ", ".join(f"{axis.name} = {axis.shown(axis.nominal)}" for axis in data.axes)
        blocks.append(Text(f"Along each varied value, the others have their nominal values: {nominal}."))
    for metric in data.quantities:
        for number, axis in enumerate(data.axes):
            blocks.append(robustness_table(data, metric, number))
            if not axis.texts and len(axis.grid) > 1:
                blocks += robustness_figures(data, metric, number)
                if data.study.plan.kind == "grid":
                    blocks.append(insensitivity_table(data, metric, number))
    return blocks


def slug(name: str) -> str:
    """A name as part of a file's name."""
    return re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:60] or "x"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
