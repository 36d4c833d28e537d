"""The content of SSP files as plain data: system structures (.ssd), parameter sets (.ssv), mappings (.ssm), dictionaries (.ssb).

Versions 1.0 and 2.0 of the standard share these classes. Nothing is resolved here: names, units and paths are as found.
What has no field of its own (geometry, metadata, signatures, content that the standard does not know) is kept as text and
written back. `line` is the line in the file, 0 for what a program made; it does not count in comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.ssp.annotations import RunSettings, run_settings
from shaper_fmu.ssp.document_parts import Annotation, DataType, Dimension, Enumeration, File, Node, Transformation, Unit
from shaper_fmu.ssp.document_parts import LinearTransformation as LinearTransformation
from shaper_fmu.ssp.document_parts import MappingTransformation as MappingTransformation
from shaper_fmu.ssp.names import DICTIONARY_TYPE, FMU_TYPE, MAPPING_TYPE, SET_TYPE


@dataclass
class Parameter(Node):
    """A value of a parameter set: the type's name, and the text of its value.

    Version 2.0: arrays have `dimensions`; texts, enumerations and binaries may give their values one by one in `items`,
    and `value` is None then.
    """

    name: str
    type: str
    value: str | None
    unit: str | None = None
    enumeration: str | None = None
    items: list[str] = field(default_factory=list)
    dimensions: list[Dimension] = field(default_factory=list)
    type_attributes: dict[str, str] = field(default_factory=dict)


@dataclass
class ParameterSet(File):
    """A parameter set: a file (.ssv), or inline in a binding."""

    name: str
    parameters: list[Parameter] = field(default_factory=list)
    enumerations: list[Enumeration] = field(default_factory=list)
    units: list[Unit] = field(default_factory=list)


@dataclass
class MappingEntry(Node):
    """The parameter `source` of a set becomes `target` of the component or system."""

    source: str
    target: str
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False


@dataclass
class ParameterMapping(File):
    """A parameter mapping: a file (.ssm), or inline in a binding."""

    entries: list[MappingEntry] = field(default_factory=list)


@dataclass
class MappingReference(Node):
    """A binding's mapping: the path of a file, or the mapping itself (None if it is of another type; then see `extra`)."""

    source: str | None = None
    mapping: ParameterMapping | None = None
    type: str = MAPPING_TYPE
    source_base: Literal["SSD", "component"] = "SSD"


@dataclass
class ParameterBinding(Node):
    """A parameter set for an element: the path of a file, or the set itself, with a prefix and a mapping.

    `foreign` is the inline content of a binding whose type is none of the standard's, as XML text.
    """

    source: str | None = None
    values: ParameterSet | None = None
    prefix: str = ""
    mapping: MappingReference | None = None
    type: str = SET_TYPE
    source_base: Literal["SSD", "component"] = "SSD"
    foreign: list[str] = field(default_factory=list)


@dataclass
class Connector(Node):
    """A connector: its name, its kind ("input", "output", "parameter", ...), its type if declared, its dimensions and clocks."""

    name: str
    kind: str
    type: DataType | None = None
    dimensions: list[Dimension] = field(default_factory=list)
    clocks: list[str] = field(default_factory=list)


@dataclass
class Element(Node):
    """The common part of components, systems and dictionary references. Geometry is in `extra`."""

    name: str
    connectors: list[Connector] = field(default_factory=list)
    bindings: list[ParameterBinding] = field(default_factory=list)

    def connector(self, name: str) -> Connector | None:
        """The connector of this name."""
        return next((connector for connector in self.connectors if connector.name == name), None)


@dataclass
class Component(Element):
    """A component: the path of its FMU (or .ssp, or .ssd) inside the archive; None (version 2.0) if it has no source yet."""

    source: str | None = None
    type: str = FMU_TYPE
    implementation: str = "any"


@dataclass
class DictionaryReference(Element):
    """An element that stands for a signal dictionary: what goes into its connectors comes out of them."""

    dictionary: str = ""


@dataclass
class Connection(Node):
    """A connection between two connectors; an element of None is the system itself. Start and end imply no direction."""

    start_element: str | None
    start_connector: str
    end_element: str | None
    end_connector: str
    transformation: Transformation | None = None
    suppress_unit_conversion: bool = False
    start_indices: list[int] = field(default_factory=list)
    end_indices: list[int] = field(default_factory=list)


@dataclass
class DictionaryEntry(Node):
    """A signal of a dictionary."""

    name: str
    type: DataType
    dimensions: list[Dimension] = field(default_factory=list)


@dataclass
class SignalDictionary(File):
    """A signal dictionary: a file (.ssb), or inline in a system."""

    entries: list[DictionaryEntry] = field(default_factory=list)
    enumerations: list[Enumeration] = field(default_factory=list)
    units: list[Unit] = field(default_factory=list)


@dataclass
class DictionarySource(Node):
    """A system's ssd:SignalDictionary: the path of a file, or the dictionary itself, under the name that references use."""

    name: str
    source: str | None = None
    dictionary: SignalDictionary | None = None
    type: str = DICTIONARY_TYPE


@dataclass
class SystemElement(Element):
    """A system: the root of a description, or nested in another system."""

    elements: list[Component | SystemElement | DictionaryReference] = field(default_factory=list)
    connections: list[Connection] = field(default_factory=list)
    dictionaries: list[DictionarySource] = field(default_factory=list)

    def element(self, name: str) -> Component | SystemElement | DictionaryReference | None:
        """The direct element of this name."""
        return next((element for element in self.elements if element.name == name), None)


@dataclass
class DefaultExperiment(Node):
    """Start and stop time [s]; other tools put their step sizes and algorithms into its annotations."""

    start_time: float | None = None
    stop_time: float | None = None


@dataclass
class SystemDescription(File):
    """A system structure description (.ssd)."""

    name: str
    system: SystemElement
    enumerations: list[Enumeration] = field(default_factory=list)
    units: list[Unit] = field(default_factory=list)
    experiment: DefaultExperiment | None = None

    @property
    def start_time(self) -> float | None:
        """The default start time [s]; None if the file has none."""
        return self.experiment.start_time if self.experiment else None

    @property
    def stop_time(self) -> float | None:
        """The default stop time [s]; None if the file has none."""
        return self.experiment.stop_time if self.experiment else None

    @property
    def settings(self) -> list[RunSettings]:
        """Step size and algorithm from the annotations of OMSimulator and OSP; the first one counts."""
        return run_settings(annotation.xml for annotation in self.all_annotations())

    @property
    def step_size(self) -> float | None:
        """The communication step [s] of the annotations; None if there is none."""
        settings = self.settings
        return settings[0].step_size if settings else None

    @property
    def algorithm(self) -> Algorithm | None:
        """The master algorithm of the annotations; None if there is none."""
        settings = self.settings
        return settings[0].algorithm if settings else None

    def all_annotations(self) -> list[Annotation]:
        """Annotations of the experiment, of the description and of its root system, in which tools keep their settings."""
        return [*(self.experiment.annotations if self.experiment else []), *self.annotations, *self.system.annotations]
