"""Reads the parts that all SSP files share, and reports every problem with file and line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from lxml import etree

from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.document_parts import (
    Annotation,
    DataType,
    Dimension,
    Enumeration,
    LinearTransformation,
    MappingTransformation,
    Transformation,
    Unit,
)
from shaper_fmu.ssp.names import PREFIXES, SSC, TYPES_2
from shaper_fmu.units import BASE

_FLAGS = {"true": True, "1": True, "false": False, "0": False}
_MAPPINGS = {f"{SSC}{kind}MappingTransformation": kind for kind in ("Boolean", "Integer", "Enumeration")}


class PartlyRead(ModelError):
    """A file of which some meaning is lost. `rest` is what could be read, for those who want to look for more problems."""

    def __init__(self, problems: list[str], rest: object):
        super().__init__(problems)
        self.rest = rest


class Reader:
    """The file that is read, and the problems found in it so far."""

    def __init__(self, file: str):
        self.file = file
        self.problems: list[str] = []

    def raise_problems(self, rest: object) -> None:
        """Raise PartlyRead if there are any; `rest` is what could be read."""
        if self.problems:
            raise PartlyRead(self.problems, rest)

    def problem(self, node: etree._Element, message: str) -> None:
        self.problems.append(f"{self.file}, line {node.sourceline or 0}: {message}")

    def text(self, node: etree._Element, key: str) -> str:
        """A required attribute."""
        value = node.get(key)
        if value is None:
            self.problem(node, f"{local(node)} has no {key}")
        return value or ""

    def number(self, node: etree._Element, key: str, default: float | None = None) -> float | None:
        """An optional finite number."""
        text = node.get(key)
        if text is None:
            return default
        value = _parsed(float, text)
        if value is None or not math.isfinite(value):
            self.problem(node, f"{key} = {text!r} is not a number")
            return default
        return value

    def number_or(self, node: etree._Element, key: str, default: float) -> float:
        """An optional finite number; -0.0 is one, too."""
        value = self.number(node, key, default)
        return default if value is None else value

    def integer(self, node: etree._Element, key: str, default: int | None = None) -> int | None:
        """An optional integer."""
        text = node.get(key)
        value = _parsed(int, text) if text is not None else default
        if value is None and text is not None:
            self.problem(node, f"{key} = {text!r} is not an integer")
            return default
        return value

    def flag(self, node: etree._Element, key: str) -> bool:
        """An optional boolean, false if it is missing."""
        text = node.get(key, "false").strip()
        if text not in _FLAGS:
            self.problem(node, f"{key} = {text!r} is neither true nor false")
        return _FLAGS.get(text, False)

    def choice(self, node: etree._Element, key: str, allowed: tuple[str, ...]) -> Any:
        """An optional attribute of a few values, the first of which is the default."""
        text = node.get(key, allowed[0])
        if text not in allowed:
            self.problem(node, f"{key} = {text!r} is none of {', '.join(allowed)}")
            return allowed[0]
        return text

    def rest(self, node: etree._Element, attributes: tuple[str, ...] = (), children: tuple[str, ...] = ()) -> dict[str, Any]:
        """The fields of `Node`, given the attributes and children that have their own fields."""
        known = ("id", "description", *attributes)
        return {
            "id": node.get("id"),
            "description": node.get("description"),
            "attributes": {str(key): str(value) for key, value in node.attrib.items() if key not in known},
            "annotations": self.annotations(node),
            "extra": [raw(child) for child in elements(node) if child.tag not in children and local(child) != "Annotations"],
            "line": node.sourceline or 0,
        }

    def annotations(self, node: etree._Element) -> list[Annotation]:
        found = [child for child in elements(node) if local(child) == "Annotations"]
        return [
            Annotation(type=child.get("type", ""), xml=raw(child), line=child.sourceline or 0)
            for group in found
            for child in elements(group)
        ]

    def units(self, root: etree._Element, tag: str) -> list[Unit]:
        return [self._unit(node) for group in root.iterchildren(tag) for node in group.iterchildren(f"{SSC}Unit")]

    def _unit(self, node: etree._Element) -> Unit:
        base = node.find(f"{SSC}BaseUnit")
        name = self.text(node, "name")
        rest = self.rest(node, ("name",), (f"{SSC}BaseUnit",))
        if base is None:
            self.problem(node, f"unit {name!r} has no BaseUnit")
            return Unit(name, **rest)
        exponents = {symbol: self.integer(base, symbol, 0) or 0 for symbol in BASE}
        factor, offset = self.number_or(base, "factor", 1.0), self.number_or(base, "offset", 0.0)
        if factor == 0.0:
            self.problem(base, f"unit {name!r} has the factor 0")
        return Unit(name, {k: v for k, v in exponents.items() if v}, factor or 1.0, offset, **rest)

    def enumerations(self, root: etree._Element, tag: str) -> list[Enumeration]:
        groups = root.iterchildren(tag)
        return [self._enumeration(node) for group in groups for node in group.iterchildren(f"{SSC}Enumeration")]

    def _enumeration(self, node: etree._Element) -> Enumeration:
        items = {self.text(item, "name"): self.integer(item, "value", 0) or 0 for item in node.iterchildren(f"{SSC}Item")}
        return Enumeration(self.text(node, "name"), items, **self.rest(node, ("name",), (f"{SSC}Item",)))

    def data_type(self, node: etree._Element) -> DataType | None:
        """The type among the children of a connector or a dictionary's entry."""
        found = [child for child in elements(node) if child.tag in TYPE_TAGS]
        if len(found) > 1:
            self.problem(found[1], f"{local(node)} has more than one type")
        for child in found:
            attributes = {str(key): str(value) for key, value in child.attrib.items() if key not in ("unit", "name")}
            enumeration = self.text(child, "name") if local(child) == "Enumeration" else None
            return DataType(local(child), child.get("unit"), enumeration, attributes, child.sourceline or 0)
        return None

    def dimensions(self, node: etree._Element) -> list[Dimension]:
        return [Dimension(self.integer(child, "size"), child.get("sizeConnector")) for child in node.iterchildren(DIMENSION)]

    def transformation(self, node: etree._Element) -> Transformation | None:
        """The transformation among the children of a connection or a mapping's entry."""
        found = [child for child in elements(node) if child.tag in TRANSFORMATION_TAGS]
        if len(found) > 1:
            self.problem(found[1], f"{local(node)} has more than one transformation")
        for child in found:
            line = child.sourceline or 0
            if child.tag not in _MAPPINGS:
                return LinearTransformation(self.number_or(child, "factor", 1.0), self.number_or(child, "offset", 0.0), line)
            kind = _MAPPINGS[str(child.tag)]
            entries = [self._entry(entry, kind) for entry in child.iterchildren(f"{SSC}MapEntry")]
            for source in {source for i, (source, _) in enumerate(entries) if source in dict(entries[:i])}:
                self.problem(child, f"{kind}MappingTransformation maps {source!r} more than once")
            return MappingTransformation(kind, entries, line)  # pyright: ignore[reportArgumentType]
        return None

    def _entry(self, node: etree._Element, kind: str) -> tuple[str, str]:
        if kind == "Boolean":
            source, target = (str(self.flag(node, key)).lower() for key in ("source", "target"))
        elif kind == "Integer":
            source, target = (str(self.integer(node, key) or 0) for key in ("source", "target"))
        else:
            return self.text(node, "source"), self.text(node, "target")
        if node.get("source") is None or node.get("target") is None:
            self.problem(node, "MapEntry needs source and target")
        return source, target


