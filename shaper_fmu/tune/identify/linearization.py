"""Linearizes a plant's FMU at an operating point, by directional derivatives or by differences in Model Exchange.

It is not an identification: it uses the states that the FMU declares, whereas an experiment uses its outputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.tune.identify.linear_differences import jacobian
from shaper_fmu.tune.identify.linear_interface import (
    Exchange,
    Interface,
    LinearizationError,
    NoLinearizationError,
    directional,
    interface_of,
    magnitude,
    values,
)
from shaper_fmu.tune.identify.linear_modes import Linearization, LinearMode, unrest
from shaper_fmu.tune.identify.response import Experiment
from shaper_fmu.tune.plant import Plant

__all__ = ["LinearMode", "Linearization", "LinearizationError", "NoLinearizationError", "linearize"]

_SETTLING_STEPS = 200
_SAME = 1e-6
_NEGLIGIBLE = 1e-9


@dataclass(frozen=True)
class _Task:
    """A linearization: an FMU, its names, its values at the operating point, and its settling time [s]."""

    name: str
    fmu: Fmu
    interface: Interface
    input: str
    outputs: tuple[str, ...]
    start_values: dict[str, Any]
    input_value: float
    amplitude: float
    time: float


@dataclass(frozen=True)
class _Settled:
    """The state that co-simulation has settled in, and its outputs there."""

    state: np.ndarray
    outputs: np.ndarray


def linearize(
    source: Plant | System | Fmu | Path | str,
    input: str = "",
    outputs: Sequence[str] | None = None,
    *,
    point: Mapping[str, Any] | None = None,
    start_values: Mapping[str, Any] | None = None,
    settle_time: float | None = None,
) -> Linearization:
    """Linearize an FMU from `input` to `outputs` at an operating point.

    Args:
        source, input, outputs, start_values: see `Plant`; an FMU alone, with states in its ModelStructure.
        point: start values of the operating point, by name, the input's value included.
        settle_time: how long the FMU runs before, with the input held [s]; None to find out, as `experiment` does; 0 for its
            initial state.

    Directional derivatives of co-simulation are taken first, then those of Model Exchange, then differences of its state
    derivatives; Model Exchange begins in the states that co-simulation has settled in. Whether that is a state of rest, `at_rest`
    tells. Raises NoLinearizationError where the FMU lacks what it takes, LinearizationError where it contradicts itself,
    SimulationError where a call fails or gives no finite number, ModelError for wrong names.
    """
    plant = Plant.of(source, input, outputs, start_values)
    point = dict(point or {})
    task = _task(plant, point, settle_time)
    settled: _Settled | None = None
    if task.time > 0.0 or task.interface.directional[0]:
        with _coupled(task, plant, point) as instance:
            state, shown = values(instance, task.interface.states), values(instance, task.outputs)
            if task.interface.directional[0]:
                rate = values(instance, task.interface.derivatives)
                return _directional(task, instance, state, rate, magnitude(_nominal(task), state))
            settled = _Settled(state, shown)
    with Exchange(task.name, task.fmu, task.interface.states, task.start_values, task.time) as model:
        return _exchanged(task, model, settled)


@contextmanager
def _coupled(task: _Task, plant: Plant, point: Mapping[str, Any]) -> Iterator[Instance]:
    """An instance for co-simulation once it has settled."""
    if task.time > 0.0:
        with Simulation(plant.driven(np.array([[0.0, task.input_value]])), record=plant.outputs) as simulation:
            plant.simulate(simulation, task.time, task.time / _SETTLING_STEPS, point)
            yield simulation.instances[task.name]
        return
    with closing(Instance(task.name, task.fmu, event_mode=False)) as instance:  # a run of no length is not for all FMUs
        instance.enter_initialization(0.0, None, task.start_values)
        instance.call("exitInitializationMode", at="initialization")
        yield instance


def _task(plant: Plant, point: Mapping[str, Any], settle_time: float | None) -> _Task:
    fmus = plant.fmus
    if len(fmus) > 1 or plant.coupled:
        raise NoLinearizationError(f"a system of {len(fmus)} coupled FMUs cannot be linearized; give an FMU alone")
    ((name, fmu),) = fmus.items()
    interface = interface_of(fmu)
    variable = fmu.variables[plant.port(plant.input)[1]]
    if variable.variability == "discrete":
        raise NoLinearizationError(
            f"{fmu.name} cannot be linearized: {variable.name} is discrete, so nothing depends on it smoothly"
        )
    if settle_time is None:
        trial = Experiment(plant, point)
        trial.settle(plant.duration_hint)
        settle_time = trial.settle_time
    outputs = tuple(plant.port(output)[1] for output in plant.outputs)
    rest = plant.rest_value(point)
    start_values = {**plant.start_values(name, point), str(variable.name): rest}
    return _Task(name, fmu, interface, str(variable.name), outputs, start_values, rest, plant.first_amplitude(rest), settle_time)


def _nominal(task: _Task) -> np.ndarray:
    """The states' nominal values in the model description, shape (n,); 0 without a valid one."""
    declared = [task.fmu.variables[name].nominal for name in task.interface.states]
    return np.nan_to_num(np.array([float(text) if text is not None else 0.0 for text in declared]), posinf=0.0, neginf=0.0)


