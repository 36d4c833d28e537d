"""The parts that all SSP files share: elements with foreign content, units, enumerations, types, transformations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal


@dataclass(kw_only=True)
class Annotation:
    """An ssc:Annotation: its type (a reversed domain name) and the whole element as XML text."""

    type: str
    xml: str
    line: int = field(default=0, compare=False)


@dataclass(kw_only=True)
class Node:
    """The common part of all elements.

    `attributes` are those without a field ("name" or "{namespace}name"), `extra` the child elements without one, as XML text.
    """

    id: str | None = None
    description: str | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    annotations: list[Annotation] = field(default_factory=list)
    extra: list[str] = field(default_factory=list)
    line: int = field(default=0, compare=False)


@dataclass(kw_only=True)
class File(Node):
    """The common part of root elements: version of the standard, file name, and prefixes besides the standard's."""

    version: str = "1.0"
    namespaces: dict[str, str] = field(default_factory=dict)
    file: str = field(default="", compare=False)


@dataclass
class Unit(Node):
    """A unit: value in SI = factor * value + offset, and the exponents of kg, m, s, A, K, mol, cd, rad that are not 0."""

    name: str
    exponents: dict[str, int] = field(default_factory=dict)
    factor: float = 1.0
    offset: float = 0.0


@dataclass
class Enumeration(Node):
    """An enumeration: item name -> value."""

    name: str
    items: dict[str, int] = field(default_factory=dict)


@dataclass
class DataType:
    """The type of a connector or a dictionary's entry.

    `name` is "Real", "Integer", "Boolean", "String", "Enumeration", "Binary", or of version 2.0 "Float64" ... "Clock";
    `unit` of real ones; `enumeration` is the name of an Enumeration in the same file; `attributes` are any others.
    """

    name: str
    unit: str | None = None
    enumeration: str | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    line: int = field(default=0, compare=False)


@dataclass
class Dimension:
    """A dimension of an array (version 2.0): its size, or the connector that gives it, or neither."""

    size: int | None = None
    size_connector: str | None = None


@dataclass
class LinearTransformation:
    """target = factor * source + offset, in the target's unit."""

    factor: float = 1.0
    offset: float = 0.0
    line: int = field(default=0, compare=False)


@dataclass
class MappingTransformation:
    """A table from source to target values; values that are not in it stay as they are.

    Booleans are "true" and "false", integers in decimal digits, enumeration items are named.
    """

    kind: Literal["Boolean", "Integer", "Enumeration"]
    entries: list[tuple[str, str]]
    line: int = field(default=0, compare=False)


Transformation = LinearTransformation | MappingTransformation