DIMENSION = f"{SSC}Dimension"
TYPE_TAGS = tuple(f"{SSC}{name}" for name in TYPES_2)
TRANSFORMATION_TAGS = (f"{SSC}LinearTransformation", *_MAPPINGS)


def local(node: etree._Element) -> str:
    """The tag without its namespace."""
    return etree.QName(node).localname


def elements(node: etree._Element) -> Iterator[etree._Element]:
    """The child elements, without processing instructions."""
    return node.iterchildren(etree.Element)  # pyright: ignore[reportArgumentType,reportReturnType]


def raw(node: etree._Element) -> str:
    """An element as independent XML text: canonical, with the prefixes that it uses, also in its values."""
    texts = [text for part in node.iter(etree.Element) for text in (part.text or "", *part.attrib.values())]
    used = {prefix for text in texts for prefix in re.findall(r"([A-Za-z_][\w.-]*):", str(text))}
    kept = sorted(prefix for prefix in {p for part in node.iter(etree.Element) for p in part.nsmap if p} if prefix in used)
    try:
        return etree.tostring(node, method="c14n", exclusive=True, inclusive_ns_prefixes=kept).decode()
    except etree.C14NError:  # canonical XML knows no namespaces with relative names; other people do
        return etree.tostring(node, encoding="unicode", with_tail=False)


def other_prefixes(root: etree._Element) -> dict[str, str]:
    """The root's prefixes that are not the standard's."""
    return {prefix: uri for prefix, uri in root.nsmap.items() if prefix and uri not in PREFIXES.values()}


def _parsed(kind: type, text: str) -> Any:
    try:
        return None if "_" in text else kind(text)
    except ValueError:
        return None
