"""Reads SSP files, versions 1.0 and 2.0, into the classes of document.py.

Reading is lenient where no meaning is lost: the order of elements is free, and what is unknown is kept as it is. Where
meaning would be lost (a missing name, a number that is none) it is a ModelError with every such place, by file and line.
Every function raises ArchiveError for what is not well-formed XML or has a document type.
"""

from __future__ import annotations

from typing import Any

from lxml import etree

from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    Connector,
    DefaultExperiment,
    DictionaryEntry,
    DictionaryReference,
    DictionarySource,
    MappingEntry,
    MappingReference,
    Parameter,
    ParameterBinding,
    ParameterMapping,
    ParameterSet,
    SignalDictionary,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.document_parts import DataType
from shaper_fmu.ssp.names import DICTIONARY_TYPE, FMU_TYPE, MAPPING_TYPE, SET_TYPE, SSB, SSD, SSM, SSV, TYPES_2, USUAL_PREFIXES
from shaper_fmu.ssp.read_parts import DIMENSION, TRANSFORMATION_TAGS, TYPE_TAGS, Reader, elements, local, other_prefixes, raw
from shaper_fmu.xml_files import parse_xml

_VALUE_TYPES = tuple(f"{SSV}{name}" for name in TYPES_2 if name != "Clock")
_ELEMENT_CHILDREN = (f"{SSD}Connectors", f"{SSD}ParameterBindings")
_SYSTEM_CHILDREN = tuple(f"{SSD}{name}" for name in ("Elements", "Connections", "SignalDictionaries"))


def read_description(content: bytes, file: str) -> SystemDescription:
    """A system structure description (.ssd) called `file`."""
    reader, root = _open(content, file, f"{SSD}SystemStructureDescription", "system structure")
    children = tuple(f"{SSD}{name}" for name in ("System", "Enumerations", "Units", "DefaultExperiment"))
    system = root.find(children[0])
    if system is None:
        raise ModelError([f"{file}: no System"])
    description = SystemDescription(
        reader.text(root, "name"),
        _system(reader, system),
        reader.enumerations(root, children[1]),
        reader.units(root, children[2]),
        _experiment(reader, root.find(children[3])),
        **_file_fields(reader, root, ("name",), children),
    )
    reader.raise_problems(description)
    return description


def read_parameter_set(content: bytes, file: str) -> ParameterSet:
    """A parameter set (.ssv) called `file`."""
    reader, root = _open(content, file, f"{SSV}ParameterSet", "parameter set")
    found = _parameter_set(reader, root)
    reader.raise_problems(found)
    return found


def read_mapping(content: bytes, file: str) -> ParameterMapping:
    """A parameter mapping (.ssm) called `file`."""
    reader, root = _open(content, file, f"{SSM}ParameterMapping", "parameter mapping")
    found = _parameter_mapping(reader, root)
    reader.raise_problems(found)
    return found


def read_dictionary(content: bytes, file: str) -> SignalDictionary:
    """A signal dictionary (.ssb) called `file`."""
    reader, root = _open(content, file, f"{SSB}SignalDictionary", "signal dictionary")
    found = _signal_dictionary(reader, root)
    reader.raise_problems(found)
    return found


def _open(content: bytes, file: str, tag: str, what: str) -> tuple[Reader, etree._Element]:
    root = parse_xml(content, file, prefixes=USUAL_PREFIXES)
    if root.tag != tag:
        raise ModelError([f"{file}: not an SSP {what} (root {root.tag}; expected {tag})"])
    return Reader(file), root


def _experiment(reader: Reader, node: etree._Element | None) -> DefaultExperiment | None:
    if node is None:
        return None
    times = reader.number(node, "startTime"), reader.number(node, "stopTime")
    return DefaultExperiment(*times, **reader.rest(node, ("startTime", "stopTime")))


def _system(reader: Reader, node: etree._Element) -> SystemElement:
    readers = {
        f"{SSD}Component": _component,
        f"{SSD}System": _system,
        f"{SSD}SignalDictionaryReference": _dictionary_reference,
    }
    inner = []
    for child in _grandchildren(node, "Elements"):
        if child.tag in readers:
            inner.append(readers[str(child.tag)](reader, child))
        else:
            reader.problem(child, f"{local(child)} is not a kind of element; a system has components, systems and dictionaries")
    return SystemElement(
        reader.text(node, "name"),
        *_interface(reader, node),
        inner,
        [_connection(reader, child) for child in _grandchildren(node, "Connections")],
        [_dictionary_source(reader, child) for child in _grandchildren(node, "SignalDictionaries")],
        **reader.rest(node, ("name",), (*_ELEMENT_CHILDREN, *_SYSTEM_CHILDREN)),
    )


