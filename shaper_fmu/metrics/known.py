"""All metrics: those in this package's files, and those that entry points of `shaper_fmu.metrics` name."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Union

import msgspec

from shaper_fmu.errors import ComponentError
from shaper_fmu.methods.announced import announced, leave_out
from shaper_fmu.methods.discovery import modules_of
from shaper_fmu.metrics.metric import Metric

GROUP = "shaper_fmu.metrics"
_TAKEN = set(dir(Metric)) - set(Metric.fields())


def _metrics_of(module: ModuleType) -> list[type[Metric]]:
    found = [metric for metric in vars(module).values() if isinstance(metric, type) and issubclass(metric, Metric)]
    return [metric for metric in found if metric.values is not Metric.values]


def _add(found: dict[str, type[Metric]], metric: type[Metric], module: ModuleType) -> None:
    """Take a metric in. Raises ComponentError for a kind that is used twice or is no word, and for fields that hide what others
    ask, or that study files cannot have."""
    where, kind = f"{module.__name__}: the metric {metric.__name__}", metric.kind()
    if not kind.isidentifier():
        raise ComponentError(f"{where} is of the kind {kind!r}, which must be one word of letters, digits and underscores")
    taken = sorted(set(metric.fields()) & _TAKEN)
    if taken:
        raise ComponentError(f"{where} has a field {taken[0]!r}, which every metric has for something else; rename it")
    if found.get(kind, metric) is not metric:
        raise ComponentError(f"{where} is of the kind {kind!r}, as is {found[kind].__name__} in {found[kind].__module__}")
    try:
        msgspec.json.Decoder(metric)
    except (TypeError, NameError) as error:
        raise ComponentError(f"{where} cannot be read from a study file: {error}") from error
    found[kind] = metric


def _find() -> dict[str, type[Metric]]:
    """The metrics by kind, ours first; another package's that cannot be used is left out with a warning."""
    found: dict[str, type[Metric]] = {}
    for module in modules_of("shaper_fmu.metrics"):
        for metric in _metrics_of(module):
            _add(found, metric, module)
    for point, module, _ in announced(GROUP):
        metrics = _metrics_of(module)
        if not metrics:
            leave_out(point, f"there is no subclass of Metric with `values` in {module.__name__}")
        for metric in metrics:
            try:
                _add(found, metric, module)
            except ComponentError as error:
                leave_out(point, error)
    return found


METRICS = _find()
"""The classes by their kind in study files."""

if TYPE_CHECKING:
    AnyMetric = Metric
else:
    AnyMetric = Union[tuple(METRICS.values())]  # noqa: UP007
"""What a study's entry can be."""
