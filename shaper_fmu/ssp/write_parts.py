"""Writes the parts that all SSP files share."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping

from lxml import etree

from shaper_fmu.ssp.document_parts import (
    DataType,
    Dimension,
    Enumeration,
    File,
    LinearTransformation,
    Node,
    Transformation,
    Unit,
)
from shaper_fmu.ssp.names import PREFIXES, SSC, TYPES_2

_ORDER = (
    *("System", "Connectors", "Parameters", "ParameterValues", "ParameterMapping", "DictionaryEntry", "Item", "BaseUnit"),
    *(*TYPES_2, "LinearTransformation", "BooleanMappingTransformation", "IntegerMappingTransformation"),
    *("EnumerationMappingTransformation", "Dimension", "ssd:Clock", "ConnectorGeometry", "ConnectionGeometry"),
    *("ElementGeometry", "ParameterBindings", "Elements", "Connections", "SignalDictionaries", "SystemGeometry"),
    *("GraphicalElements", "Enumerations", "Units", "DefaultExperiment", "", "Annotations", "MetaData", "Signature"),
)
_RANKS = {name: rank for rank, name in enumerate(_ORDER)}
"""The standard's order of children in any element; "" stands for what it does not know."""
_KEPT = "shaper-fmu-kept"
_TAG = re.compile(r'<[^<>"]*(?:"[^"]*"[^<>"]*)*>')  # of canonical XML
_DECLARATION = re.compile(r' (xmlns:[^=\s]+="[^"]*")')


def new(tag: str, **attributes: str | None) -> etree._Element:
    """An element with those attributes that are not None."""
    node = etree.Element(tag, nsmap=PREFIXES)
    for key, value in attributes.items():
        if value is not None:
            node.set(key, value)
    return node


def new_root(tag: str, file: File, **attributes: str | None) -> etree._Element:
    """A root element, with the standard's prefixes and the file's own."""
    own = {prefix: uri for prefix, uri in file.namespaces.items() if prefix not in PREFIXES}
    node = etree.Element(tag, nsmap={**PREFIXES, **own})
    for key, value in {"version": file.version, **attributes}.items():
        if value is not None:
            node.set(key, value)
    return node


def group(parent: etree._Element, tag: str, children: Iterable[etree._Element]) -> None:
    """Add an element that groups these children, if there are any."""
    found = list(children)
    if found:
        inner = etree.SubElement(parent, tag)
        inner.extend(found)


def finish(element: etree._Element, node: Node) -> etree._Element:
    """Add what every element has, and bring the children into the standard's order."""
    for key, value in (("id", node.id), ("description", node.description)):
        if value is not None:
            element.set(key, value)
    for key, value in node.attributes.items():
        element.set(key, value)
    namespace = f"{{{etree.QName(element).namespace}}}"
    group(element, f"{namespace}Annotations", (kept(annotation.xml) for annotation in node.annotations))
    element.extend([kept(text) for text in node.extra])
    element[:] = sorted(element, key=_rank)
    return element


def kept(text: str) -> etree._Element:
    """An element kept as text: a processing instruction with its rank and the text, which `to_bytes` inserts.

    As an element, it would lose prefixes that its values may use: lxml drops what it takes for double declarations.
    """
    return etree.ProcessingInstruction(_KEPT, f"{_rank(etree.fromstring(text))} {base64.b64encode(text.encode()).decode()}")


def _rank(node: etree._Element) -> int:
    if isinstance(node, etree._ProcessingInstruction):
        return int(str(node.text).split()[0])
    name = etree.QName(node)
    if name.namespace not in PREFIXES.values():
        return _RANKS[""]
    if name.localname == "Clock" and name.namespace == PREFIXES["ssd"]:
        return _RANKS["ssd:Clock"]
    return _RANKS.get(name.localname, _RANKS[""])


def units(parent: etree._Element, tag: str, found: list[Unit]) -> None:
    group(parent, tag, [_unit(unit) for unit in found])


def _unit(unit: Unit) -> etree._Element:
    node = new(f"{SSC}Unit", name=unit.name)
    base = etree.SubElement(node, f"{SSC}BaseUnit")
    for symbol, exponent in unit.exponents.items():
        base.set(symbol, str(exponent))
    for key, value, default in (("factor", unit.factor, 1.0), ("offset", unit.offset, 0.0)):
        if value != default:
            base.set(key, repr(value))
    return finish(node, unit)


def enumerations(parent: etree._Element, tag: str, found: list[Enumeration]) -> None:
    group(parent, tag, [_enumeration(enumeration) for enumeration in found])


def _enumeration(enumeration: Enumeration) -> etree._Element:
    node = new(f"{SSC}Enumeration", name=enumeration.name)
    node.extend([new(f"{SSC}Item", name=name, value=str(value)) for name, value in enumeration.items.items()])
    return finish(node, enumeration)


def data_type(type_: DataType) -> etree._Element:
    return with_attributes(new(f"{SSC}{type_.name}", unit=type_.unit, name=type_.enumeration), type_.attributes)


def with_attributes(node: etree._Element, attributes: Mapping[str, str]) -> etree._Element:
    """The element with further attributes."""
    for key, value in attributes.items():
        node.set(key, value)
    return node


def dimensions(found: list[Dimension]) -> list[etree._Element]:
    return [new(f"{SSC}Dimension", size=_text(d.size), sizeConnector=d.size_connector) for d in found]


def transformation(found: Transformation | None) -> list[etree._Element]:
    """No element, or one."""
    if found is None:
        return []
    if isinstance(found, LinearTransformation):
        return [new(f"{SSC}LinearTransformation", factor=repr(found.factor), offset=repr(found.offset))]
    node = new(f"{SSC}{found.kind}MappingTransformation")
    node.extend([new(f"{SSC}MapEntry", source=source, target=target) for source, target in found.entries])
    return [node]


def flag(value: bool) -> str | None:
    """An attribute that is left out where it is false."""
    return "true" if value else None


def _text(value: int | None) -> str | None:
    return None if value is None else str(value)


def to_bytes(root: etree._Element) -> bytes:
    """The file: UTF-8, our own elements indented, kept text unchanged."""
    _indent(root, 0)
    declared = {f'xmlns:{prefix}="{uri}"' for prefix, uri in root.nsmap.items()}
    text = etree.tostring(root, encoding="unicode")
    text = re.sub(rf"<\?{_KEPT} \d+ (\S+)\?>", lambda found: _undeclared(base64.b64decode(found[1]).decode(), declared), text)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{text}\n".encode()


def _undeclared(text: str, declared: set[str]) -> str:
    """XML text without declarations of prefixes that the root declares alike, unless it uses such a prefix for something else."""
    found = {declaration for tag in _TAG.findall(text) for declaration in _DECLARATION.findall(tag)}
    known = {declaration.split("=")[0] for declaration in declared}
    if any(declaration.split("=")[0] in known and declaration not in declared for declaration in found):
        return text
    return _TAG.sub(lambda tag: _DECLARATION.sub(lambda d: "" if d[1] in declared else d[0], tag[0]), text)


def _indent(node: etree._Element, depth: int) -> None:
    """Put each child on a line."""
    if not len(node):
        return
    node.text = "\n" + "  " * (depth + 1)
    for child in node:
        _indent(child, depth + 1)
        child.tail = "\n" + "  " * (depth + 1)
    node[-1].tail = "\n" + "  " * depth
