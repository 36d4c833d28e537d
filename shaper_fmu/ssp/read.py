"""Reading SSP files, versions 1.0 and 2.0, as the classes of document.py.

Reading is lenient where no meaning is lost: the order of elements is free, and what is unknown is kept as it is. Where
meaning would be lost (a missing name, a number that is none) it is a ModelError with every such place, by file and line.
Every function raises ArchiveError for what is not well-formed XML or has a document type.
"""

from __future__ import annotations

from lxml import etree

from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    Connector,
    DefaultExperiment,
    DictionaryReference,
    DictionarySource,
    MappingReference,
    ParameterBinding,
    ParameterMapping,
    ParameterSet,
    SignalDictionary,
    SystemDescription,
    SystemElement,
)
from shaper_fmu.ssp.names import DICTIONARY_TYPE, FMU_TYPE, MAPPING_TYPE, SET_TYPE, SSB, SSD, SSM, SSV, USUAL_PREFIXES
from shaper_fmu.ssp.read_parts import DIMENSION, TRANSFORMATION_TAGS, TYPE_TAGS, Reader, elements, local, raw
from shaper_fmu.ssp.read_values import file_fields, parameter_mapping, parameter_set, signal_dictionary
from shaper_fmu.xml_files import parse_xml

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
        **file_fields(reader, root, ("name",), children),
    )
    reader.raise_problems(description)
    return description


def read_parameter_set(content: bytes, file: str) -> ParameterSet:
    """A parameter set (.ssv) called `file`."""
    reader, root = _open(content, file, f"{SSV}ParameterSet", "parameter set")
    found = parameter_set(reader, root)
    reader.raise_problems(found)
    return found


def read_mapping(content: bytes, file: str) -> ParameterMapping:
    """A parameter mapping (.ssm) called `file`."""
    reader, root = _open(content, file, f"{SSM}ParameterMapping", "parameter mapping")
    found = parameter_mapping(reader, root)
    reader.raise_problems(found)
    return found


def read_dictionary(content: bytes, file: str) -> SignalDictionary:
    """A signal dictionary (.ssb) called `file`."""
    reader, root = _open(content, file, f"{SSB}SignalDictionary", "signal dictionary")
    found = signal_dictionary(reader, root)
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
            reader.problem(child, f"{local(child)} is no kind of element; a system has components, systems and dictionaries")
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
        parameter_set(reader, values) if values is not None else None,
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
        parameter_mapping(reader, mapping) if mapping is not None else None,
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
        reader.problem(node, f"{key} = {node.get(key)!r} is no list of indices")
        return []
    return [int(text) for text in texts]


def _dictionary_source(reader: Reader, node: etree._Element) -> DictionarySource:
    tag = f"{SSB}SignalDictionary"
    inline = node.find(tag)
    return DictionarySource(
        reader.text(node, "name"),
        node.get("source"),
        signal_dictionary(reader, inline) if inline is not None else None,
        node.get("type", DICTIONARY_TYPE),
        **reader.rest(node, ("name", "source", "type"), (tag,)),
    )


def _grandchildren(node: etree._Element, group: str) -> list[etree._Element]:
    return [child for found in node.iterchildren(f"{SSD}{group}") for child in elements(found)]
