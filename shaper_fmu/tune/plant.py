"""A plant: an FMU, or a system of FMUs, with one input and outputs; for experiments, and to be put behind a shaper."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.tune.kept_runs import from_arrays, run_key, to_arrays, wiring_of
from shaper_fmu.tune.plant_interface import PlantInterface
from shaper_fmu.version import __version__

PROFILE, SHAPER = "profile", "shaper"
"""Names of the profile's and the shaper's instances, as in the archives of `new system`."""
SOLVER_TOLERANCE = 1e-9
"""Asked of FMUs with solvers of their own: the default of many, 1e-4, is a noise in which modes cannot be identified."""


class Plant(PlantInterface):
    """An FMU or a system with an input and outputs; each run begins at the FMUs' reset, with its own start values.

    Args:
        source: an FMU's path, an `Fmu`, or a `System` whose input is free.
        input: name of the input, "instance.variable" in a system.
        outputs: names of the outputs; all real ones if none are named.
        start_values: of an FMU given alone, as in `System.add`.

    Inputs that nothing feeds keep their start values. Raises ModelError for wrong names, with the nearest one.
    """

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

    def run(
        self, table: np.ndarray, stop_time: float, step: float, point: Mapping[str, Any], substeps: int = 1
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) and outputs (n, m) at every `step`, for an input held at the `table`'s (time, value), rows of shape (k, 2).

        The communication step is step / substeps; where FMUs are coupled, their inputs are linear over it as far as they can.
        """
        found = self.made(self.driven(table), self.outputs, stop_time, step / substeps, point)
        return found.time[::substeps], self.values(found)[::substeps]

    def made(
        self,
        system: System,
        record: list[str],
        stop_time: float,
        step: float,
        point: Mapping[str, Any],
        *,
        again: bool = False,
        **options: Any,
    ) -> Results:
        """The run of a system with this plant at an operating point from time 0 on: one that is kept, or a new one, which is kept.

        `options` are those of `Simulation.run`, `stepping` by default. One that is kept takes no steps. With `again` it is kept in
        memory, too: a verification of another shaper compares with the same runs.
        """
        given, options = self.checked_point(point), options or self.stepping
        key = run_key(system, record, stop_time, step, sorted(given.items()), sorted(options.items()))
        known = self.memory.found(key) or (self.kept.found(key) if self.kept and key else None)
        if known is not None:
            return from_arrays(known, record)
        waiting = self.ahead.pop(key, None)
        with self.meter.run(stop_time / step) as made:
            if waiting is not None:
                made.append(replace(from_arrays(waiting[0], record), stepping_time=waiting[1]))
            else:
                with Simulation(system, record=record) as simulation:  # a new one: not every FMU is like new after its reset
                    made.append(simulation.run(stop_time, step, start_values=given, **options))
        arrays = to_arrays(made[0], record)
        if again and key:
            self.memory.keep(key, *arrays)
        if self.kept and key:
            self.kept.keep(key, *arrays)
        return made[0]

    @property
    def system(self) -> System:
        """A new system with the plant alone."""
        return copied(self._system)

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
        given = self.checked_point(point)
        with self.meter.run(stop_time / step) as made:
            made.append(simulation.run(stop_time, step, start_values=given, **self.stepping))
        return made[0]

    def checked_point(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """Start values of an operating point by full name, without the excited input's. Raises ModelError for unknown instances."""
        given = self._given(point)
        given.pop(self.input, None)
        known = {f"{name}.{variable}" for name, values in self._system.start_values.items() for variable in values}
        unknown = [name for name in given if name.partition(".")[0] not in self._system.fmus]
        if unknown:
            raise ModelError([f"{unknown[0]!r}: there is no such instance.{nearest(unknown[0], known)}"])
        return given

    def facts(self, spread: Mapping[str, float]) -> dict[str, str]:
        """What its runs rest on, by name, in words: see `KeptRuns`."""
        files = {f"the file of {self.short(name)}": f"{one.name} ({one.digest[:12]})" for name, one in self._system.fmus.items()}
        values = ", ".join(f"{name} = {value}" for name, value in sorted(self.settings.items())) or "none"
        wiring = hashlib.sha256(wiring_of(self._system).encode()).hexdigest()[:12] if len(self._system.fmus) > 1 else ""
        ranges = ", ".join(f"{name} +-{100.0 * share:g} %" for name, share in sorted(spread.items())) or "none"
        return {
            "the version of shaper-fmu": __version__, **files, **({"the system": wiring} if wiring else {}),
            "the input": self.short(self.input), "the outputs": ", ".join(self.short(name) for name in self.outputs),
            "the start values": values, "the range": ranges,
        }  # fmt: skip

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
