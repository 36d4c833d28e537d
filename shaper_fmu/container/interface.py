"""The variables of a container: what a system's free inputs, its outputs, and what else is asked for, are outside."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from fmpy.model_description import ModelVariable

from shaper_fmu.container.inner import (
    INTEGER_OF_2,
    inner_starts,
    outer_initial,
    outer_type,
    outer_variability,
    shape_by_names,
    zero,
)
from shaper_fmu.container.outside import OuterVariable, Target, Value
from shaper_fmu.errors import ModelError, nearest
from shaper_fmu.master.fmu import STRUCTURAL
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import kind_of
from shaper_fmu.master.wiring import Port

SET = ("input", "parameter")
"""Causalities whose values come from outside, so that their other names (aliases) are no variables of their own."""
_MORE = ("parameter", "calculatedParameter", "local")
"""Causalities that `expose` shows by a name with `*`."""
Through = Mapping[Port, Port]
"""Inputs that are fed inside, and the free inputs of other instances that stand for them outside."""
NOTHING: Through = MappingProxyType({})
FIRST_REFERENCE = {2: 0, 3: 1}
"""By version of FMI. OMSimulator takes the references in FMI 3.0's dependencies for places counted from 1; so they are both."""
_WRONG = re.compile(r"[\x00-\x1f]|^\s|\s$|^$")


def outer_variables(
    system: SystemStructure, fmi: int, *, expose: Iterable[str] = (), rename: Mapping[str, str] | None = None
) -> list[OuterVariable]:
    """The variables of a system's container for FMI 2.0 or 3.0: all free inputs, then all outputs, then what is exposed.

    They are called "instance.variable". `expose` names parameters, local variables and calculated parameters, or several of them by
    a `*` for any text ("plant.*", "plant.motor.*"); `rename` gives other names. In FMI 2.0 arrays are their elements; in FMI 3.0
    only those of which some elements are fed inside. Clocks are never shown, binary variables not in FMI 2.0 (see `not_shown`).
    Raises ModelError with all problems.
    """
    check_version(fmi)
    found = [*_all(system, fmi, "input"), *_all(system, fmi, "output")]
    return finished([*found, *exposed(system, fmi, expose, found)], fmi, rename or {})


def check_version(fmi: int) -> None:
    """Raise ModelError unless a container can be of this version of FMI."""
    if fmi not in (2, 3):
        raise ModelError([f"fmi = {fmi!r} is not a version of FMI that a container can have: give 2 or 3"])


def not_shown(system: SystemStructure, fmi: int) -> list[str]:
    """The free inputs and outputs that FMI 2.0 or 3.0 cannot show, as "instance.variable" and why."""
    left_out = []
    for causality in ("input", "output"):
        for instance, variable in _whole(system, causality):
            try:
                outer_type(variable, fmi)
            except ModelError as error:
                if free_elements(system, instance, variable):
                    left_out.append(f"{instance}.{variable.name} {error.problems[0]}")
    return left_out


def _all(system: SystemStructure, fmi: int, causality: str) -> Iterator[OuterVariable]:
    """All free inputs, or all outputs, that this version of FMI can show; an input's other names are shown with it in FMI 3.0."""
    for instance, variable in _whole(system, causality):
        if kind_of(variable) == "clock" or (kind_of(variable) == "binary" and fmi == 2):
            continue
        if variable.alias is not None and causality == "input":
            continue
        yield from shown(system, instance, variable, fmi)


def _whole(system: SystemStructure, causality: str) -> Iterator[tuple[str, ModelVariable]]:
    """The variables of a causality of all instances, arrays as a whole; without those whose names are ambiguous."""
    for instance, fmu in system.fmus.items():
        for variable in fmu.description.modelVariables:
            if variable.causality == causality and fmu.elements_of(str(variable.name))[0] in fmu.variables:
                yield instance, variable


def free_elements(system: SystemStructure, instance: str, variable: ModelVariable, through: Through = NOTHING) -> list[str]:
    """The names of a variable's elements; of an input those that nothing feeds, or that others stand for."""
    names = system.fmus[instance].elements_of(str(variable.name))
    if variable.causality != "input":
        return names
    fed = {*system.connections, *system.signals, *system.clock_connections}.difference(through)
    return [name for name in names if (instance, name) not in fed]


def shown(
    system: SystemStructure,
    instance: str,
    variable: ModelVariable,
    fmi: int,
    *,
    name: Callable[[str], str] | None = None,
    through: Through = NOTHING,
) -> list[OuterVariable]:
    """A variable as it is outside: one, or the free elements of an array. `name` makes the outer name of an inner one.

    Raises ModelError with all problems.
    """
    fmu, whole = system.fmus[instance], str(variable.name)
    elements, free = fmu.elements_of(whole), free_elements(system, instance, variable, through)
    outer = _Shown(system, instance, fmi, through, name or (lambda inner: f"{instance}.{inner}"))
    if fmi == 3 and free == elements:
        return [outer.variable(variable, elements)]
    return [outer.variable(fmu.variables[element], [element]) for element in free]


