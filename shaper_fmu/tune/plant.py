"""A plant: an FMU, or a system of FMUs, with one input and outputs; for experiments, and to be put behind a shaper."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.errors import ArgumentError, ModelError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.alone import ALONE, alone_system
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.motion import motion_order
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.master.variables import kind_of
from shaper_fmu.slips import checked_mapping, checked_names, checked_number
from shaper_fmu.tune.meter import Meter

PROFILE, SHAPER = "profile", "shaper"
"""Names of the profile's and the shaper's instances, as in the archives of `new system`."""
_DEFAULT_DURATION = 10.0
SOLVER_TOLERANCE = 1e-9
"""Asked of FMUs with solvers of their own: the default of many, 1e-4, is a noise in which modes cannot be identified."""


class Plant:
    """An FMU or a system with an input and outputs; each run begins at the FMUs' reset, with its own start values.

    Args:
        source: an FMU's path, an `Fmu`, or a `System` whose input is free.
        input: name of the input, "instance.variable" in a system.
        outputs: names of the outputs; all real ones if none are named.
        start_values: of an FMU given alone, as in `System.add`.

    Inputs that nothing feeds keep their start values. Raises ModelError for wrong names, with the nearest one.
    """

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

    @classmethod
    def of(
        cls,
        source: Plant | System | Fmu | Path | str,
        input: str,
        outputs: Sequence[str] | None,
        start_values: Mapping[str, Any] | None,
    ) -> Plant:
        """The source, if it is a plant already, or the plant that it makes with the rest."""
        return source if isinstance(source, Plant) else cls(source, input, outputs, start_values)

    def beginning(self, values: Mapping[str, Any]) -> Plant:
        """This plant with other values of its variables at the start, by name; itself without any. Raises ModelError for names."""
        if not values:
            return self
        plant = copy.copy(self)
        plant._system = copied(self._system)
        for name, value in values.items():
            plant._system.set(self.full(name), value)
        return plant

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

    def run(
        self, table: np.ndarray, stop_time: float, step: float, point: Mapping[str, Any], substeps: int = 1
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) and outputs (n, m) at every `step`, for an input held at the `table`'s (time, value), rows of shape (k, 2).

        The communication step is step / substeps; where FMUs are coupled, their inputs are linear over it as far as they can.
        """
        with Simulation(self.driven(table), record=self.outputs) as simulation:
            found = self.simulate(simulation, stop_time, step / substeps, point)
        return found.time[::substeps], self.values(found)[::substeps]

    def driven(self, table: np.ndarray) -> System:
        """The plant with its input held at the `table`'s (time, value), rows of shape (k, 2)."""
        system = copied(self._system)
        instance, variable = system.split(self.input)
        system.start_values[instance].pop(variable, None)
        system.drive(self.input, table)
        return system

    def values(self, results: Results) -> np.ndarray:
        """The outputs of a run, shape (n, m)."""
        return np.column_stack([results[name] for name in self.outputs])

    def simulate(self, simulation: Simulation, stop_time: float, step: float, point: Mapping[str, Any]) -> Results:
        """Run a simulation of this plant, with its input driven, at an operating point from time 0 on."""
        given = self._given(point)
        given.pop(self.input, None)
        known = {f"{name}.{variable}" for name, values in self._system.start_values.items() for variable in values}
        unknown = [name for name in given if name.partition(".")[0] not in self._system.fmus]
        if unknown:
            raise ModelError([f"{name!r}: there is no such instance.{nearest(name, known)}" for name in unknown])
        with self.meter.run(stop_time / step) as made:
            made.append(simulation.run(stop_time, step, start_values=given, **self.stepping))
        return made[0]

    @property
    def stepping(self) -> dict[str, Any]:
        """Options of `Simulation.run`: coupled FMUs in the order of feedthrough, with linear inputs; exact solvers."""
        return {
            "solver_tolerance": SOLVER_TOLERANCE,
            "algorithm": "gauss_seidel" if self.coupled else "jacobi",
            "interpolation": "linear" if self.coupled else "hold",
        }

    def follows(self, output: str) -> bool:
        """Whether an output may jump with an input of its FMU."""
        instance, variable = self.port(output)
        return bool(self._system.fmus[instance].inputs_of(variable))

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

    @property
    def shaper(self) -> str:
        """Name of the shaper's instance in `behind`: `SHAPER`, if the system has none of that name."""
        return self.free_name(SHAPER)

    def behind(self, shaper: Mapping[str, Any], rest: float, fmu: Path | str | None = None, output: str = "shaped") -> System:
        """A new system with the plant behind an InputShaper of these start values, whose command is free and was `rest` before.

        `fmu` is the InputShaper's, by default the one that comes with the package; `output` leads to the plant.
        """
        system = copied(self._system)
        instance, variable = system.split(self.input)
        system.start_values[instance].pop(variable, None)
        system.add(self.shaper, fmu or fmu_path("InputShaper", platforms=["this"]), shaper, initial_command=rest)
        system.connect(f"{self.shaper}.{output}", self.input)
        return system

    def moved(self, move: Mapping[str, Any], output: str, rest: float, shaper: Mapping[str, Any] | None = None) -> System:
        """A new system whose input follows an output of a MotionProfile of these start values, on top of `rest`.

        With `shaper` it goes through an InputShaper of those start values.
        """
        if shaper is None:
            system, target = copied(self._system), self.input
            instance, variable = system.split(self.input)
            system.start_values[instance].pop(variable, None)
        else:
            # a motion changes at every step: an event for each of its echoes would make ever more steps
            system, target = self.behind(shaper, rest, output="shaped_mean"), f"{self.shaper}.command"
            system.event_outputs = [port for port in system.event_outputs if port[0] != self.shaper]
        profile = self.free_name(PROFILE)
        system.add(profile, fmu_path("MotionProfile", platforms=["this"]), move)
        # the distance counts in the input's own unit, be it mm or rad: no conversion from the profile's m
        system.connect_raw(f"{profile}.{output}", target, offset=rest)
        return system


def copied(system: System) -> System:
    """A system with the same FMUs, wiring and values, which can be changed without changing the other."""
    copy = System(system.name)
    copy.fmus, copy.connections, copy.scalings = dict(system.fmus), dict(system.connections), dict(system.scalings)
    copy.mappings = dict(system.mappings)
    copy.start_values = {name: dict(values) for name, values in system.start_values.items()}
    copy.signals, copy.event_outputs = dict(system.signals), list(system.event_outputs)
    copy.without_event_mode, copy.readable = set(system.without_event_mode), dict(system.readable)
    copy.clock_connections = dict(system.clock_connections)
    return copy


def _number(text: Any) -> float | None:
    try:
        value = float(text)
    except (TypeError, ValueError):
        return None
    return value if np.isfinite(value) else None
