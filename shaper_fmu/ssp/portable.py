"""Reports the features of an SSP archive that other tools ignore, refuse or treat differently.

Measured with libcosim (libcosimpy 0.0.6), ecos (ecospy 0.7.2) and fmpy.ssp (FMPy 0.3.32) on archives that differ from a plain one
in the feature named (tests/ssp/test_ssp_portable.py). OMSimulator was not run: its entries come from its own issues, whose
numbers are given.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.errors import ArchiveError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.annotations import OMS_TYPE
from shaper_fmu.ssp.connectors import flatten
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    DictionaryReference,
    ParameterSet,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.document_parts import LinearTransformation
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Findings
from shaper_fmu.ssp.meaning import Scope, kind_of_type, units_differ
from shaper_fmu.ssp.names import DESCRIPTION, OSP_URI, PREFIXES, SSD_TYPE, SSP_TYPE, TYPES_1, USUAL_PREFIXES
from shaper_fmu.ssp.network import Network
from shaper_fmu.ssp.parameters import bound_values, targets
from shaper_fmu.ssp.read import read_description
from shaper_fmu.ssp.structure import Place
from shaper_fmu.xml_files import parse_xml

LIBCOSIM, ECOS, FMPY, OMSIMULATOR = "libcosim", "ecos", "fmpy.ssp", "OMSimulator"
REFUSE, IGNORE, ENDS = "refuses the archive", "ignores it", "ends the process"

EFFECTS: dict[str, dict[str, str]] = {
    "version 2.0": {ECOS: REFUSE, FMPY: REFUSE},
    "a type of version 2.0": {LIBCOSIM: REFUSE},
    "other prefixes than ssd:, ssc: and ssv:": {LIBCOSIM: REFUSE, ECOS: REFUSE},
    "a nested system": {LIBCOSIM: REFUSE, ECOS: REFUSE},
    "a component that is another system": {LIBCOSIM: REFUSE, ECOS: REFUSE, FMPY: REFUSE},
    "a connection of the system's own connector": {LIBCOSIM: REFUSE, ECOS: REFUSE},
    "a connector of the system that nothing is connected to": {FMPY: REFUSE},
    "a signal dictionary": {LIBCOSIM: REFUSE, ECOS: REFUSE, FMPY: IGNORE, OMSIMULATOR: "may not know it (its issue 1188)"},
    "parameters bound to the system": {LIBCOSIM: IGNORE, ECOS: IGNORE, FMPY: IGNORE},
    "parameters bound to a component": {FMPY: IGNORE},
    "a further set for the same component": {LIBCOSIM: "lets the first value count, not the last"},
    "a set of another name than the first one": {ECOS: "applies the sets of one name only"},
    "a prefix of a binding": {LIBCOSIM: "finds no parameter of the bare name", ECOS: "finds no parameter of the bare name"},
    "a parameter mapping": {LIBCOSIM: IGNORE, ECOS: IGNORE},
    "a value for an enumeration by its item": {LIBCOSIM: ENDS, ECOS: REFUSE},
    "a value for an enumeration by its number": {LIBCOSIM: IGNORE, ECOS: IGNORE},
    "a value in another unit than the FMU's": {LIBCOSIM: "takes the number as it is", ECOS: "takes the number as it is"},
    "a connector that is an enumeration": {LIBCOSIM: ENDS, ECOS: "has crashed on it"},
    "a connector without a type": {LIBCOSIM: REFUSE},
    "a connection whose start is an input": {LIBCOSIM: REFUSE, ECOS: IGNORE},
    "a linear transformation": {FMPY: IGNORE, OMSIMULATOR: "does not have it before version 3.0 (its issue 1560)"},
    "a mapping of values": {
        LIBCOSIM: IGNORE,
        ECOS: IGNORE,
        FMPY: IGNORE,
        OMSIMULATOR: "does not have it before version 3.0 (its issue 1560)",
    },
    "units to convert": {
        LIBCOSIM: "passes the number as it is",
        ECOS: "passes the number as it is",
        FMPY: "passes the number as it is",
    },
    "an input that nothing feeds": {FMPY: "may feed it the value of another input"},
    "an FMU of FMI 3.0": {LIBCOSIM: REFUSE},
    "an FMU of FMI 3.0 with arrays": {ECOS: "reads only the first elements, and none of the variables read with them"},
    "an OSP annotation without its namespace on the root element": {LIBCOSIM: REFUSE},
    "no FixedStepMaster annotation": {OMSIMULATOR: "refuses the archive before version 3.0 (its issues 1094, 1318)"},
    "a name that is not an identifier": {OMSIMULATOR: "refuses the archive before version 3.0 (its issue 1094)"},
    "further variants": {
        LIBCOSIM: "runs only SystemStructure.ssd",
        ECOS: "runs only SystemStructure.ssd",
        FMPY: "runs only SystemStructure.ssd",
    },
}
"""Feature -> tool -> what it does. A tool that is not named runs the feature."""


@dataclass(frozen=True)
class Use:
    """A feature where it is used."""

    file: str
    line: int
    feature: str
    what: str = ""

    def __str__(self) -> str:
        effects = EFFECTS[self.feature]
        grouped: dict[str, list[str]] = {}
        for tool, effect in effects.items():
            grouped.setdefault(effect, []).append(tool)
        effects = "; ".join(f"{_and(tools)} {_plural(effect) if len(tools) > 1 else effect}" for effect, tools in grouped.items())
        return f"{self.file}, line {self.line}: {self.feature}{f' ({self.what})' if self.what else ''}: {effects}"


def portable_problems(path: Path | str) -> list[str]:
    """Features of an archive's default description that other tools lack, a line per use. Raises ArchiveError or ModelError."""
    return [str(use) for use in uses(read_archive(read_file(Path(path)), Path(path).name))]


