"""Metrics in the loop: their rows, checks before a run, and values at its end."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from shaper_fmu.errors import ModelError
from shaper_fmu.metrics.metric import ENVELOPE, GATHERED, OUTSIDE, Metric


def metric_rows(metrics: Mapping[str, Metric], place: Callable[[str], int]) -> np.ndarray:
    """The loop's row for each metric, shape (n,), of type `GATHERED`; `place` gives a variable's place on the bus."""
    rows = np.zeros(len(metrics), GATHERED)
    for row, metric in zip(rows, metrics.values(), strict=True):
        needs = metric.needs()
        found = [place(name) if name else -1 for name in (needs.output, needs.command, needs.rate)]
        row["kind"], row["parameter"], row["rest"] = needs.kind, needs.parameter, needs.rest
        row["place"], row["command"], row["rate"] = found
    return rows


def check_metrics(metrics: Mapping[str, Metric]) -> None:
    """Raise ModelError for an object that is not a metric, or for an invalid parameter."""
    for name, metric in metrics.items():
        if not isinstance(metric, Metric):
            raise ModelError([f"metric {name!r} is {metric!r}; use {_known()}"])
        needs = metric.needs()
        positive = needs.kind in (ENVELOPE, OUTSIDE)
        if not math.isfinite(needs.parameter) or (positive and not needs.parameter > 0.0):
            raise ModelError([f"metric {name!r}: {needs.parameter} must be a positive number"])
        if not math.isfinite(needs.rest):
            raise ModelError([f"metric {name!r}: {needs.rest} must be a finite number"])


def _known() -> str:
    from shaper_fmu.metrics.known import METRICS  # loads other packages' modules, which nobody else here needs

    *names, last = [metric.__name__ for metric in METRICS.values()]
    return f"{', '.join(names)} or {last}"


def metric_variables(metrics: Mapping[str, Metric]) -> list[str]:
    """All variables that the metrics need, each once."""
    return list(dict.fromkeys(name for metric in metrics.values() for name in metric.needs().variables))


def metric_values(metrics: Mapping[str, Metric], gathered: np.ndarray) -> dict[str, float]:
    """The values at the end of a run."""
    return {name: float(metric.values(gathered[i : i + 1])[0]) for i, (name, metric) in enumerate(metrics.items())}
