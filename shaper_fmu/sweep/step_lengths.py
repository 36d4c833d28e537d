"""Notes on a communication step that is long for some runs: compares the shortest duration and the highest frequency."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

from shaper_fmu.master.events import treat_events
from shaper_fmu.master.step_notes import is_choice, own_values, step_notes, time_scales
from shaper_fmu.master.system import System
from shaper_fmu.master.wiring import Port
from shaper_fmu.sweep.study import Study


def sweep_step_notes(study: Study, system: System) -> tuple[str, ...]:
    """The notes of `step_notes`, once for all runs. What FMUs calculate from their parameters is not known before they run."""
    ports = time_scales(system)
    own, varied = own_values(system, ports), [name for name in study.vary if system.split(name) in ports]
    cases = [_numbers(system, {name: value for name, value in case.items() if system.split(name) in ports})
             for case in study.compare.values()]  # fmt: skip
    fastest = _fastest(_grid(study, system, varied) if study.plan.kind == "grid" else _points(study, system, varied))
    runs = [{**own, **case, **values} for case in cases for values in fastest]
    return step_notes(system, treat_events(system, None), study.step, runs)


def _fastest(points: Iterable[Mapping[Port, float]]) -> list[Mapping[Port, float]]:
    """For each combination of choices the shortest durations and the highest frequencies that go with it."""
    found: dict[tuple[float, ...], Mapping[Port, float]] = {}
    for values in points:
        group = tuple(value for port, value in values.items() if is_choice(port))
        known = found.get(group, values)
        found[group] = {port: _faster(port, known[port], value) for port, value in values.items()}
    return list(found.values())


def _faster(port: Port, one: float, other: float) -> float:
    if port[1] != "duration":
        return max(one, other)
    return min((value for value in (one, other) if value > 0.0), default=one)


def _grid(study: Study, system: System, names: list[str]) -> Iterable[Mapping[Port, float]]:
    """Combinations of the choices, with the fastest value of all others: a grid may have too many points to go through."""
    axes = [_fastest(_numbers(system, {name: value}) for value in study.vary[name].grid()) for name in names]
    for values in itertools.product(*axes):
        yield {port: number for one in values for port, number in one.items()}


def _points(study: Study, system: System, names: list[str]) -> Iterable[Mapping[Port, float]]:
    if not names:
        return [{}]
    places = [list(study.vary).index(name) for name in names]
    points = dict.fromkeys(tuple(point[i] for i in places) for point in study.points)
    return (_numbers(system, dict(zip(names, point, strict=True))) for point in points)


def _numbers(system: System, values: Mapping[str, Any]) -> dict[Port, float]:
    """Start values of scalars as numbers, by ports; items of enumerations may be given by name."""
    ports = {system.split(name): value for name, value in values.items()}
    return {(fmu, name): float(system.fmus[fmu].start_values({name: value})[name]) for (fmu, name), value in ports.items()}
