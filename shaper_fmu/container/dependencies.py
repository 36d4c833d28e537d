"""What the outputs of a container depend on without delay: through the FMUs inside and their connections."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fmpy.model_description import ModelVariable

from shaper_fmu.container.inner import initial_of
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.wiring import Port

_SEVERAL = 64
"""The longest list that is written where it has everything."""
_ALL = ""
"""Stands for an output of an FMU that does not declare what it depends on; all of them depend on the same."""


class Dependencies:
    """The references of the outer variables that outer unknowns depend on, in order.

    What an FMU does not declare is taken to depend on all of its inputs, and at the start on its parameters, too. A long list
    of everything that is known is left out: None means the same.
    """

    def __init__(
        self, system: SystemStructure, outer: Sequence[OuterVariable], always: Sequence[int] = (), *, parameters: bool = False
    ):
        self._instant = _Instant(system, outer, always, parameters)
        self._start = _Start(system, outer, always)

    def of_output(self, output: OuterVariable) -> list[int] | None:
        """The inputs that an output depends on at one instant; where FMI wants them, the parameters of all FMUs on the way."""
        return self._instant.of(output)

    def at_start(self, unknown: OuterVariable) -> list[int] | None:
        """The inputs, the parameters and what else is given exactly that an initial unknown depends on."""
        return self._start.of(unknown)


class _Known:
    """The search for what is known: what of each FMU's variable `knowns` acts on it, and on through the connections."""

    def __init__(self, system: SystemStructure, outer: Sequence[OuterVariable], always: Sequence[int]):
        self._system, self._always = system, always
        self._shown: dict[Port, list[int]] = {}
        self._found: dict[Port, frozenset[int]] = {}
        self._lists: dict[tuple[frozenset[Port], bool], list[int] | None] = {}
        for variable in outer:
            for element in variable.elements if self.counts(variable) else ():
                for target in element:
                    self._shown.setdefault(target.port, []).append(variable.reference)
        self._everything = sorted({*always, *(reference for listed in self._shown.values() for reference in listed)})

    def counts(self, variable: OuterVariable) -> bool:
        """Whether an outer variable is known."""
        raise NotImplementedError

    def knowns(self, port: Port) -> Iterable[str] | None:
        """What acts on a variable that is no input; None if it is not declared."""
        raise NotImplementedError

    def all_knowns(self, instance: str) -> Iterable[str]:
        """What may act on a variable where nothing is declared."""
        raise NotImplementedError

    def of(self, unknown: OuterVariable) -> list[int] | None:
        if unknown.variability == "constant":
            return []
        keys = frozenset(self._key(target.port) for element in unknown.elements for target in element)
        return self._listed(keys, unknown.causality == "output")

    def _listed(self, keys: frozenset[Port], timed: bool) -> list[int] | None:
        """What is known of all that these stand for; what comes out depends on what acts always, too."""
        if (keys, timed) not in self._lists:
            listed = sorted(set[int](self._always if timed else ()).union(*map(self._from, keys)))
            self._lists[keys, timed] = None if len(listed) > _SEVERAL and listed == self._everything else listed
        return self._lists[keys, timed]

    def _key(self, port: Port) -> Port:
        """A variable, or what stands for all of its FMU's that depend on the same."""
        return port if self._is_input(port) or self.knowns(port) is not None else (port[0], _ALL)

    def _is_input(self, port: Port) -> bool:
        return self._system.fmus[port[0]].variables[port[1]].causality == "input"

    def _from(self, begin: Port) -> frozenset[int]:
        """The references of all that is known and acts on a variable: its own, what it depends on, and the sources of that."""
        if begin not in self._found:
            ahead, seen = [begin], {begin}
            while ahead:
                new = [port for port in self._before(ahead.pop()) if port not in seen]
                seen.update(new)
                ahead += new
            self._found[begin] = frozenset(self._references(seen))
        return self._found[begin]

    def _before(self, port: Port) -> list[Port]:
        if port[1] != _ALL and self._is_input(port):
            return [self._key(self._system.connections[port])] if port in self._system.connections else []
        names = self.all_knowns(port[0]) if port[1] == _ALL else self.knowns(port) or ()
        return [(port[0], name) for name in names]

    def _references(self, reached: Iterable[Port]) -> Iterable[int]:
        return (reference for port in reached for reference in self._shown.get(port, ()))


class _Instant(_Known):
    """What outputs depend on at one instant: inputs, and with `parameters` those of all FMUs on the way."""

    def __init__(self, system: SystemStructure, outer: Sequence[OuterVariable], always: Sequence[int], parameters: bool):
        self._parameters: dict[str, set[int]] = {}
        super().__init__(system, outer, always)
        for variable in outer:
            for element in variable.elements if parameters and variable.causality == "parameter" else ():
                for target in element:
                    self._parameters.setdefault(target.port[0], set()).add(variable.reference)
        self._everything = sorted({*self._everything, *(one for listed in self._parameters.values() for one in listed)})

    def counts(self, variable: OuterVariable) -> bool:
        return variable.causality == "input"

    def knowns(self, port: Port) -> Iterable[str] | None:
        fmu = self._system.fmus[port[0]]
        if fmu.variables[port[1]].variability in ("constant", "fixed", "tunable"):
            return ()
        return fmu.inputs_of(port[1]) if fmu.declares_inputs_of(port[1]) else None

    def all_knowns(self, instance: str) -> Iterable[str]:
        fmu = self._system.fmus[instance]
        return [name for name, variable in fmu.variables.items() if variable.causality == "input"]

    def _references(self, reached: Iterable[Port]) -> Iterable[int]:
        ports = list(reached)
        instances = {port[0] for port in ports}
        return [*super()._references(ports), *(one for name in instances for one in self._parameters.get(name, ()))]


class _Start(_Known):
    """What initial unknowns depend on: inputs, parameters, and what starts exactly."""

    def __init__(self, system: SystemStructure, outer: Sequence[OuterVariable], always: Sequence[int]):
        super().__init__(system, outer, always)
        self._declared = {name: _initial_unknowns(fmu) for name, fmu in system.fmus.items()}
        self._exact = {name: [n for n, v in fmu.variables.items() if _is_known_at_start(v)] for name, fmu in system.fmus.items()}

    def counts(self, variable: OuterVariable) -> bool:
        if variable.variability == "constant":
            return False
        return variable.causality in ("input", "parameter") or initial_of(variable) == "exact"

    def knowns(self, port: Port) -> Iterable[str] | None:
        variable = self._system.fmus[port[0]].variables[port[1]]
        return () if variable.initial == "exact" else self._declared[port[0]].get(port[1])

    def all_knowns(self, instance: str) -> Iterable[str]:
        return self._exact[instance]


def _is_known_at_start(variable: ModelVariable) -> bool:
    return variable.causality in ("input", "parameter") or (variable.initial == "exact" and variable.variability != "constant")


def _initial_unknowns(fmu: Fmu) -> dict[str, list[str]]:
    """The declared knowns of the FMU's initial unknowns, elements by elements."""
    found: dict[str, list[str]] = {}
    for unknown in fmu.description.initialUnknowns:
        if unknown.variable is not None and unknown.dependencies is not None:
            knowns = [name for known in unknown.dependencies for name in fmu.elements_of(str(known.name)) if name in fmu.variables]
            found.update(dict.fromkeys(fmu.elements_of(str(unknown.variable.name)), knowns))
    return found