def _component(reader: Reader, node: etree._Element) -> Component:
    return Component(
        reader.text(node, "name"),
        *_interface(reader, node),
        node.get("source"),
        node.get("type", FMU_TYPE),
        node.get("implementation", "any"),
        **reader.rest(node, ("name", "source", "type", "implementation"), _ELEMENT_CHILDREN),
    )


def _dictionary_reference(reader: Reader, node: etree._Element) -> DictionaryReference:
    rest = reader.rest(node, ("name", "dictionary"), _ELEMENT_CHILDREN)
    return DictionaryReference(reader.text(node, "name"), *_interface(reader, node), reader.text(node, "dictionary"), **rest)


def _interface(reader: Reader, node: etree._Element) -> tuple[list[Connector], list[ParameterBinding]]:
    connectors = [_connector(reader, child) for child in _grandchildren(node, "Connectors")]
    return connectors, [_binding(reader, child) for child in _grandchildren(node, "ParameterBindings")]


def _connector(reader: Reader, node: etree._Element) -> Connector:
    clock = f"{SSD}Clock"  # ssc:Clock is a type
    return Connector(
        reader.text(node, "name"),
        reader.text(node, "kind"),
        reader.data_type(node),
        reader.dimensions(node),
        [reader.text(child, "name") for child in node.iterchildren(clock)],
        **reader.rest(node, ("name", "kind"), (*TYPE_TAGS, DIMENSION, clock)),
    )


def _binding(reader: Reader, node: etree._Element) -> ParameterBinding:
    kind = node.get("type", SET_TYPE)
    content = [child for group in node.iterchildren(f"{SSD}ParameterValues") for child in elements(group)]
    values, foreign = _inline(content, f"{SSV}ParameterSet") if kind == SET_TYPE else (None, content)
    mapping = node.find(f"{SSD}ParameterMapping")
    attributes = ("type", "source", "sourceBase", "prefix")
    return ParameterBinding(
        node.get("source"),
        _parameter_set(reader, values) if values is not None else None,
        node.get("prefix", ""),
        _mapping_reference(reader, mapping) if mapping is not None else None,
        kind,
        reader.choice(node, "sourceBase", ("SSD", "component")),
        [raw(child) for child in foreign],
        **reader.rest(node, attributes, (f"{SSD}ParameterValues", f"{SSD}ParameterMapping")),
    )


def _mapping_reference(reader: Reader, node: etree._Element) -> MappingReference:
    tag = f"{SSM}ParameterMapping"
    mapping = node.find(tag)
    return MappingReference(
        node.get("source"),
        _parameter_mapping(reader, mapping) if mapping is not None else None,
        node.get("type", MAPPING_TYPE),
        reader.choice(node, "sourceBase", ("SSD", "component")),
        **reader.rest(node, ("type", "source", "sourceBase"), (tag,)),
    )


def _inline(content: list[etree._Element], tag: str) -> tuple[etree._Element | None, list[etree._Element]]:
    """The first element with this tag, and the others."""
    found = next((child for child in content if child.tag == tag), None)
    return found, [child for child in content if child is not found]


def _connection(reader: Reader, node: etree._Element) -> Connection:
    attributes = tuple(f"{side}{what}" for side in ("start", "end") for what in ("Element", "Connector", "Indices"))
    return Connection(
        node.get("startElement"),
        reader.text(node, "startConnector"),
        node.get("endElement"),
        reader.text(node, "endConnector"),
        reader.transformation(node),
        reader.flag(node, "suppressUnitConversion"),
        _indices(reader, node, "startIndices"),
        _indices(reader, node, "endIndices"),
        **reader.rest(node, (*attributes, "suppressUnitConversion"), TRANSFORMATION_TAGS),
    )


def _indices(reader: Reader, node: etree._Element, key: str) -> list[int]:
    texts = node.get(key, "").split()
    if not all(text.isdecimal() for text in texts):
        reader.problem(node, f"{key} = {node.get(key)!r} is not a list of indices")
        return []
    return [int(text) for text in texts]


