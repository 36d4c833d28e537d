"""Reading SSP 1.0: SystemStructure.ssd and parameter sets (.ssv).

What is read so far: a flat system of components, connections, inline or external parameter sets of components, the
default experiment and the step size in the OSP annotation. Anything else that would change the meaning is an error,
not ignored.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from lxml import etree

from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.ssp.structure import Connection, Element, ParameterValue, Structure

SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"
OSP = "{http://opensimulationplatform.com/SSP/OSPAnnotations}"
DESCRIPTION = "SystemStructure.ssd"
_FMU = "application/x-fmu-sharedlibrary"

_NOT_YET = {
    f"{SSD}System/{SSD}ParameterBindings": "parameter bindings of the system",
    f"{SSD}System/{SSD}Connectors": "connectors of the system",
    f"{SSD}System/{SSD}Elements/{SSD}System": "nested systems",
    f"{SSD}System/{SSD}Elements/{SSD}SignalDictionaryReference": "signal dictionaries",
    f".//{SSD}ParameterMapping": "parameter mappings",
    f".//{SSD}LinearTransformation": "transformations",
    f".//{SSD}BooleanMappingTransformation": "transformations",
    f".//{SSD}IntegerMappingTransformation": "transformations",
    f".//{SSD}EnumerationMappingTransformation": "transformations",
}


def read_structure(files: Mapping[str, bytes]) -> Structure:
    """The structure in an archive's files (name -> content). Raises ArchiveError or ModelError, with file and line."""
    if DESCRIPTION not in files:
        raise ArchiveError(f"no {DESCRIPTION}, so this is not an SSP archive")
    root = parse_xml(files[DESCRIPTION], DESCRIPTION)
    if root.tag != f"{SSD}SystemStructureDescription" or root.get("version") != "1.0":
        raise ModelError([f"{DESCRIPTION}: not an SSP 1.0 system structure (root {root.tag}, version {root.get('version')})"])
    problems = [
        f"{DESCRIPTION}, line {found.sourceline}: {what} are not supported yet"
        for path, what in _NOT_YET.items()
        for found in root.findall(path)
    ]
    if problems:
        raise ModelError(problems)
    system = root.find(f"{SSD}System")
    if system is None:
        raise ModelError([f"{DESCRIPTION}: no System"])
    experiment = root.find(f"{SSD}DefaultExperiment")
    algorithm = root.find(f".//{OSP}FixedStepAlgorithm")
    return Structure(
        name=root.get("name") or "system",
        elements=[_element(node, files) for node in system.iterfind(f"{SSD}Elements/{SSD}Component")],
        connections=[_connection(node) for node in system.iterfind(f"{SSD}Connections/{SSD}Connection")],
        start_time=_time(experiment, "startTime"),
        stop_time=_time(experiment, "stopTime"),
        step_size=_time(algorithm, "baseStepSize"),
    )


def read_parameter_set(content: bytes, name: str) -> list[ParameterValue]:
    """The values of a parameter set file (.ssv) called `name`. Raises ArchiveError or ModelError, with file and line."""
    return _values(parse_xml(content, name), name)


def parse_xml(content: bytes, name: str) -> etree._Element:
    """The root element, without entities, DTDs or network. Raises ArchiveError."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True)
    try:
        root = etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        raise ArchiveError(f"{name}: not well-formed: {error}") from None
    if root.getroottree().docinfo.doctype:
        raise ArchiveError(f"{name}: document type declarations are not accepted")
    return root


def _attribute(node: etree._Element, key: str, file: str = DESCRIPTION) -> str:
    value = node.get(key)
    if value is None:
        raise ModelError([f"{file}, line {node.sourceline}: {etree.QName(node).localname} has no {key}"])
    return value


def _time(node: etree._Element | None, key: str) -> float | None:
    text = node.get(key) if node is not None else None
    try:
        value = None if text is None else float(text)
        if value is not None and not math.isfinite(value):
            raise ValueError
        return value
    except ValueError:
        raise ModelError([f"{DESCRIPTION}: {key} = {text!r} is not a number"]) from None


def _element(node: etree._Element, files: Mapping[str, bytes]) -> Element:
    if node.get("type", _FMU) != _FMU or node.get("implementation", "any") not in ("any", "CoSimulation"):
        raise ModelError([f"{DESCRIPTION}, line {node.sourceline}: only co-simulation FMUs can be components so far"])
    parameters = []
    for binding in node.iterfind(f"{SSD}ParameterBindings/{SSD}ParameterBinding"):
        if binding.get("prefix"):
            raise ModelError([f"{DESCRIPTION}, line {binding.sourceline}: prefixes are not supported yet"])
        source = binding.get("source")
        if source is None:
            sets = binding.findall(f"{SSD}ParameterValues/{SSV}ParameterSet")
            parameters += [value for found in sets for value in _values(found, DESCRIPTION)]
        elif source not in files:
            raise ModelError([f"{DESCRIPTION}, line {binding.sourceline}: {source} is missing in the archive"])
        else:
            parameters += read_parameter_set(files[source], source)
    connectors = {_attribute(c, "name"): c.get("kind", "") for c in node.iterfind(f"{SSD}Connectors/{SSD}Connector")}
    return Element(_attribute(node, "name"), _attribute(node, "source"), node.sourceline or 0, connectors, parameters)


def _values(parameter_set: etree._Element, file: str) -> list[ParameterValue]:
    if parameter_set.tag != f"{SSV}ParameterSet":
        raise ModelError([f"{file}: not an SSP 1.0 parameter set (root {parameter_set.tag})"])
    values = []
    for node in parameter_set.iterfind(f"{SSV}Parameters/{SSV}Parameter"):
        name = _attribute(node, "name", file)
        if len(node) != 1 or node[0].get("value") is None:
            raise ModelError([f"{file}, line {node.sourceline}: parameter {name!r} needs one element with a value"])
        values.append(ParameterValue(name, node[0].get("value", ""), node[0].get("unit"), node.sourceline or 0))
    return values


def _connection(node: etree._Element) -> Connection:
    start, end = ((_attribute(node, f"{side}Element"), _attribute(node, f"{side}Connector")) for side in ("start", "end"))
    return Connection(start, end, node.sourceline or 0)
