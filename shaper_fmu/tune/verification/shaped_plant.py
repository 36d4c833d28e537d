"""A plant with an InputShaper: an FMU or a system, with the shaper in front of its free input."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.system import System
from shaper_fmu.tune.identify.plant import ALONE, alone_system, copied, stepping
from shaper_fmu.tune.verification.command import Command

SHAPER = "input_shaper"
"""Name of the shaper's instance."""


class ShapedPlant:
    """A plant that can be connected to different shapers.

    Args:
        source: an FMU, or a system whose `input` is free; in a system, names are "instance.variable".
        input: name of the real input that the shaper leads to.
        start_values: of an FMU given alone.

    Raises ModelError if the system has an instance of the shaper's name.
    """

    def __init__(self, source: System | Fmu | Path | str, input: str, start_values: Mapping[str, Any] | None = None):
        self.alone: bool = not isinstance(source, System)
        self.plant: System = copied(source) if isinstance(source, System) else alone_system(source, start_values or {})
        if SHAPER in self.plant.fmus:
            raise ModelError([f"the system already has an instance {SHAPER}; give it another name"])
        self.input: str = self.full(input)

    def full(self, name: str) -> str:
        """A name with its instance."""
        return f"{ALONE}.{name}" if self.alone and not name.startswith(f"{ALONE}.") else name

    def short(self, name: str) -> str:
        """A short name: without the instance if there is only one FMU."""
        return name.removeprefix(f"{ALONE}.") if self.alone else name

    def unit(self, name: str) -> str:
        """Unit of a variable, "" if it has none."""
        return self.plant.unit(self.plant.split(self.full(name)))

    def nominal_values(self, spread: Mapping[str, float]) -> dict[str, float]:
        """Nominal values of parameters that vary by these shares; raises ModelError for what cannot be varied."""
        found, problems = {}, []
        for name, share in spread.items():
            instance, variable = self.plant.split(self.full(name))
            given: Any = self.plant.start_values[instance].get(
                variable, self.plant.fmus[instance].variable(variable, "parameter").start
            )
            try:
                found[name] = float(given)
            except (TypeError, ValueError):
                problems.append(f"{name} has no start value that is a number; give it one")
            if not 0.0 <= share < math.inf or (found.get(name) == 0.0):
                problems.append(f"{name} = {given} cannot vary by +-{share:g} of it")
        if problems:
            raise ModelError(problems)
        return found

    def shaped(self, shaper: Mapping[str, Any], rest: float, fmu: Path | str | None = None, output: str = "shaped") -> System:
        """A new system with an InputShaper of these start values, whose command is free and was `rest` before.

        `fmu` is the InputShaper's, by default the one that comes with the package; `output` leads to the plant.
        """
        system = copied(self.plant)
        instance, variable = system.split(self.input)
        system.start_values[instance].pop(variable, None)
        system.add(SHAPER, fmu or fmu_path("InputShaper"), shaper, initial_command=rest)
        system.connect(f"{SHAPER}.{output}", self.input)
        return system

    @property
    def stepping(self) -> dict[str, Any]:
        """Options of `Simulation.run`, the same as those of experiments on the plant alone."""
        return stepping(self.plant)

    def commanded(self, shaper: Mapping[str, Any], command: Command) -> System:
        """The same with a command."""
        system = self.shaped(shaper, command.rest)
        system.drive(f"{SHAPER}.command", command.table())
        return system