def _dictionary_source(reader: Reader, node: etree._Element) -> DictionarySource:
    tag = f"{SSB}SignalDictionary"
    inline = node.find(tag)
    return DictionarySource(
        reader.text(node, "name"),
        node.get("source"),
        _signal_dictionary(reader, inline) if inline is not None else None,
        node.get("type", DICTIONARY_TYPE),
        **reader.rest(node, ("name", "source", "type"), (tag,)),
    )


def _grandchildren(node: etree._Element, group: str) -> list[etree._Element]:
    return [child for found in node.iterchildren(f"{SSD}{group}") for child in elements(found)]


def _file_fields(reader: Reader, root: etree._Element, attributes: tuple[str, ...], children: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a root element (`File`)."""
    version = root.get("version", "1.0")  # it has to be there, but nothing else could be meant
    if version.split(".")[0] not in ("1", "2"):
        reader.problem(root, f"{local(root)} of version {version}; versions 1.0 and 2.0 of the standard are known")
    alone = root.getparent() is None
    rest = reader.rest(root, ("version", *attributes), children)
    return {"version": version, "namespaces": other_prefixes(root) if alone else {}, "file": reader.file, **rest}


def _parameter_set(reader: Reader, root: etree._Element) -> ParameterSet:
    tags = {name: f"{SSV}{name}" for name in ("Parameters", "Enumerations", "Units")}
    groups = root.findall(tags["Parameters"])
    if not groups:
        reader.problem(root, "ParameterSet has no Parameters")
    return ParameterSet(
        reader.text(root, "name"),
        [_parameter(reader, node) for group in groups for node in group.iterchildren(f"{SSV}Parameter")],
        reader.enumerations(root, tags["Enumerations"]),
        reader.units(root, tags["Units"]),
        **_file_fields(reader, root, ("name",), tuple(tags.values())),
    )


def _parameter(reader: Reader, node: etree._Element) -> Parameter:
    name = reader.text(node, "name")
    rest = reader.rest(node, ("name",), (*_VALUE_TYPES, DIMENSION))
    found = [child for child in elements(node) if child.tag in _VALUE_TYPES]
    if len(found) != 1:
        reader.problem(node, f"parameter {name!r} needs one element with a value")
        return Parameter(name, "Real", None, **rest)
    child = found[0]
    items = [reader.text(item, "value") for item in child.iterchildren(f"{SSV}Value")]
    value = child.get("value")
    if (value is None) == (not items):
        reader.problem(node, f"parameter {name!r} needs one element with a value")
    own = ("value", "unit", "name") if local(child) == "Enumeration" else ("value", "unit")
    attributes = {str(key): str(text) for key, text in child.attrib.items() if key not in own}
    enumeration = child.get("name") if local(child) == "Enumeration" else None
    dimensions = reader.dimensions(node)
    return Parameter(name, local(child), value, child.get("unit"), enumeration, items, dimensions, attributes, **rest)


def _parameter_mapping(reader: Reader, root: etree._Element) -> ParameterMapping:
    tag = f"{SSM}MappingEntry"
    return ParameterMapping(
        [_mapping_entry(reader, node) for node in root.iterchildren(tag)], **_file_fields(reader, root, (), (tag,))
    )


def _mapping_entry(reader: Reader, node: etree._Element) -> MappingEntry:
    return MappingEntry(
        reader.text(node, "source"),
        reader.text(node, "target"),
        reader.transformation(node),
        reader.flag(node, "suppressUnitConversion"),
        **reader.rest(node, ("source", "target", "suppressUnitConversion"), TRANSFORMATION_TAGS),
    )


def _signal_dictionary(reader: Reader, root: etree._Element) -> SignalDictionary:
    tags = {name: f"{SSB}{name}" for name in ("DictionaryEntry", "Enumerations", "Units")}
    return SignalDictionary(
        [_dictionary_entry(reader, node) for node in root.iterchildren(tags["DictionaryEntry"])],
        reader.enumerations(root, tags["Enumerations"]),
        reader.units(root, tags["Units"]),
        **_file_fields(reader, root, (), tuple(tags.values())),
    )


def _dictionary_entry(reader: Reader, node: etree._Element) -> DictionaryEntry:
    name, type_ = reader.text(node, "name"), reader.data_type(node)
    if type_ is None:
        reader.problem(node, f"dictionary entry {name!r} has no type")
    children = (*TYPE_TAGS, DIMENSION)
    return DictionaryEntry(name, type_ or DataType("Real"), reader.dimensions(node), **reader.rest(node, ("name",), children))
