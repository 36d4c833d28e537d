"""Experiments at several operating points, in this process or in workers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from shaper_fmu.analysis.identification import Finding, IdentificationError
from shaper_fmu.errors import SimulationError
from shaper_fmu.tune.identify.experiment import PlantIdentification, experiment
from shaper_fmu.tune.meter import BudgetError
from shaper_fmu.tune.plant import Plant
from shaper_fmu.tune.workers.logged import Done

_FEWEST = 2
"""Points that are worth the start of a process."""


def experiments(
    plant: Plant, points: Sequence[Mapping[str, Any]], factors: Sequence[float], options: Mapping[str, Any]
) -> tuple[list[PlantIdentification], list[Finding]]:
    """The experiments at each point, with their further amplitudes (see `identify_plant`), and what has failed.

    The first one is done in this process, since the others begin with what it has shown.
    """
    found, failed = _at(plant, points[0], None, factors, options)
    nominal, others = found[0], points[1:]
    if plant.workers is None or len(others) < _FEWEST:
        made = ((point, None) for point in others)
    else:
        before = plant.meter.whole.steps
        calls = [(point, nominal, factors, options) for point in others]
        made = zip(others, plant.workers.each(plant, _at, calls, before), strict=False)  # it does not end
    for point, done in made:
        more, problems = _taken(plant, point, done) or _at(plant, point, nominal, factors, options)
        found += more
        failed += problems
    return found, failed


def _at(
    plant: Plant,
    point: Mapping[str, Any],
    nominal: PlantIdentification | None,
    factors: Sequence[float],
    options: Mapping[str, Any],
) -> tuple[list[PlantIdentification], list[Finding]]:
    """The experiments at a point; without a `nominal` one its errors are raised."""
    found: list[PlantIdentification] = []
    try:
        here = experiment(plant, point=point, like=nominal, **options)
        found.append(here)
        for factor in factors:
            amplitude = factor * here.excitation.amplitude
            found.append(experiment(plant, point=point, like=nominal or here, **{**options, "amplitude": amplitude}))
    except (IdentificationError, SimulationError) as error:
        if nominal is None and not found:
            raise
        return found, [_failed(point, str(error))]
    except BudgetError as error:
        if nominal is None and not found:
            raise
        return found, [_left_out(point, error)]
    return found, []


def _taken(plant: Plant, point: Mapping[str, Any], done: Done | None) -> tuple[list[PlantIdentification], list[Finding]] | None:
    """What a worker has found at a point; None where it is to be done here.

    A worker that did not know what an earlier point has shown of the plant's steps, or whose share of the budget did not do, has
    not done what would have been done here.
    """
    if done is None:
        return None
    if done.ended:
        return [], [_failed(point, f"an FMU fails: {done.ended}")]
    assert plant.workers is not None
    plant.workers.take(plant, done, ahead=False)
    out_of_time = done.refused and plant.meter.budget.steps is None
    if done.error or done.longest_step[0] != plant.longest_step or (done.refused and not out_of_time):
        plant.meter.replay(done.log, done.times, checked=False)
        return None
    plant.longest_step = done.longest_step[1]
    try:
        plant.meter.replay(done.log, done.times)
    except BudgetError as error:
        return [], [_left_out(point, error)]
    result = done.result
    assert isinstance(result, tuple)
    return result


def point_text(point: Mapping[str, Any]) -> str:
    """An operating point in words."""
    return ", ".join(f"{name} = {value}" for name, value in point.items()) or "the FMU's own start values"


def _failed(point: Mapping[str, Any], why: str) -> Finding:
    return Finding("failed", f"at {point_text(point)}: {why}")


def _left_out(point: Mapping[str, Any], error: BudgetError) -> Finding:
    return Finding("left_out", f"at {point_text(point)} no modes are identified: {error}")
