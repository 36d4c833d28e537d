"""The facts about FMUs and systems, as plain data; `shaper-fmu info --json` writes these classes with the names of their fields."""

from __future__ import annotations

from dataclasses import dataclass, field

Value = float | int | bool | str
"""A start value in its type; the file's own text where that is none (an infinite number, a text of binary data)."""


@dataclass(frozen=True)
class Interface:
    """One kind of an FMU: "co-simulation", "model exchange" or "scheduled execution".

    `capabilities` have the standard's own names: what the description declares to be true, or a number.
    """

    kind: str
    identifier: str
    capabilities: dict[str, bool | float | str] = field(default_factory=dict)


@dataclass(frozen=True)
class PlatformInfo:
    """A folder of an FMU's binaries: its name, the size of its files [bytes], and whether it is for this machine."""

    name: str
    size: int
    is_this: bool


@dataclass(frozen=True)
class VariableInfo:
    """A variable. `dimensions` are sizes, or names of the structural parameters that give them; `items` those of an enumeration."""

    name: str
    causality: str
    variability: str
    type: str
    unit: str
    start: Value | list[Value] | None
    minimum: float | None
    maximum: float | None
    description: str
    dimensions: list[int | str] = field(default_factory=list)
    items: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    """A default experiment: start, stop and step [s], and the solver's tolerance; None where nothing is declared.

    `algorithm` is a system's, and `tool` the one whose annotation has the step and the algorithm.
    """

    start: float | None = None
    stop: float | None = None
    step: float | None = None
    tolerance: float | None = None
    algorithm: str | None = None
    tool: str = ""


@dataclass(frozen=True)
class FmuInfo:
    """An FMU of any version and kind.

    Attributes:
        file: its name.
        size: of the file [bytes].
        libraries: by platform; `sources` is how many files of source code it has.
        parameters: structural ones are among them. `others` is how many variables of other causalities there are.
        continuous_states, event_indicators: numbers of them, elements of arrays counted.
        findings: what `check` finds.
    """

    file: str
    size: int
    name: str
    description: str
    version: str
    author: str
    licence: str
    tool: str
    generated: str
    fmi_version: str
    interfaces: list[Interface]
    libraries: list[PlatformInfo]
    sources: int
    experiment: Experiment
    inputs: list[VariableInfo]
    outputs: list[VariableInfo]
    parameters: list[VariableInfo]
    others: dict[str, int]
    continuous_states: int
    event_indicators: int
    findings: list[str] = field(default_factory=list)

    @property
    def kinds(self) -> list[str]:
        """The names of its kinds."""
        return [interface.kind for interface in self.interfaces]


@dataclass(frozen=True)
class ConnectorInfo:
    """A connector of a system."""

    name: str
    kind: str
    type: str
    unit: str


@dataclass(frozen=True)
class ConnectionInfo:
    """A connection in a system, in the direction of the values: "element.connector", or a connector of the system itself.

    `laid` is false if the ends or the direction are wrong; then source and target are in the file's order. `change` is the
    transformation.
    """

    source: str
    target: str
    source_unit: str
    target_unit: str
    change: str
    laid: bool


@dataclass(frozen=True)
class SetInfo:
    """A parameter set: its file ("" if it is written into the description), and its values as text; None if they cannot be read."""

    source: str
    values: dict[str, str] | None
    prefix: str = ""


@dataclass(frozen=True)
class ElementInfo:
    """An element of a system: a "system", a "component", or a "signal dictionary".

    Attributes:
        source: the file of a component, or of a system that is another file; "" if there is none.
        fmu: the file in the archive with its FMU, a key of `SspInfo.fmus`; "" if it has none that can be read.
        implementation: what the component asks for: "any", "CoSimulation", "ModelExchange", ...
        problem: the reason why it has no FMU that can be read.
        values: the parameter sets that are bound to it.
    """

    name: str
    kind: str
    description: str = ""
    source: str = ""
    fmu: str = ""
    implementation: str = ""
    problem: str = ""
    connectors: list[ConnectorInfo] = field(default_factory=list)
    values: list[SetInfo] = field(default_factory=list)
    elements: list[ElementInfo] = field(default_factory=list)
    connections: list[ConnectionInfo] = field(default_factory=list)


@dataclass(frozen=True)
class SspInfo:
    """An SSP archive, a folder of a system, or a system's description alone.

    Attributes:
        size: of the archive [bytes], or of all files of the folder that belong to it.
        variant: the file name of the description that is shown, one of `variants`.
        fmus: by their paths in the archive.
        parameter_sets: those of the archive's folder for them, which are applied on demand.
        findings: what `check` finds.
    """

    file: str
    size: int
    name: str
    description: str
    version: str
    tool: str
    generated: str
    variant: str
    variants: list[str]
    experiment: Experiment
    system: ElementInfo
    fmus: dict[str, FmuInfo]
    parameter_sets: list[SetInfo]
    findings: list[str] = field(default_factory=list)
