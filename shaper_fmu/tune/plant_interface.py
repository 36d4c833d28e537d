"""What a plant is by its description: its input and outputs, units, start values, and what may vary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shaper_fmu.errors import ArgumentError, ModelError
from shaper_fmu.master.alone import ALONE, alone_system
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.motion import motion_order
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import kind_of
from shaper_fmu.slips import checked_mapping, checked_names, checked_number
from shaper_fmu.tune.kept_runs import Memory, RunsBeside
from shaper_fmu.tune.meter import Meter

if TYPE_CHECKING:
    from shaper_fmu.tune.workers.workers import Workers

_DEFAULT_DURATION = 10.0


class PlantInterface:
    """An FMU or a system with an input and outputs, which is not run: see `Plant`."""

    def __init__(
        self,
        source: System | Fmu | Path | str,
        input: str,
        outputs: Sequence[str] | None = None,
        start_values: Mapping[str, Any] | None = None,
    ):
        checked_names("outputs", outputs)
        checked_mapping("start_values", start_values, '{"mass": 2.0}')
        if not isinstance(input, str):
            raise ArgumentError(f"input = {input!r:.80}: the name of one input is needed, such as 'force'")
        self._system = source if isinstance(source, System) else alone_system(source, start_values or {})
        if isinstance(source, System) and start_values:
            raise ModelError(["start values of a system are set in the system itself, by System.set"])
        self.meter: Meter = Meter()
        self.kept: RunsBeside | None = None
        """Where its runs are kept, and those that are there are taken from."""
        self.memory: Memory = Memory()
        self.workers: Workers | None = None
        """Processes that make runs; None for this one alone."""
        self.ahead: dict[str, tuple[tuple[np.ndarray, ...], float]] = {}
        """Runs that workers have made, by key, with the time of their steps [s]: they are counted when they are asked for."""
        self.alone: bool = not isinstance(source, System)
        self.named: bool = bool(outputs)
        """Whether its outputs were named."""
        self.longest_step: float = math.inf
        """Communication step above which its solver diverges [s], where an experiment has met that; the runs keep to it."""
        self.input: str = self.full(input)
        port = self._system.split(self.input)
        variable = self._system.fmus[port[0]].variable(port[1], "input")
        if kind_of(variable) != "real":
            raise ModelError([f"{self.input} is of type {variable.type}; only a real input can be excited"])
        if port in self._system.connections or port in self._system.signals:
            raise ModelError([f"{self.input} is fed already; the experiment needs an input that is free"])
        found = self._system.ports([self.full(name) for name in outputs] if outputs else None)
        self.outputs: list[str] = [".".join(p) for p in found if kind_of(self._system.fmus[p[0]].variables[p[1]]) == "real"]
        if not self.outputs:
            raise ModelError([f"{self._system.name} has no real outputs to look at"])
        self._bounds = [_number(variable.min), _number(variable.max), _number(variable.nominal), _number(variable.start)]

    def __getstate__(self) -> dict[str, Any]:
        """For a worker process: without what counts and keeps its runs here."""
        return {**vars(self), "meter": Meter(), "kept": None, "memory": Memory(), "workers": None, "ahead": {}}

    @property
    def name(self) -> str:
        """Name of the FMU or of the system."""
        return self._system.name

    def full(self, name: str) -> str:
        """The name with the instance before it, which may be left out of a plant that is one FMU."""
        if self.alone and name.partition(".")[0] != ALONE:
            return f"{ALONE}.{name}"
        return name

    def short(self, name: str) -> str:
        """A short name: without the instance if there is only one FMU."""
        return name.removeprefix(f"{ALONE}.") if self.alone else name

    def unit(self, name: str) -> str:
        """Unit of a variable, "" if it has none."""
        return self._system.unit(self.port(name))

    def display_unit(self, name: str) -> tuple[str, float]:
        """The unit in which people want to see a variable, and the factor to it from its own."""
        return self._system.display_unit(self.port(name))

    def _given(self, point: Mapping[str, Any]) -> dict[str, Any]:
        return {self.full(name): value for name, value in point.items()}

    @property
    def units(self) -> list[str]:
        """Units of the outputs, "" without one."""
        return [self.unit(name) for name in self.outputs]

    @property
    def input_unit(self) -> str:
        """Unit of the input, "" if it has none."""
        return self.unit(self.input)

    @property
    def input_order(self) -> int:
        """How often the input's unit is divided by time: 1 for a velocity, 2 for an acceleration, 0 for all else."""
        return motion_order(*self.fmu_of(self.input))

    def fmu_of(self, name: str) -> tuple[Fmu, str]:
        """The FMU that a variable belongs to, and the variable's name in it."""
        instance, variable = self.port(name)
        return self._system.fmus[instance], variable

    @property
    def coupled(self) -> bool:
        """Whether its FMUs are connected with each other, so that the communication step matters."""
        return bool(self._system.connections)

    @property
    def duration_hint(self) -> float:
        """The longest default experiment of its FMUs [s]; 10 s if none is declared."""
        declared = [fmu.description.defaultExperiment for fmu in self._system.fmus.values()]
        stops = [_number(one.stopTime) for one in declared if one is not None]
        return max((stop for stop in stops if stop is not None and stop > 0.0), default=_DEFAULT_DURATION)

    @property
    def fmus(self) -> dict[str, Fmu]:
        """Its FMUs by instance name; a single FMU is the instance `ALONE`."""
        return dict(self._system.fmus)

    def port(self, name: str) -> tuple[str, str]:
        """Instance and variable of a name."""
        return self._system.split(self.full(name))

    def start_values(self, instance: str, point: Mapping[str, Any]) -> dict[str, Any]:
        """All that an instance is given at an operating point, by scalar name, without the excited input."""
        fmu = self._system.fmus[instance]
        given = {**self._system.start_values[instance], **fmu.start_values(self._own(instance, point))}
        return {name: value for name, value in given.items() if f"{instance}.{name}" != self.input}

    @property
    def settings(self) -> dict[str, Any]:
        """All start values that were given, without the excited input's."""
        given = {f"{name}.{v}": value for name, values in self._system.start_values.items() for v, value in values.items()}
        return {self.short(name): value for name, value in given.items() if name != self.input}

    @property
    def own_steps(self) -> list[float]:
        """Steps that its FMUs name as their own [s]: of the default experiment, or fixed internal ones."""
        declared = [_number(getattr(fmu.capabilities, "fixedInternalStepSize", None)) for fmu in self._system.fmus.values()]
        declared += [
            _number(fmu.description.defaultExperiment.stepSize)
            for fmu in self._system.fmus.values()
            if fmu.description.defaultExperiment is not None
        ]
        return sorted({step for step in declared if step is not None and step > 0.0})

    def rest_value(self, point: Mapping[str, Any]) -> float:
        """The input's value at an operating point: the point's, otherwise its start value, otherwise 0."""
        instance, variable = self._system.split(self.input)
        given = {**self._system.start_values[instance], **self._system.fmus[instance].start_values(self._own(instance, point))}
        return float(given.get(variable, self._bounds[3] or 0.0))

    def _own(self, instance: str, point: Mapping[str, Any]) -> dict[str, Any]:
        names = {name: self._system.split(name) for name in self._given(point)}
        return {names[name][1]: value for name, value in self._given(point).items() if names[name][0] == instance}

    def first_amplitude(self, rest: float) -> float:
        """An amplitude to begin with: a twentieth of the input's range, its nominal value, a tenth of its rest value, or 1."""
        low, high, nominal, _ = self._bounds
        if low is not None and high is not None and 0.0 < high - low < 1e30:
            return 0.05 * (high - low)
        return nominal or 0.1 * abs(rest) or 1.0

    def nominal_values(self, spread: Mapping[str, float]) -> dict[str, float]:
        """Nominal values of parameters, and of inputs held at values, that vary by these shares.

        Raises ModelError for what cannot be varied, such as the input that is excited, or one that something feeds.
        """
        found, problems = {}, []
        for name, share in spread.items():
            checked_number(f"spread of {name}", share)
            instance, variable = self.port(name)
            declared = self._system.fmus[instance].variable(variable, "parameter", "input")
            fed = self.port(name) in self._system.connections or self.port(name) in self._system.signals
            if fed or self.full(name) == self.input:
                why = "is fed by something else" if fed else "gets the commands"
                problems.append(f"{name} {why}, so that it cannot be held at values; name a parameter or a free input")
                continue
            given: Any = self._system.start_values[instance].get(variable, declared.start)
            try:
                found[name] = float(given)
            except (TypeError, ValueError):
                problems.append(f"{name} has no start value that is a number; give it one")
            if not 0.0 <= share <= 1.0 or (found.get(name) == 0.0):
                meant = f": did you mean {share:g} % ({share / 100.0:g})? At most 100 % is possible" if share > 1.0 else ""
                problems.append(f"{name} = {given} cannot vary by +-{100.0 * share:g} % of it{meant}")
        if problems:
            raise ModelError(problems)
        return found

    def free_name(self, wanted: str) -> str:
        """This name of an instance, or one with a number behind it, if the system has that already."""
        name, number = wanted, 1
        while name in self._system.fmus:
            number += 1
            name = f"{wanted}_{number}"
        return name


def _number(text: Any) -> float | None:
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if np.isfinite(value) else None
