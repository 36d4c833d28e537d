"""The variables of the container of an archive's system: its own connectors, with their names, units and transformations."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from fmpy.model_description import BaseUnit, Item, ModelVariable, SimpleType
from fmpy.model_description import Unit as FmiUnit

from shaper_fmu.container.build import Packed, pack
from shaper_fmu.container.head import Experiment
from shaper_fmu.container.inner import inner_starts, outer_initial, outer_type, outer_variability, shape_by_names, zero
from shaper_fmu.container.interface import check_version, exposed, finished, outer_variables
from shaper_fmu.container.outside import OuterVariable, Target, Value
from shaper_fmu.errors import ModelError
from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import kind_of
from shaper_fmu.master.wiring import Port
from shaper_fmu.ssp.conversion import IDENTITY, Affine
from shaper_fmu.ssp.document import Connector, SystemDescription
from shaper_fmu.ssp.document_parts import Unit
from shaper_fmu.ssp.meaning import UnknownUnit
from shaper_fmu.ssp.network import TARGETS, Network, Node, Wire

_FIXED = ("parameter", "calculatedParameter")
_KINDS = {("integer", "real"), ("integer", "enumeration"), ("enumeration", "integer")}
"""Kinds of values that become others on a way."""


class Loaded(Protocol):
    """What is asked of an `SspSystem`, which offers the functions of this module."""

    @property
    def system(self) -> SystemStructure: ...

    @property
    def structure(self) -> SystemDescription: ...

    @property
    def network(self) -> Network: ...

    @property
    def instances(self) -> dict[str, str]: ...


def connector_variables(
    loaded: Loaded, fmi: int, *, expose: Iterable[str] = (), rename: Mapping[str, str] | None = None
) -> list[OuterVariable]:
    """The variables of the system's container for FMI 2.0 or 3.0: the system's own connectors, then what is exposed.

    They have the connectors' names and units; conversions, transformations and mappings on the way inside are applied. A system
    without connectors of its own shows all free inputs and all outputs (see `outer_variables`, also for `expose` and `rename`).
    Raises ModelError with all problems.
    """
    check_version(fmi)
    found: list[OuterVariable] = []
    problems: list[str] = []
    for way in _ways(loaded, fmi):
        try:
            found += way.variables()
        except ModelError as error:
            problems += error.problems
    if problems:
        raise ModelError(problems)
    if not found:
        return outer_variables(loaded.system, fmi, expose=expose, rename=rename)
    return finished([*found, *exposed(loaded.system, fmi, expose, found)], fmi, rename or {})


def pack_ssp_system(
    loaded: Loaded,
    path: Path | str,
    fmi: int = 2,
    *,
    expose: Iterable[str] = (),
    rename: Mapping[str, str] | None = None,
    step: float | None = None,
    algorithm: Algorithm | None = None,
    **options: Any,
) -> Packed:
    """Write the system as one FMU (see `connector_variables`, and `pack` for further options). Raises ModelError and BuildError.

    Without them, step and algorithm are those of the archive, or the host's step and jacobi.
    """
    structure = loaded.structure
    step = step if step is not None else structure.step_size
    words = (
        structure.system.description or structure.description or f"The system {structure.name} of {len(loaded.system.fmus)} FMUs."
    )
    return pack(
        loaded.system,
        connector_variables(loaded, fmi, expose=expose, rename=rename),
        path,
        fmi=fmi,
        step=step,
        algorithm=algorithm or structure.algorithm or "jacobi",
        experiment=Experiment(structure.start_time, structure.stop_time, step),
        **{"description": words, **options},
    )


def connectors_not_shown(loaded: Loaded, fmi: int) -> list[str]:
    """The system's own connectors that its container leaves out, and why; empty for a system that has none."""
    if not any(True for _ in _ways(loaded, fmi)):
        return []
    known = {way.connector.name for way in _ways(loaded, fmi)}
    return [f"{one.name} leads nowhere" for one in loaded.structure.system.connectors if one.name not in known]


def _ways(loaded: Loaded, fmi: int) -> Iterator[_Way]:
    """The ways from the system's own connectors to variables of FMUs, or from one variable to a connector."""
    network, signals = loaded.network, loaded.system.signals
    for connector in loaded.structure.system.connectors:
        node = Node("", connector.name)
        inwards = connector.kind in TARGETS
        paths = list(network.paths_from(node)) if inwards else [tuple(network.path_to(node))]
        paths = [path for path in paths if path and network.is_variable(path[-1].target if inwards else path[0].source)]
        way = _Way(loaded, fmi, connector, inwards, paths)
        driven = any(port in signals for path in paths for port in way.ports(path))
        if paths and not driven and not way.is_hidden():
            yield way


