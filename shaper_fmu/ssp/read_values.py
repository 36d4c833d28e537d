"""Reading parameter sets, parameter mappings and signal dictionaries, in files of their own or inline."""

from __future__ import annotations

from typing import Any

from lxml import etree

from shaper_fmu.ssp.document import DictionaryEntry, MappingEntry, Parameter, ParameterMapping, ParameterSet, SignalDictionary
from shaper_fmu.ssp.document_parts import DataType
from shaper_fmu.ssp.names import SSB, SSM, SSV, TYPES_2
from shaper_fmu.ssp.read_parts import DIMENSION, TRANSFORMATION_TAGS, TYPE_TAGS, Reader, elements, local, other_prefixes

_TYPES = tuple(f"{SSV}{name}" for name in TYPES_2 if name != "Clock")


def file_fields(reader: Reader, root: etree._Element, attributes: tuple[str, ...], children: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a root element (`File`)."""
    version = root.get("version", "1.0")  # it has to be there, but nothing else could be meant
    if version.split(".")[0] not in ("1", "2"):
        reader.problem(root, f"{local(root)} of version {version}; versions 1.0 and 2.0 of the standard are known")
    alone = root.getparent() is None
    rest = reader.rest(root, ("version", *attributes), children)
    return {"version": version, "namespaces": other_prefixes(root) if alone else {}, "file": reader.file, **rest}


def parameter_set(reader: Reader, root: etree._Element) -> ParameterSet:
    tags = {name: f"{SSV}{name}" for name in ("Parameters", "Enumerations", "Units")}
    groups = root.findall(tags["Parameters"])
    if not groups:
        reader.problem(root, "ParameterSet has no Parameters")
    return ParameterSet(
        reader.text(root, "name"),
        [_parameter(reader, node) for group in groups for node in group.iterchildren(f"{SSV}Parameter")],
        reader.enumerations(root, tags["Enumerations"]),
        reader.units(root, tags["Units"]),
        **file_fields(reader, root, ("name",), tuple(tags.values())),
    )


def _parameter(reader: Reader, node: etree._Element) -> Parameter:
    name = reader.text(node, "name")
    rest = reader.rest(node, ("name",), (*_TYPES, DIMENSION))
    found = [child for child in elements(node) if child.tag in _TYPES]
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


def parameter_mapping(reader: Reader, root: etree._Element) -> ParameterMapping:
    tag = f"{SSM}MappingEntry"
    return ParameterMapping(
        [_mapping_entry(reader, node) for node in root.iterchildren(tag)], **file_fields(reader, root, (), (tag,))
    )


def _mapping_entry(reader: Reader, node: etree._Element) -> MappingEntry:
    return MappingEntry(
        reader.text(node, "source"),
        reader.text(node, "target"),
        reader.transformation(node),
        reader.flag(node, "suppressUnitConversion"),
        **reader.rest(node, ("source", "target", "suppressUnitConversion"), TRANSFORMATION_TAGS),
    )


def signal_dictionary(reader: Reader, root: etree._Element) -> SignalDictionary:
    tags = {name: f"{SSB}{name}" for name in ("DictionaryEntry", "Enumerations", "Units")}
    return SignalDictionary(
        [_dictionary_entry(reader, node) for node in root.iterchildren(tags["DictionaryEntry"])],
        reader.enumerations(root, tags["Enumerations"]),
        reader.units(root, tags["Units"]),
        **file_fields(reader, root, (), tuple(tags.values())),
    )


def _dictionary_entry(reader: Reader, node: etree._Element) -> DictionaryEntry:
    name, type_ = reader.text(node, "name"), reader.data_type(node)
    if type_ is None:
        reader.problem(node, f"dictionary entry {name!r} has no type")
    children = (*TYPE_TAGS, DIMENSION)
    return DictionaryEntry(name, type_ or DataType("Real"), reader.dimensions(node), **reader.rest(node, ("name",), children))
