"""All metrics: those in this package's files, and those that entry points of `shaper_fmu.metrics` name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Union

from shaper_fmu.errors import ComponentError
from shaper_fmu.methods.discovery import announced_modules, modules_of
from shaper_fmu.metrics.metric import Metric

GROUP = "shaper_fmu.metrics"
_TAKEN = set(dir(Metric)) - set(Metric.fields())


def _find() -> dict[str, type[Metric]]:
    """The metrics by kind, ours first.

    Raises ComponentError for a kind that is used twice or is no word, and for fields that hide what others ask.
    """
    found: dict[str, type[Metric]] = {}
    for module in (*modules_of("shaper_fmu.metrics"), *announced_modules(GROUP)):
        for metric in vars(module).values():
            if not isinstance(metric, type) or not issubclass(metric, Metric) or metric.values is Metric.values:
                continue
            where, kind = f"{module.__name__}: the metric {metric.__name__}", metric.kind()
            if not kind.isidentifier():
                raise ComponentError(f"{where} is of the kind {kind!r}, which must be one word of letters, digits and underscores")
            taken = sorted(set(metric.fields()) & _TAKEN)
            if taken:
                raise ComponentError(f"{where} has a field {taken[0]!r}, which every metric has for something else; rename it")
            if found.setdefault(kind, metric) is not metric:
                raise ComponentError(f"{where} is of the kind {kind!r}, as is {found[kind].__name__} in {found[kind].__module__}")
    return found


METRICS = _find()
"""The classes by their kind in study files."""

if TYPE_CHECKING:
    AnyMetric = Metric
else:
    AnyMetric = Union[tuple(METRICS.values())]  # noqa: UP007
"""What a study's entry can be."""