def uses(files: Mapping[str, bytes], *tools: str) -> list[Use]:
    """The features that an archive uses and these tools (default: all) do not have, by file and line."""
    if DESCRIPTION not in files:
        raise ArchiveError(f"no {DESCRIPTION}, so this is not an SSP archive")
    description = read_description(files[DESCRIPTION], DESCRIPTION)
    network = Network(flatten(description, Files(files, Findings())))
    found = [*_of_file(files, description), *_of_structure(network), *_of_parameters(network)]
    asked = set(tools) or {LIBCOSIM, ECOS, FMPY, OMSIMULATOR}
    kept = [use for use in dict.fromkeys(found) if asked & EFFECTS[use.feature].keys()]
    return sorted(kept, key=lambda use: (use.file != DESCRIPTION, use.file, use.line))


def _and(names: list[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _plural(effect: str) -> str:
    verb, _, rest = effect.partition(" ")
    return f"{ {'has': 'have', 'does': 'do', 'passes': 'pass'}.get(verb, verb.removesuffix('s')) } {rest}".strip()


def _of_file(files: Mapping[str, bytes], description: SystemDescription) -> Iterator[Use]:
    """The version, prefixes, annotations and variants."""
    root = parse_xml(files[DESCRIPTION], DESCRIPTION, prefixes=USUAL_PREFIXES)
    if description.version.startswith("2"):
        yield Use(DESCRIPTION, description.line, "version 2.0")
    prefixes = {prefix: root.nsmap.get(prefix) for prefix in ("ssd", "ssc")}
    if any(uri is not None and uri != PREFIXES[prefix] for prefix, uri in prefixes.items()) or root.prefix != "ssd":
        yield Use(DESCRIPTION, description.line, "other prefixes than ssd:, ssc: and ssv:")
    if any(OSP_URI in annotation.xml for annotation in description.all_annotations()) and OSP_URI not in root.nsmap.values():
        yield Use(DESCRIPTION, description.line, "an OSP annotation without its namespace on the root element")
    if not any(a.type == OMS_TYPE and "FixedStepMaster" in a.xml for a in description.all_annotations()):
        yield Use(DESCRIPTION, description.line, "no FixedStepMaster annotation")
    for name in sorted(files):
        if "/" not in name and PurePosixPath(name).suffix == ".ssd" and name != DESCRIPTION:
            yield Use(DESCRIPTION, description.line, "further variants", name)


def _of_structure(network: Network) -> Iterator[Use]:
    """Elements, connectors and connections."""
    for place in network.places.values():
        element, path, scope = place.component or place.element, place.path, place.outer or place.scope
        if scope.root:
            continue  # it is in another file
        if path and not re.fullmatch(r"[A-Za-z_]\w*", element.name, re.ASCII):
            yield Use(DESCRIPTION, element.line, "a name that is not an identifier", repr(element.name))
        if isinstance(element, SystemElement) and path:
            yield Use(DESCRIPTION, element.line, "a nested system", path)
        if isinstance(element, DictionaryReference):
            yield Use(DESCRIPTION, element.line, "a signal dictionary", path)
        for connector in element.connectors:
            name = scope.label(path, connector.name)
            if connector.type is None:
                yield Use(DESCRIPTION, connector.line, "a connector without a type", name)
            elif connector.type.name == "Enumeration":
                yield Use(DESCRIPTION, connector.line, "a connector that is an enumeration", name)
            elif connector.type.name not in TYPES_1:
                yield Use(DESCRIPTION, connector.line, "a type of version 2.0", name)
        if isinstance(element, SystemElement):
            yield from _of_system(place, element)
        elif isinstance(element, Component):
            yield from _of_component(network.fmus.get(path), path, element)


def _of_system(place: Place, system: SystemElement) -> Iterator[Use]:
    fed: set[tuple[str | None, str]] = set()
    label = place.scope.label
    for connection in system.connections:
        starts, stops = connection.start_element or None, connection.end_element or None
        ends = ((starts, connection.start_connector), (stops, connection.end_connector))
        fed |= set(ends)
        if None in (starts, stops):
            name = label(place.path, next(c for e, c in ends if e is None))
            yield Use(DESCRIPTION, connection.line, "a connection of the system's own connector", name)
        else:
            yield from _of_connection(place.scope, system, connection)
        if connection.transformation is not None:
            linear = isinstance(connection.transformation, LinearTransformation)
            yield Use(DESCRIPTION, connection.line, "a linear transformation" if linear else "a mapping of values")
    for connector in system.connectors if not place.path else []:
        if (None, connector.name) not in fed:
            yield Use(DESCRIPTION, connector.line, "a connector of the system that nothing is connected to", connector.name)
    for element in system.elements:
        for connector in element.connectors:
            if isinstance(element, Component) and connector.kind == "input" and (element.name, connector.name) not in fed:
                name = label(f"{place.path}.{element.name}".removeprefix("."), connector.name)
                yield Use(DESCRIPTION, connector.line, "an input that nothing feeds", name)


def _of_connection(scope: Scope, system: SystemElement, connection: Connection) -> Iterator[Use]:
    elements = [system.element(name or "") for name in (connection.start_element, connection.end_element)]
    names = (connection.start_connector, connection.end_connector)
    connectors = [element.connector(name) if element else None for element, name in zip(elements, names, strict=True)]
    if connectors[0] is not None and connectors[0].kind == "input" and isinstance(elements[0], Component):
        what = f"{connection.start_element}.{connection.start_connector}"
        yield Use(DESCRIPTION, connection.line, "a connection whose start is an input", what)
    one, other = (scope.units.get(c.type.unit or "") if c is not None and c.type is not None else None for c in connectors)
    converted = one and other and not units_differ(one, other) and (one.factor, one.offset) != (other.factor, other.offset)
    if one and other and converted and not connection.suppress_unit_conversion:
        yield Use(DESCRIPTION, connection.line, "units to convert", f"{one.name} to {other.name}")


def _of_component(fmu: Fmu | None, path: str, component: Component) -> Iterator[Use]:
    if component.type in (SSD_TYPE, SSP_TYPE):
        yield Use(DESCRIPTION, component.line, "a component that is another system", path)
    elif fmu is not None and fmu.version == 3:
        yield Use(DESCRIPTION, component.line, "an FMU of FMI 3.0", fmu.name)
        if any(variable.dimensions for variable in fmu.description.modelVariables):
            yield Use(DESCRIPTION, component.line, "an FMU of FMI 3.0 with arrays", fmu.name)


def _of_parameters(network: Network) -> Iterator[Use]:
    """Bindings and the values of sets."""
    first_name: str | None = None
    for place in network.places.values():
        own, scope = place.component or place.element, place.outer or place.scope
        label = scope.label(place.path)
        for i, binding in enumerate(own.bindings if not scope.root else ()):
            kind = "parameters bound to the system" if isinstance(own, SystemElement) else "parameters bound to a component"
            yield Use(DESCRIPTION, binding.line, kind, label)
            if i:
                yield Use(DESCRIPTION, binding.line, "a further set for the same component", label)
            if binding.prefix:
                yield Use(DESCRIPTION, binding.line, "a prefix of a binding", repr(binding.prefix))
            if binding.mapping is not None:
                yield Use(DESCRIPTION, binding.mapping.line, "a parameter mapping", label)
            values = bound_values(network, place, binding, scope)
            if values is not None:
                first_name = first_name or values.name
                if values.name != first_name:
                    yield Use(DESCRIPTION, binding.line, "a set of another name than the first one", repr(values.name))
                yield from _of_set(network, place, values, binding.prefix)


def _of_set(network: Network, place: Place, values: ParameterSet, prefix: str) -> Iterator[Use]:
    units = {unit.name: unit for unit in values.units}
    for parameter in values.parameters:
        if parameter.type == "Enumeration":
            yield Use(values.file, parameter.line, "a value for an enumeration by its item", parameter.name)
        for node in targets(network, place, f"{prefix}{parameter.name}") or ():
            meaning = network.taken(node) if network.is_variable(node) else None
            if meaning is None:
                continue
            if meaning.kind == "enumeration" and kind_of_type(parameter.type) == "integer":
                yield Use(values.file, parameter.line, "a value for an enumeration by its number", parameter.name)
            own, theirs = units.get(parameter.unit or ""), meaning.unit
            if own is not None and theirs is not None and (own.factor, own.offset) != (theirs.factor, theirs.offset):
                what = f"{parameter.name}, {parameter.unit}"
                yield Use(values.file, parameter.line, "a value in another unit than the FMU's", what)
