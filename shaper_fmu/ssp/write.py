"""Writes SSP files from the classes of document.py; reading them again gives the same content.

Elements come in the standard's order and with its own prefixes (ssd:, ssc:, ...), which some readers want; what was kept as text
is written as it was. The version is the file's own: what version 1.0 does not know should not be in a file of version 1.0.
"""

from __future__ import annotations

from lxml import etree

from shaper_fmu.ssp import write_parts as parts
from shaper_fmu.ssp.document import (
    Component,
    Connection,
    Connector,
    DictionaryEntry,
    DictionaryReference,
    DictionarySource,
    Element,
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
from shaper_fmu.ssp.names import DICTIONARY_TYPE, MAPPING_TYPE, SET_TYPE, SSB, SSD, SSM, SSV
from shaper_fmu.ssp.write_parts import finish, group, kept, new, new_root


def write_description(description: SystemDescription) -> bytes:
    """An .ssd file."""
    root = new_root(f"{SSD}SystemStructureDescription", description, name=description.name)
    root.append(_system(description.system))
    parts.enumerations(root, f"{SSD}Enumerations", description.enumerations)
    parts.units(root, f"{SSD}Units", description.units)
    experiment = description.experiment
    if experiment is not None:
        times = {"startTime": experiment.start_time, "stopTime": experiment.stop_time}
        texts = {key: None if value is None else repr(value) for key, value in times.items()}
        root.append(finish(new(f"{SSD}DefaultExperiment", **texts), experiment))
    return parts.to_bytes(finish(root, description))


def write_parameter_set(values: ParameterSet) -> bytes:
    """An .ssv file."""
    return parts.to_bytes(_parameter_set(values))


def write_mapping(mapping: ParameterMapping) -> bytes:
    """An .ssm file."""
    return parts.to_bytes(_mapping(mapping))


def write_dictionary(dictionary: SignalDictionary) -> bytes:
    """An .ssb file."""
    return parts.to_bytes(_dictionary(dictionary))


def _system(system: SystemElement) -> etree._Element:
    node = _interface(new(f"{SSD}System", name=system.name), system)
    group(node, f"{SSD}Elements", [_element(element) for element in system.elements])
    group(node, f"{SSD}Connections", [_connection(connection) for connection in system.connections])
    group(node, f"{SSD}SignalDictionaries", [_dictionary_source(source) for source in system.dictionaries])
    return finish(node, system)


def _element(element: Component | SystemElement | DictionaryReference) -> etree._Element:
    if isinstance(element, SystemElement):
        return _system(element)
    if isinstance(element, DictionaryReference):
        node = new(f"{SSD}SignalDictionaryReference", name=element.name, dictionary=element.dictionary)
    else:
        own = {"source": element.source, "implementation": _unless(element.implementation, "any")}
        node = new(f"{SSD}Component", name=element.name, type=element.type, **own)
    return finish(_interface(node, element), element)


def _interface(node: etree._Element, element: Element) -> etree._Element:
    group(node, f"{SSD}Connectors", [_connector(connector) for connector in element.connectors])
    group(node, f"{SSD}ParameterBindings", [_binding(binding) for binding in element.bindings])
    return node


def _connector(connector: Connector) -> etree._Element:
    node = new(f"{SSD}Connector", name=connector.name, kind=connector.kind)
    if connector.type is not None:
        node.append(parts.data_type(connector.type))
    node.extend(parts.dimensions(connector.dimensions))
    node.extend([new(f"{SSD}Clock", name=name) for name in connector.clocks])
    return finish(node, connector)


def _binding(binding: ParameterBinding) -> etree._Element:
    own = {"source": binding.source, "sourceBase": _unless(binding.source_base, "SSD"), "prefix": binding.prefix or None}
    node = new(f"{SSD}ParameterBinding", type=_unless(binding.type, SET_TYPE), **own)
    inline = [] if binding.values is None else [_parameter_set(binding.values)]
    group(node, f"{SSD}ParameterValues", [*inline, *(kept(text) for text in binding.foreign)])
    if binding.mapping is not None:
        node.append(_mapping_reference(binding.mapping))
    return finish(node, binding)


def _mapping_reference(reference: MappingReference) -> etree._Element:
    own = {"source": reference.source, "sourceBase": _unless(reference.source_base, "SSD")}
    node = new(f"{SSD}ParameterMapping", type=_unless(reference.type, MAPPING_TYPE), **own)
    if reference.mapping is not None:
        node.append(_mapping(reference.mapping))
    return finish(node, reference)


def _connection(connection: Connection) -> etree._Element:
    node = new(
        f"{SSD}Connection",
        startElement=connection.start_element,
        startConnector=connection.start_connector,
        startIndices=" ".join(map(str, connection.start_indices)) or None,
        endElement=connection.end_element,
        endConnector=connection.end_connector,
        endIndices=" ".join(map(str, connection.end_indices)) or None,
        suppressUnitConversion=parts.flag(connection.suppress_unit_conversion),
    )
    node.extend(parts.transformation(connection.transformation))
    return finish(node, connection)


def _dictionary_source(source: DictionarySource) -> etree._Element:
    node = new(f"{SSD}SignalDictionary", name=source.name, type=_unless(source.type, DICTIONARY_TYPE), source=source.source)
    if source.dictionary is not None:
        node.append(_dictionary(source.dictionary))
    return finish(node, source)


def _parameter_set(values: ParameterSet) -> etree._Element:
    root = new_root(f"{SSV}ParameterSet", values, name=values.name)
    root.append(new(f"{SSV}Parameters"))  # required, even if it is empty
    root[0].extend([_parameter(parameter) for parameter in values.parameters])
    parts.enumerations(root, f"{SSV}Enumerations", values.enumerations)
    parts.units(root, f"{SSV}Units", values.units)
    return finish(root, values)


def _parameter(parameter: Parameter) -> etree._Element:
    node = new(f"{SSV}Parameter", name=parameter.name)
    own = {"value": parameter.value, "unit": parameter.unit, "name": parameter.enumeration}
    value = parts.with_attributes(new(f"{SSV}{parameter.type}", **own), parameter.type_attributes)
    value.extend([new(f"{SSV}Value", value=item) for item in parameter.items])
    node.append(value)
    node.extend(parts.dimensions(parameter.dimensions))
    return finish(node, parameter)


def _mapping(mapping: ParameterMapping) -> etree._Element:
    root = new_root(f"{SSM}ParameterMapping", mapping)
    root.extend([_mapping_entry(entry) for entry in mapping.entries])
    return finish(root, mapping)


def _mapping_entry(entry: MappingEntry) -> etree._Element:
    suppress = parts.flag(entry.suppress_unit_conversion)
    node = new(f"{SSM}MappingEntry", source=entry.source, target=entry.target, suppressUnitConversion=suppress)
    node.extend(parts.transformation(entry.transformation))
    return finish(node, entry)


def _dictionary(dictionary: SignalDictionary) -> etree._Element:
    root = new_root(f"{SSB}SignalDictionary", dictionary)
    root.extend([_dictionary_entry(entry) for entry in dictionary.entries])
    parts.enumerations(root, f"{SSB}Enumerations", dictionary.enumerations)
    parts.units(root, f"{SSB}Units", dictionary.units)
    return finish(root, dictionary)


def _dictionary_entry(entry: DictionaryEntry) -> etree._Element:
    node = new(f"{SSB}DictionaryEntry", name=entry.name)
    node.append(parts.data_type(entry.type))
    node.extend(parts.dimensions(entry.dimensions))
    return finish(node, entry)


def _unless(value: str, default: str) -> str | None:
    """An attribute that is left out where it has its default value."""
    return None if value == default else value
