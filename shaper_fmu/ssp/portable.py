"""What of an SSP archive other tools ignore, refuse, or do otherwise.

Measured with libcosim (libcosimpy 0.0.6), ecos (ecospy 0.7.2) and fmpy.ssp (FMPy 0.3.32) on archives that differ from a plain one
in the feature named (tests/test_ssp_portable.py). OMSimulator was not run: what is told of it stands in its own issues, whose
numbers are given.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.ssp.annotations import OMS_TYPE
from shaper_fmu.ssp.check_parameters import Names, Target
from shaper_fmu.ssp.check_scene import Scene, do_not_convert, find_variable, kind_of_type, unit_named
from shaper_fmu.ssp.check_structure import Place, label, places
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    DictionaryReference,
    Element,
    Parameter,
    ParameterSet,
    SystemElement,
)
from shaper_fmu.ssp.document_parts import LinearTransformation
from shaper_fmu.ssp.names import DESCRIPTION, FMU_TYPE, OSP_URI, PREFIXES, SSD_TYPE, SSP_TYPE, TYPES_1, USUAL_PREFIXES
from shaper_fmu.ssp.read import read_description, read_parameter_set
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
    "an FMU of FMI 3.0 with arrays": {ECOS: "reads the first elements only, and none of what is read with them"},
    "an OSP annotation without its namespace on the root element": {LIBCOSIM: REFUSE},
    "no FixedStepMaster annotation": {OMSIMULATOR: "refuses the archive before version 3.0 (its issues 1094, 1318)"},
    "a name that is no identifier": {OMSIMULATOR: "refuses the archive before version 3.0 (its issue 1094)"},
    "further variants": {
        LIBCOSIM: "runs SystemStructure.ssd alone",
        ECOS: "runs SystemStructure.ssd alone",
        FMPY: "runs SystemStructure.ssd alone",
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
        told = "; ".join(f"{_and(tools)} {_plural(effect) if len(tools) > 1 else effect}" for effect, tools in grouped.items())
        return f"{self.file}, line {self.line}: {self.feature}{f' ({self.what})' if self.what else ''}: {told}"


def portable_problems(path: Path | str) -> list[str]:
    """What of an archive's default description other tools do not do, a line for each use. Raises ArchiveError or ModelError."""
    return [str(use) for use in uses(read_archive(read_file(Path(path)), Path(path).name))]


def uses(files: Mapping[str, bytes], *tools: str) -> list[Use]:
    """The features that an archive uses and these tools (default: all) do not have, by file and line."""
    if DESCRIPTION not in files:
        raise ArchiveError(f"no {DESCRIPTION}, so this is not an SSP archive")
    scene = Scene(files, read_description(files[DESCRIPTION], DESCRIPTION), DESCRIPTION)
    found = [*_of_file(scene), *_of_structure(scene), *_Parameters(scene).uses()]
    asked = set(tools) or {LIBCOSIM, ECOS, FMPY, OMSIMULATOR}
    kept = [use for use in dict.fromkeys(found) if asked & EFFECTS[use.feature].keys()]
    return sorted(kept, key=lambda use: (use.file != DESCRIPTION, use.file, use.line))


