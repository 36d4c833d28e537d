"""What a system structure description says, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ParameterValue:
    """A value of a parameter set: its text in the file, and its unit if one is given."""

    name: str
    text: str
    unit: str | None
    line: int


@dataclass(frozen=True)
class Element:
    """A component: its name, the path of its FMU inside the archive, its connectors and its parameter values."""

    name: str
    source: str
    line: int
    connectors: dict[str, str] = field(default_factory=dict)
    parameters: list[ParameterValue] = field(default_factory=list)


@dataclass(frozen=True)
class Connection:
    """A connection between two elements' connectors."""

    start: tuple[str, str]
    end: tuple[str, str]
    line: int


@dataclass(frozen=True)
class Structure:
    """A flat system with its default experiment. Times in s; None where the file does not say."""

    name: str
    elements: list[Element]
    connections: list[Connection]
    start_time: float | None
    stop_time: float | None
    step_size: float | None