@dataclass(frozen=True)
class _Way:
    """A connector of the system, and the paths of wires between it and variables of FMUs: several inwards, one outwards."""

    loaded: Loaded
    fmi: int
    connector: Connector
    inwards: bool
    paths: list[tuple[Wire, ...]]

    def end(self, path: tuple[Wire, ...]) -> Node:
        """The variable at the end, or beginning, of a path."""
        return path[-1].target if self.inwards else path[0].source

    def ports(self, path: tuple[Wire, ...]) -> list[Port]:
        """The elements of the variable of a path."""
        end = self.end(path)
        return [(self.loaded.instances[end.path], name) for name in self.fmu.elements_of(end.name)] if path else []

    @property
    def fmu(self) -> Fmu:
        return self.loaded.network.fmus[self.end(self.paths[0]).path]

    @property
    def variable(self) -> ModelVariable:
        """The whole variable whose meaning is shown."""
        name = self.end(self.paths[0]).name
        wholes = (variable for variable in self.fmu.description.modelVariables if variable.name == name)
        return next(wholes, None) or self.fmu.variables[name]

    def is_hidden(self) -> bool:
        """Whether it is of a type that no container of this version shows."""
        kind = kind_of(self.variable)
        return kind == "clock" or (kind == "binary" and self.fmi == 2)

    def variables(self) -> list[OuterVariable]:
        """One variable, or one for each element of an array in FMI 2.0. Raises ModelError."""
        self._check()
        targets = [self._targets(path) for path in self.paths]
        elements = list(zip(*targets, strict=True))
        names = [port[1] for port in self.ports(self.paths[0])]
        starts = self._starts(names, [element[0] for element in elements])
        if self.fmi == 3 or names == [self.variable.name]:
            return [self._variable(self.connector.name, names, elements, starts)]
        return [
            self._variable(self.connector.name + name.removeprefix(str(self.variable.name)), [name], [element], starts[i : i + 1])
            for i, (name, element) in enumerate(zip(names, elements, strict=True))
        ]

    def _check(self) -> None:
        name = self.connector.name
        for path in self.paths:
            inner = self.loaded.network.variable(self.end(path))
            if self.inwards and self.connector.kind == "input" and inner.causality != "input":
                raise ModelError([f"the system's input {name} feeds {self.end(path)}, which is of causality {inner.causality}"])
            if self.inwards and inner.causality == "structuralParameter":
                raise ModelError([f"{name} feeds {self.end(path)}, a structural parameter, which is fixed in a container"])
        if len({len(self.ports(path)) for path in self.paths}) > 1:
            raise ModelError([f"{name} feeds arrays of different sizes"])

    def _targets(self, path: tuple[Wire, ...]) -> list[Target]:
        network, wires = self.loaded.network, list(path)
        mapping = network.mapping(wires)
        gain, offset = IDENTITY if mapping is not None else network.affine(wires)
        return [Target(port, gain, offset, tuple(sorted((mapping or {}).items()))) for port in self.ports(path)]

    def _starts(self, names: list[str], targets: list[Target]) -> list[Value | None]:
        instance = targets[0].port[0] if targets else ""
        given = self.loaded.system.start_values.get(instance, {})
        own = inner_starts(self.fmu, self.variable, names)
        inside = [given.get(name, value) for name, value in zip(names, own, strict=True)]
        if self.inwards:
            inside = [zero(self.fmu.variables[name]) if value is None else value for name, value in zip(names, inside, strict=True)]
        values = zip(inside, targets, strict=True)
        return [None if value is None else _outside(value, target, self.inwards, self._values()) for value, target in values]

    def _values(self) -> list[int]:
        """The values that the connector can have, if it declares them."""
        items = self.loaded.network.items(Node("", self.connector.name))
        return sorted(items.values()) if items else [0, 1]

    def _variable(
        self, name: str, names: list[str], elements: list[tuple[Target, ...]], starts: list[Value | None]
    ) -> OuterVariable:
        inner = self.variable if names[0] != self.variable.name and self.fmi == 3 else self.fmu.variables[names[0]]
        causality = self.connector.kind if self.inwards else self._causality(inner)
        variability = outer_variability(inner, causality)
        shown, unit = self._shown(inner, elements[0][0])
        initial = outer_initial(shown, causality, variability)
        complete = all(value is not None for value in starts)
        if variability == "constant" and not complete:
            variability = "discrete"
        return OuterVariable(
            name=name,
            causality=causality,
            variability=variability,
            type=self._type(inner, elements[0][0]),
            dimensions=shape_by_names(names) if self.fmi == 3 and names != [inner.name] else (),
            elements=tuple(elements),
            starts=() if initial == "calculated" or not complete else tuple(value for value in starts if value is not None),
            shown=shown,
            fmu=self.fmu,
            unit=unit,
        )

    def _causality(self, inner: ModelVariable) -> str:
        """Of what comes out: a calculated parameter must not change, and what is constant inside is an output."""
        changes = inner.variability not in ("fixed", "tunable")
        if self.connector.kind in ("constant", "unspecified", "inout") or (self.connector.kind in _FIXED and changes):
            return "output"
        return self.connector.kind

    def _type(self, inner: ModelVariable, target: Target) -> str:
        """The type outside: the inner one, or the connector's where that is of another kind. Raises ModelError."""
        declared = self.loaded.network.declared(Node("", self.connector.name))
        kind, own = kind_of(inner), declared.kind if declared is not None else None
        if own in (None, kind) or (own == "integer" and kind == "enumeration"):
            return outer_type(inner, self.fmi)
        ways = ((own, kind) if self.inwards else (kind, own),)
        if own == "real" and ways[0] in _KINDS:
            return "Real" if self.fmi == 2 else "Float64"
        if own == "integer" and ways[0] in _KINDS:
            return "Integer" if self.fmi == 2 else "Int32"
        raise ModelError([f"{self.connector.name} is of kind {own}, but {'.'.join(target.port)} of kind {kind}"])

    def _shown(self, inner: ModelVariable, target: Target) -> tuple[ModelVariable, FmiUnit | None]:
        """The inner variable as it is outside: in the connector's unit, with its items, and what people should know of it."""
        network, node = self.loaded.network, Node("", self.connector.name)
        shown = copy.copy(inner)
        shown.description = self.connector.description or inner.description
        shown.aliases = []
        unit = network.unit(node)
        own = self.fmu.unit_of(str(inner.name) if inner.name in self.fmu.variables else self.fmu.elements_of(str(inner.name))[0])
        scaled = (target.gain, target.offset) != IDENTITY
        if scaled or (unit is not None and unit.name != own):
            _rescale(shown, (target.gain, target.offset), self.inwards)
            shown.name, shown.unit = "", unit.name if unit is not None else None
            return shown, _fmi_unit(unit) if unit is not None else None
        items = network.items(node)
        if target.mapping:
            shown.name, shown.min, shown.max = "", None, None
            if items is not None and kind_of(inner) == "enumeration":
                named = [Item(name=name, value=str(value)) for name, value in items.items()]
                shown.declaredType = SimpleType(name=f"{self.connector.name}_type", type="Enumeration", items=named)
        return shown, None


