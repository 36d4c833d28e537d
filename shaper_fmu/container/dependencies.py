"""What the outputs of a container depend on without delay: through the FMUs inside and their connections."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from fmpy.model_description import Unknown

from shaper_fmu.container.inner import initial_of
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port


class Dependencies:
    """The references of the outer variables that outer unknowns depend on.

    What an FMU does not declare is taken to depend on all of its inputs, and at the start on its parameters, too.
    """

    def __init__(self, system: SystemStructure, outer: Sequence[OuterVariable]):
        self._system = system
        self._shown: dict[Port, list[OuterVariable]] = {}
        for variable in outer:
            for element in variable.elements:
                for target in element:
                    self._shown.setdefault(target.port, []).append(variable)
        self._parameters: dict[str, list[OuterVariable]] = {}
        for port, variables in self._shown.items():
            self._parameters.setdefault(port[0], []).extend(v for v in variables if v.causality == "parameter")
        self._initial = {name: _initial_unknowns(fmu) for name, fmu in system.fmus.items()}
        self._exact = {name: _known_at_start(fmu) for name, fmu in system.fmus.items()}

    def of_output(self, output: OuterVariable) -> list[int]:
        """The inputs that an output depends on at one instant."""
        return self._references(output, self._inputs, ("input",))

    def parameters_of(self, output: OuterVariable) -> list[int]:
        """The parameters of all FMUs that an output's values come through at one instant."""
        reached = {port[0] for port in self._reached(output, self._inputs)}
        return sorted({v.reference for name in reached for v in self._parameters.get(name, [])})

    def at_start(self, unknown: OuterVariable) -> list[int]:
        """The inputs, the parameters and what else is given exactly that an initial unknown depends on."""
        return self._references(unknown, self._knowns_at_start, ("input", "parameter", "exact"))

    def _references(self, unknown: OuterVariable, knowns: Callable[[Port], Iterable[str]], kinds: tuple[str, ...]) -> list[int]:
        found = set()
        for port in self._reached(unknown, knowns):
            for variable in self._shown.get(port, []):
                if variable.variability == "constant":
                    continue
                exact = variable.causality not in ("input", "parameter") and initial_of(variable) == "exact"
                if variable is not unknown and ("exact" if exact else variable.causality) in kinds:
                    found.add(variable.reference)
        return sorted(found)

    def _reached(self, unknown: OuterVariable, knowns: Callable[[Port], Iterable[str]]) -> set[Port]:
        """All variables inside that act on an unknown: its own, what they depend on, and the sources of that."""
        ahead = [target.port for element in unknown.elements for target in element]
        seen = set(ahead)
        while ahead:
            instance, variable = port = ahead.pop()
            following = [(instance, name) for name in knowns(port)]
            if self._system.fmus[instance].variables[variable].causality == "input":
                following = [self._system.connections[port]] if port in self._system.connections else []
            new = [one for one in following if one not in seen]
            seen.update(new)
            ahead += new
        return seen

    def _inputs(self, port: Port) -> Iterable[str]:
        fmu = self._system.fmus[port[0]]
        variable = fmu.variables[port[1]]
        changes = variable.variability not in ("constant", "fixed", "tunable") and variable.causality != "input"
        return fmu.inputs_of(port[1]) if changes else ()

    def _knowns_at_start(self, port: Port) -> Iterable[str]:
        fmu = self._system.fmus[port[0]]
        variable = fmu.variables[port[1]]
        if variable.causality == "input" or variable.initial == "exact":
            return ()
        declared = self._initial[port[0]].get(port[1])
        return declared if declared is not None else self._exact[port[0]]


def _initial_unknowns(fmu: Fmu) -> dict[str, list[str]]:
    """The declared knowns of the FMU's initial unknowns, elements by elements."""
    found: dict[str, list[str]] = {}
    for unknown in fmu.description.initialUnknowns:
        if unknown.variable is not None and unknown.dependencies is not None:
            for name in fmu.elements_of(str(unknown.variable.name)):
                found[name] = _elements(fmu, unknown)
    return found


def _elements(fmu: Fmu, unknown: Unknown) -> list[str]:
    return [name for known in unknown.dependencies or [] for name in fmu.elements_of(str(known.name)) if name in fmu.variables]


def _known_at_start(fmu: Fmu) -> list[str]:
    """All that is given at the start: inputs, parameters, and what starts exactly."""
    known = ("input", "parameter")
    return [
        name for name, v in fmu.variables.items() if v.causality in known or (v.initial == "exact" and v.variability != "constant")
    ]