def _and(names: list[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def _plural(effect: str) -> str:
    verb, _, rest = effect.partition(" ")
    return f"{ {'has': 'have', 'does': 'do', 'passes': 'pass'}.get(verb, verb.removesuffix('s')) } {rest}".strip()


def _of_file(scene: Scene) -> Iterator[Use]:
    """The version, prefixes, annotations and variants."""
    description, root = scene.description, parse_xml(scene.files[DESCRIPTION], DESCRIPTION, prefixes=USUAL_PREFIXES)
    if description.version.startswith("2"):
        yield Use(DESCRIPTION, description.line, "version 2.0")
    prefixes = {prefix: root.nsmap.get(prefix) for prefix in ("ssd", "ssc")}
    if any(uri is not None and uri != PREFIXES[prefix] for prefix, uri in prefixes.items()) or root.prefix != "ssd":
        yield Use(DESCRIPTION, description.line, "other prefixes than ssd:, ssc: and ssv:")
    if any(OSP_URI in annotation.xml for annotation in description.all_annotations()) and OSP_URI not in root.nsmap.values():
        yield Use(DESCRIPTION, description.line, "an OSP annotation without its namespace on the root element")
    if not any(a.type == OMS_TYPE and "FixedStepMaster" in a.xml for a in description.all_annotations()):
        yield Use(DESCRIPTION, description.line, "no FixedStepMaster annotation")
    for name in sorted(scene.files):
        if "/" not in name and PurePosixPath(name).suffix == ".ssd" and name != DESCRIPTION:
            yield Use(DESCRIPTION, description.line, "further variants", name)


def _of_structure(scene: Scene) -> Iterator[Use]:
    """Elements, connectors and connections."""
    for place, element in places(scene.description.system):
        if place and not re.fullmatch(r"[A-Za-z_]\w*", element.name, re.ASCII):
            yield Use(DESCRIPTION, element.line, "a name that is no identifier", repr(element.name))
        if isinstance(element, SystemElement) and place:
            yield Use(DESCRIPTION, element.line, "a nested system", label(place))
        if isinstance(element, DictionaryReference):
            yield Use(DESCRIPTION, element.line, "a signal dictionary", label(place))
        for connector in element.connectors:
            name = label(place, connector.name)
            if connector.type is None:
                yield Use(DESCRIPTION, connector.line, "a connector without a type", name)
            elif connector.type.name == "Enumeration":
                yield Use(DESCRIPTION, connector.line, "a connector that is an enumeration", name)
            elif connector.type.name not in TYPES_1:
                yield Use(DESCRIPTION, connector.line, "a type of version 2.0", name)
        if isinstance(element, SystemElement):
            yield from _of_system(scene, place, element)
        if isinstance(element, Component):
            yield from _of_component(scene, place, element)


def _of_system(scene: Scene, place: Place, system: SystemElement) -> Iterator[Use]:
    fed: set[tuple[str | None, str]] = set()
    for connection in system.connections:
        starts, stops = connection.start_element or None, connection.end_element or None
        ends = ((starts, connection.start_connector), (stops, connection.end_connector))
        fed |= set(ends)
        if None in (starts, stops):
            yield Use(
                DESCRIPTION,
                connection.line,
                "a connection of the system's own connector",
                label(place, next(c for e, c in ends if e is None)),
            )
        else:
            yield from _of_connection(scene, system, connection)
        if connection.transformation is not None:
            linear = isinstance(connection.transformation, LinearTransformation)
            yield Use(DESCRIPTION, connection.line, "a linear transformation" if linear else "a mapping of values")
    for connector in system.connectors if not place else []:
        if (None, connector.name) not in fed:
            yield Use(DESCRIPTION, connector.line, "a connector of the system that nothing is connected to", connector.name)
    for element in system.elements:
        for connector in element.connectors:
            if isinstance(element, Component) and connector.kind == "input" and (element.name, connector.name) not in fed:
                name = label((*place, element.name), connector.name)
                yield Use(DESCRIPTION, connector.line, "an input that nothing feeds", name)


def _of_connection(scene: Scene, system: SystemElement, connection: Connection) -> Iterator[Use]:
    elements = [system.element(name or "") for name in (connection.start_element, connection.end_element)]
    names = (connection.start_connector, connection.end_connector)
    connectors = [element.connector(name) if element else None for element, name in zip(elements, names, strict=True)]
    if connectors[0] is not None and connectors[0].kind == "input" and isinstance(elements[0], Component):
        what = f"{connection.start_element}.{connection.start_connector}"
        yield Use(DESCRIPTION, connection.line, "a connection whose start is an input", what)
    one, other = (scene.meaning(c.type) if c is not None and c.type is not None else None for c in connectors)
    if one and other and one.definition and other.definition and not do_not_convert(one, other):
        scales = [(meaning.definition.factor, meaning.definition.offset) for meaning in (one, other) if meaning.definition]
        if scales[0] != scales[1] and not connection.suppress_unit_conversion:
            yield Use(DESCRIPTION, connection.line, "units to convert", f"{one.unit} to {other.unit}")


def _of_component(scene: Scene, place: Place, component: Component) -> Iterator[Use]:
    if component.type in (SSD_TYPE, SSP_TYPE):
        yield Use(DESCRIPTION, component.line, "a component that is another system", label(place))
        return
    fmu = scene.fmu(component)
    if fmu is not None and fmu.version == 3:
        yield Use(DESCRIPTION, component.line, "an FMU of FMI 3.0", fmu.name)
        if any(variable.dimensions for variable in fmu.description.modelVariables):
            yield Use(DESCRIPTION, component.line, "an FMU of FMI 3.0 with arrays", fmu.name)


class _Parameters:
    """Bindings and the values of sets."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.first_name: str | None = None
        self.fmus: dict[Place, Fmu] = {}
        for place, element in places(scene.description.system):
            fmu = scene.fmu(element) if isinstance(element, Component) and element.type == FMU_TYPE else None
            if fmu is not None:
                self.fmus[place] = fmu

    def uses(self) -> Iterator[Use]:
        for place, element in places(self.scene.description.system):
            for i, binding in enumerate(element.bindings):
                to_system = isinstance(element, SystemElement)
                kind = "parameters bound to the system" if to_system else "parameters bound to a component"
                yield Use(DESCRIPTION, binding.line, kind, label(place))
                if i:
                    yield Use(DESCRIPTION, binding.line, "a further set for the same component", label(place))
                if binding.prefix:
                    yield Use(DESCRIPTION, binding.line, "a prefix of a binding", repr(binding.prefix))
                if binding.mapping is not None:
                    yield Use(DESCRIPTION, binding.mapping.line, "a parameter mapping", label(place))
                values, file = binding.values, DESCRIPTION
                if values is None and binding.source is not None:
                    file = self.scene.resource(binding.source, binding.line, "") or ""
                    values = self._read(file)
                if values is not None:
                    yield from self._of_set(values, file, binding.line, place, element, binding.prefix)

    def _read(self, file: str) -> ParameterSet | None:
        if not file:
            return None
        try:
            return read_parameter_set(self.scene.files[file], file)
        except (ModelError, ArchiveError):  # that is for the check to tell
            return None

    def _of_set(self, values: ParameterSet, file: str, line: int, place: Place, element: Element, prefix: str) -> Iterator[Use]:
        self.first_name = self.first_name or values.name
        if values.name != self.first_name:
            yield Use(DESCRIPTION, line, "a set of another name than the first one", repr(values.name))
        for parameter in values.parameters:
            if parameter.type == "Enumeration":
                yield Use(file, parameter.line, "a value for an enumeration by its item", parameter.name)
            targets = Names(self.scene, self.fmus).find(place, element, f"{prefix}{parameter.name}") or []
            yield from (use for target in targets for use in _of_value(values, parameter, file, target))


def _of_value(values: ParameterSet, parameter: Parameter, file: str, target: Target) -> Iterator[Use]:
    if (
        target.fmu is None
        or target.meaning is None
        or find_variable(target.fmu, str(target.variable and target.variable.name)) is None
    ):
        return
    if target.meaning.kind == "enumeration" and kind_of_type(parameter.type) == "integer":
        yield Use(file, parameter.line, "a value for an enumeration by its number", parameter.name)
    own, theirs = unit_named(parameter.unit, values.units), target.meaning.definition
    if own is not None and theirs is not None and (own.factor, own.offset) != (theirs.factor, theirs.offset):
        yield Use(file, parameter.line, "a value in another unit than the FMU's", f"{parameter.name}, {parameter.unit}")