def _outside(value: Value, target: Target, inwards: bool, possible: list[int]) -> Value:
    """The value outside that is, or becomes, this one inside."""
    if target.mapping and not isinstance(value, str | bytes):
        table = dict(target.mapping)
        if not inwards:
            return type(value)(table.get(int(value), int(value)))
        return type(value)(next((one for one in [*possible, *table] if table.get(one, one) == int(value)), int(value)))
    if (target.gain, target.offset) == IDENTITY or isinstance(value, str | bytes):
        return value
    return (value - target.offset) / target.gain if inwards and target.gain else target.gain * value + target.offset


def _rescale(shown: ModelVariable, affine: Affine, inwards: bool) -> None:
    """Give a real variable its own bounds and nominal value, in the unit outside, instead of its declared type's."""
    gain, offset = affine
    of_type = shown.declaredType
    for name in ("quantity", "min", "max", "nominal", "unbounded"):
        if of_type is not None and not getattr(shown, name):
            setattr(shown, name, getattr(of_type, name))
    shown.declaredType, shown.displayUnit = None, None

    def outside(text: str) -> str:
        inner = float(text)
        return repr((inner - offset) / gain if inwards else gain * inner + offset)

    if gain == 0.0:
        shown.min = shown.max = shown.nominal = None
        return
    bounds = [outside(text) if text is not None else None for text in (shown.min, shown.max)]
    shown.min, shown.max = bounds if gain > 0.0 else bounds[::-1]
    if shown.nominal is not None:
        shown.nominal = repr(abs(float(shown.nominal) / gain if inwards else gain * float(shown.nominal)))


def _fmi_unit(unit: Unit) -> FmiUnit:
    """The definition of an SSP's unit as FMI has it."""
    if isinstance(unit, UnknownUnit):
        return FmiUnit(name=unit.name)
    return FmiUnit(name=unit.name, baseUnit=BaseUnit(**unit.exponents, factor=unit.factor, offset=unit.offset))