@dataclass(frozen=True)
class _Shown:
    """How variables of an instance become outer ones."""

    system: SystemStructure
    instance: str
    fmi: int
    through: Through
    name: Callable[[str], str]

    def variable(self, variable: ModelVariable, elements: list[str]) -> OuterVariable:
        """One variable. Structural parameters stay as they are, so that they are constants. Raises ModelError."""
        structural = variable.causality == STRUCTURAL
        causality = "local" if structural else str(variable.causality)
        variability = "constant" if structural else outer_variability(variable, causality)
        try:
            type_ = outer_type(variable, self.fmi)
            variability, starts = _started(variable, causality, variability, self._starts(variable, elements))
            if type_ == "Integer" and not all(int(value) in INTEGER_OF_2 for value in starts):
                raise ModelError([f"starts at {starts[0]}, which is no Integer of FMI 2.0: make a container of FMI 3.0"])
        except ModelError as error:
            raise ModelError([f"{self.instance}.{variable.name} {problem}" for problem in error.problems]) from None
        ports = [(self.instance, element) for element in elements]
        return OuterVariable(
            name=self.name(str(variable.name)),
            causality=causality,
            variability=variability,
            type=type_,
            dimensions=shape_by_names(elements) if elements != [variable.name] else (),
            elements=tuple((Target(self.through.get(port, port)),) for port in ports),
            starts=starts,
            shown=variable,
            fmu=self.system.fmus[self.instance],
        )

    def _starts(self, variable: ModelVariable, elements: list[str]) -> list[Value | None]:
        fmu, given = self.system.fmus[self.instance], self.system.start_values[self.instance]
        own = inner_starts(fmu, variable, elements)
        return [given.get(name, fmu.structure.get(name, value)) for name, value in zip(elements, own, strict=True)]


def _started(variable: ModelVariable, causality: str, variability: str, found: list[Value | None]) -> tuple[str, tuple[Value, ...]]:
    """Variability and start values. An input without one starts at zero; what should be constant without one is calculated."""
    values = [value for value in found if value is not None]
    complete = len(values) == len(found)
    if causality == "input":
        return variability, tuple(zero(variable) if value is None else value for value in found)
    if causality == "parameter" and not complete:
        raise ModelError(["has no start value in its FMU: give it one"])
    if variability == "constant" and not complete:
        variability = "discrete" if causality == "output" else "fixed"
    calculated = outer_initial(variable, causality, variability) == "calculated"
    return variability, () if calculated or not complete else tuple(values)


def exposed(system: SystemStructure, fmi: int, names: Iterable[str], known: Sequence[OuterVariable]) -> list[OuterVariable]:
    """The variables that `expose` names, without those that are known already. Raises ModelError with all problems."""
    seen = {target.port for variable in known for element in variable.elements for target in element}
    found: list[OuterVariable] = []
    problems: list[str] = []
    for name in [names] if isinstance(names, str) else names:  # one name alone is no list of letters
        try:
            for instance, variable in _named(system, name):
                for outer in shown(system, instance, variable, fmi):
                    ports = [target.port for element in outer.elements for target in element]
                    if not seen.issuperset(ports):
                        found.append(outer)
                        seen.update(ports)
        except ModelError as error:
            problems += error.problems
    if problems:
        raise ModelError(problems)
    return found


def _named(system: SystemStructure, name: str) -> list[tuple[str, ModelVariable]]:
    """The variables that a name of `expose` means: one, an element of an array, or those that a name with `*` fits."""
    if "*" in name:
        return _matching(system, name)
    if name in system.fmus:
        raise ModelError([f"{name} is an instance: name a variable of it, or {name}.* for all"])
    instance, variable = system.split(name)
    fmu = system.fmus[instance]
    wholes = {str(one.name): one for one in fmu.description.modelVariables}
    if fmu.elements_of(variable)[0] not in fmu.variables:
        raise ModelError([f"{name}: {fmu.name} has no variable {variable!r}.{nearest(variable, wholes)}"])
    found = wholes.get(variable) or fmu.variables[variable]
    if found.causality == "independent":
        raise ModelError([f"{name} is the time, of which the container has its own"])
    if found.causality == "input" and not free_elements(system, instance, found):
        source = system.connections.get((instance, variable))
        raise ModelError([f"{name} is fed inside" + (f": expose its source, {'.'.join(source)}" if source else "")])
    return [(instance, found)]


def _matching(system: SystemStructure, name: str) -> list[tuple[str, ModelVariable]]:
    pattern = re.compile(".*".join(re.escape(part) for part in name.split("*")))
    candidates = [
        (instance, variable)
        for causality in _MORE
        for instance, variable in _whole(system, causality)
        if kind_of(variable) not in ("clock", "binary") and (variable.alias is None or causality not in SET)
    ]
    found = [(instance, variable) for instance, variable in candidates if pattern.fullmatch(f"{instance}.{variable.name}")]
    if not found:
        raise ModelError([f"{name}: no parameter, calculated parameter or local variable has such a name"])
    return found


def finished(found: Iterable[OuterVariable], fmi: int, rename: Mapping[str, str]) -> list[OuterVariable]:
    """The variables with their own names and their references. Raises ModelError for names that are wrong, or there twice."""
    variables = list(found)
    known = {variable.name for variable in variables}
    hidden = "Parameters and local variables have to be exposed, too."
    problems = [f"{old}: there is no such variable to rename.{nearest(old, known)} {hidden}" for old in rename if old not in known]
    named = [replace(variable, name=rename.get(variable.name, variable.name)) for variable in variables]
    owners: dict[str, str] = {}
    for variable in named:
        what = ".".join(variable.elements[0][0].port) if variable.elements[0] else variable.name
        if _WRONG.search(variable.name):
            problems.append(f"{variable.name!r} is not a name for a variable ({what}): it must be a text on one line")
        if variable.name in owners:
            problems.append(f"{variable.name} would be the name of {owners[variable.name]} and of {what}: rename one of them")
        owners.setdefault(variable.name, what)
    if not named:
        problems.append("there is nothing to show: no input is free, and there is no output; expose a variable")
    if problems:
        raise ModelError(problems)
    return [replace(variable, reference=i) for i, variable in enumerate(named, FIRST_REFERENCE[fmi])]