def _directional(task: _Task, instance: Instance, state: np.ndarray, rate: np.ndarray, scale: np.ndarray) -> Linearization:
    """All matrices by directional derivatives, column by column."""
    unknowns = [*task.interface.derivatives, *task.outputs]
    full = np.column_stack([directional(instance, unknowns, known) for known in (*task.interface.states, task.input)])
    error = np.finfo(float).eps * np.abs(full)
    return _linearization(task, full, error, state, rate, scale, by_differences=False)


def _exchanged(task: _Task, model: Exchange, settled: _Settled | None) -> Linearization:
    """Model Exchange: directional derivatives if it has them, else differences."""
    if settled is not None:
        model.state = settled.state
    state, rate = model.state, model.derivative
    scale = magnitude(model.nominal, state)
    shown = values(model.instance, task.outputs)
    if task.interface.directional[1]:
        found = _directional(task, model.instance, state, rate, scale)
    else:

        def right_hand_side(variables: np.ndarray) -> np.ndarray:
            model.state = variables[:-1]
            model.instance.set_values({task.input: float(variables[-1])})
            return np.concatenate([model.derivative, values(model.instance, task.outputs)])

        at = np.append(state, task.input_value)
        magnitudes = np.append(scale, max(abs(task.amplitude), abs(task.input_value)))
        rows = np.append(scale, np.maximum(np.abs(shown), 1.0))
        full, error = jacobian(right_hand_side, at, magnitudes, rows)
        found = _linearization(task, full, error, state, rate, scale, by_differences=True)
    if settled is not None:
        _check_same(task, shown, settled.outputs, np.abs(found.C) @ scale)
    return found


def _check_same(task: _Task, exchanged: np.ndarray, coupled: np.ndarray, size: np.ndarray) -> None:
    """Raise LinearizationError if both interfaces give other outputs in the same state: there is more to it than the states."""
    for name, one, other, most in zip(task.outputs, exchanged, coupled, size, strict=True):
        if abs(one - other) > _SAME * abs(other) + _NEGLIGIBLE * most:
            raise LinearizationError(
                f"{task.fmu.name} cannot be linearized at t = {task.time:g} s: its Model Exchange gives {name} = {one:.9g} in the "
                f"states in which co-simulation gives {other:.9g}, so the states are incomplete"
            )


def _linearization(
    task: _Task,
    full: np.ndarray,
    error: np.ndarray,
    state: np.ndarray,
    rate: np.ndarray,
    scale: np.ndarray,
    *,
    by_differences: bool,
) -> Linearization:
    n = len(state)
    a = full[:n, :n]
    return Linearization(
        a, full[:n, n:], full[n:, :n], full[n:, n:], task.interface.states, task.input, task.outputs, state, rate, task.time,
        "differences" if by_differences else "directional derivatives", error[:n, :n], unrest(a, rate, scale),
    )  # fmt: skip
