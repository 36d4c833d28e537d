"""The variables of a plant's container that shapes some of its inputs: the plant's own, and the shapers' parameters."""

from __future__ import annotations

from fmpy.model_description import ModelVariable

from shaper_fmu.container.inner import outer_type
from shaper_fmu.container.interface import SET, Through, finished, shown
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.errors import ModelError
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import kind_of

_OF_SHAPER = ("parameter", "calculatedParameter")


def wrapped_variables(system: SystemStructure, fmi: int, plant: str = "plant") -> list[OuterVariable]:
    """The plant's whole interface in its order, with its names, where the shapers' inputs stand for the plant's that they feed.

    All other instances of the system are shapers. Their parameters follow, under the shaper's name where the plant has none that
    begins with it, else with "_2", "_3", ... Structural parameters are constants. Raises ModelError with all problems.
    """
    through = _through(system, plant)
    found: list[OuterVariable] = []
    problems: list[str] = []
    for variable in system.fmus[plant].description.modelVariables:
        try:
            found += _of_plant(system, fmi, plant, variable, through)
        except ModelError as error:
            problems += error.problems
    for shaper in system.fmus:
        if shaper != plant:
            found += _of_shaper(system, fmi, shaper, [variable.name for variable in found])
    if problems:
        raise ModelError(problems)
    return finished(found, fmi, {})


def not_wrapped(system: SystemStructure, fmi: int, plant: str = "plant") -> list[str]:
    """The plant's variables that FMI 2.0 or 3.0 cannot show, and why."""
    left_out = []
    for variable in system.fmus[plant].description.modelVariables:
        try:
            outer_type(variable, fmi)
        except ModelError as error:
            left_out.append(f"{variable.name} {error.problems[0]}")
    return left_out


def time_of(system: SystemStructure, plant: str = "plant") -> str | None:
    """The name of the plant's independent variable, if it has one."""
    names = [v.name for v in system.fmus[plant].description.modelVariables if v.causality == "independent"]
    return str(names[0]) if names else None


def _through(system: SystemStructure, plant: str) -> Through:
    """The shaped inputs of the plant, and the shapers' inputs for them. Raises ModelError."""
    found = {}
    for target, source in system.connections.items():
        if target[0] == plant:
            fmu = system.fmus[source[0]]
            free = [name for name, v in fmu.variables.items() if v.causality == "input" and kind_of(v) == "real"]
            if source[0] == plant or len(free) != 1:
                raise ModelError([f"{'.'.join(target)} is fed by {'.'.join(source)}, which is not of a shaper with one real input"])
            found[target] = (source[0], free[0])
    return found


def _of_plant(system: SystemStructure, fmi: int, plant: str, variable: ModelVariable, through: Through) -> list[OuterVariable]:
    fmu, kind = system.fmus[plant], kind_of(variable)
    if variable.causality == "independent" or kind == "clock" or (kind == "binary" and fmi == 2):
        return []
    if fmu.elements_of(str(variable.name))[0] not in fmu.variables:
        return []
    if variable.alias is not None and variable.causality in SET:
        return []
    return shown(system, plant, variable, fmi, name=str, through=through)


def _of_shaper(system: SystemStructure, fmi: int, shaper: str, taken: list[str]) -> list[OuterVariable]:
    prefix, number = shaper, 2
    while any(name.partition(".")[0].partition("[")[0] == prefix for name in taken):
        prefix, number = f"{shaper}_{number}", number + 1
    variables = [v for v in system.fmus[shaper].description.modelVariables if v.causality in _OF_SHAPER]
    return [
        outer for variable in variables for outer in shown(system, shaper, variable, fmi, name=lambda inner: f"{prefix}.{inner}")
    ]
