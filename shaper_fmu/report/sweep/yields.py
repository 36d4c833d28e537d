"""Sampled sweeps: distributions, yield, and the sensitivity of a metric to each varied value."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.sweep.curves import slug
from shaper_fmu.report.sweep.data import SweepData
from shaper_fmu.report.sweep.levels import Judged, judged

PERCENTILES = (5.0, 50.0, 95.0, 99.0)
_BINS = 50
_MOST_STEPS = 800
_MOST_DOTS = 2000


@dataclass(frozen=True)
class Yield:
    """How many of `total` runs are within the level, with the 95 % interval of the share by Clopper and Pearson (1934)."""

    within: int
    total: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """Of the runs that are within the level."""
        return self.within / self.total

    def description(self, level: str) -> str:
        """For example "99.2 % below 5 % of the reference, 95 % interval 98.9 .. 99.4 %"."""
        digits = max(1, math.ceil(math.log10(self.total)) - 2)  # one run is seen
        low, high = (f"{100.0 * value:.{digits}f}" for value in (self.low, self.high))
        return f"{100.0 * self.share:.{digits}f} % below {level}, 95 % interval {low} .. {high} %"


def yield_of(data: SweepData, metric: Judged, case: str) -> Yield | None:
    """The yield of a case: a run of it that failed is not within the level; points without a reference do not count."""
    own = data.case == data.cases.index(case)
    known = own & ~np.isnan(metric.values)
    total = int(known.sum()) + int((own & ~data.done).sum())
    if total == 0:
        return None
    from scipy import stats  # takes a while: only where it is needed

    within = int((metric.values[known] <= metric.level).sum())
    interval = stats.binomtest(within, total).proportion_ci(0.95, method="exact")
    return Yield(within, total, float(interval.low), float(interval.high))


def values_of(data: SweepData, metric: Judged, case: str) -> np.ndarray:
    """The values of a case's completed runs that have a reference; shape (n,), rising."""
    values = metric.values[data.of(case)]
    return np.sort(values[~np.isnan(values)])


def yield_table(data: SweepData, metric: str) -> Table:
    """Runs, yield and percentiles of each judged case."""
    judgement, rows = judged(data, metric), []
    for case in judgement.cases:
        values, found = values_of(data, judgement, case), yield_of(data, judgement, case)
        failed = int(((data.case == data.cases.index(case)) & ~data.done).sum())
        if found is None or not len(values):
            rows.append([case, "0", str(failed), *["-"] * (2 + len(PERCENTILES))])
            continue
        shown = [judgement.shown(float(np.percentile(values, share, method="inverted_cdf"))) for share in PERCENTILES]
        rows.append(
            [
                case,
                str(len(values)),
                str(failed),
                found.description(judgement.description),
                *shown,
                judgement.shown(float(values[-1])),
            ]
        )
    head = ["case", "runs", "failed", "yield", *(f"{share:g} % quantile" for share in PERCENTILES), "largest"]
    title = f"{data.quantities[metric].description}: yield and percentiles"
    relative = f" (relative to {data.study.reference})" if data.study.reference else ""
    return Table(f"{title[:1].upper()}{title[1:]}{relative}", head, rows)


def distribution_figures(data: SweepData, metric: str) -> list[Figure]:
    """Histogram, as outlines, and the empirical distribution function of all judged cases."""
    judgement, text = judged(data, metric), data.quantities[metric].description
    found = {case: values_of(data, judgement, case) * judgement.factor for case in judgement.cases}
    found = {case: values[np.isfinite(values)] for case, values in found.items()}
    found = {case: values for case, values in found.items() if len(values)}
    if not found:
        return []
    low = min(0.0, *(float(values[0]) for values in found.values()))
    high = max(float(values[-1]) for values in found.values())
    edges = np.linspace(low, high if high > low else low + 1.0, _BINS + 1)
    bins, steps = [], []
    for case, values in found.items():
        shares = np.histogram(values, edges)[0] / len(values) * 100.0
        style = data.cases.index(case)
        bins.append(Line(case, np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(shares, 2), [0.0]]), style=style))
        at = np.unique(np.linspace(0, len(values) - 1, _MOST_STEPS).round().astype(int))
        x, y = values[at], (at + 1.0) / len(values) * 100.0
        steps.append(Line(case, np.repeat(x, 2), np.concatenate([[0.0], np.repeat(y, 2)[:-1]]), style=style))
    marks = [(judgement.level * judgement.factor, judgement.description)]
    return [
        Figure(
            f"histogram_{metric}", f"Distribution: {text}", judgement.label, f"share of the runs [%], {_BINS} bins", bins,
            marks=marks,
        ),
        Figure(
            f"distribution_{metric}", f"Cumulative distribution: {text}", judgement.label, "share of the runs up to it [%]", steps,
            marks=marks,
        ),
    ]  # fmt: skip


def rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    """Spearman's rank correlation of two arrays of shape (n,); NaN where one is constant, or for less than 3 values."""
    if len(x) < 3 or np.all(x == x[0]) or np.all(y == y[0]):
        return float("nan")
    from scipy import stats

    return float(np.corrcoef(stats.rankdata(x), stats.rankdata(y))[0, 1])


def ranking_table(data: SweepData, metric: str) -> Table:
    """Which varied value each case depends on, the strongest first: rank correlations of the metric with the value, and with its
    distance from the nominal one."""
    judgement, rows = judged(data, metric), []
    for case in judgement.cases:
        chosen = data.of(case) & ~np.isnan(judgement.values)
        found = []
        for i, axis in enumerate(data.axes):
            x, y = data.points[chosen, i], judgement.values[chosen]
            found.append((axis.name, rank_correlation(x, y), rank_correlation(np.abs(x - axis.nominal), y)))
        found.sort(key=lambda one: -np.nanmax([0.0, abs(one[1]), abs(one[2])]))
        rows += [[case if k == 0 else "", str(k + 1), name, _signed(a), _signed(b)] for k, (name, a, b) in enumerate(found)]
    title = f"Sensitivity ranking: {data.quantities[metric].description}"
    return Table(title, ["case", "rank", "varied value", "rank correlation with it", "with its distance from nominal"], rows)


def _signed(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:+.3f}"


def scatter_figures(data: SweepData, metric: str) -> list[Figure]:
    """The metric over each varied value, some of the runs as dots."""
    judgement, text = judged(data, metric), data.quantities[metric].description
    most = max(50, _MOST_DOTS // max(1, len(judgement.cases)))
    figures = []
    for i, axis in enumerate(data.axes):
        lines = []
        for case in judgement.cases:
            chosen = np.flatnonzero(data.of(case) & np.isfinite(judgement.values))
            if len(chosen) > most:
                chosen = np.sort(np.random.default_rng(0).choice(chosen, most, replace=False))
            x, y = data.points[chosen, i] * axis.factor, judgement.values[chosen] * judgement.factor
            lines.append(Line(case, x, y, style=data.cases.index(case), joined=False))
        levels = [(judgement.level * judgement.factor, judgement.description)]
        marks = [(axis.nominal * axis.factor, "nominal")]
        key, title = f"scatter_{metric}_{slug(axis.name)}", f"{text[:1].upper()}{text[1:]} over {axis.name}"
        figures.append(Figure(key, title, axis.label(), judgement.label, lines, levels, marks))
    return figures


def yield_blocks(data: SweepData) -> list[Block]:
    """Distribution, yield and ranking of every metric of a sampled plan."""
    if not data.sampled or not len(data.ids):
        return []
    plan = data.study.plan
    blocks: list[Block] = [
        Text(
            f"{plan.samples} points for each case, {plan.kind.replace('_', ' ')}, seed {plan.seed}. A run that failed counts as "
            "not within the level. Intervals are those of independent points (Clopper and Pearson)"
            + ("." if plan.kind == "random" else ", which is cautious for this plan, whose points are spread more evenly.")
        )
    ]
    for metric in data.quantities:
        blocks += [yield_table(data, metric), *distribution_figures(data, metric)]
        blocks += [ranking_table(data, metric), *scatter_figures(data, metric)]
    return blocks
