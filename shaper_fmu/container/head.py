"""What a container's description says of the whole: its name, its default experiment, and what it can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from lxml import etree

from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.export.description_parts import add_log_categories, new_root
from shaper_fmu.master.variable_names import NAME
from shaper_fmu.version import __version__


@dataclass(frozen=True)
class Capabilities:
    """What a container can do.

    Attributes:
        can_save_states: get and set its state, and with `can_serialize` as bytes.
        only_once: only one instance in a process.
        variable_steps: any communication step.
        interpolates_inputs: FMI 2.0: takes the inputs' derivatives.
        has_event_mode: FMI 3.0: has event mode, and may return early from a step at an event.
        max_output_derivative_order: of the outputs' derivatives.
        own_memory: FMI 2.0: does not need the host's functions for memory.
        needs_tool: needs a tool where it runs, since an FMU inside does.
        readable_after_set: outputs may be read between setting inputs and the step, and follow them (our own annotation).
    """

    can_save_states: bool = False
    can_serialize: bool = False
    only_once: bool = False
    variable_steps: bool = True
    interpolates_inputs: bool = False
    has_event_mode: bool = False
    max_output_derivative_order: int = 0
    own_memory: bool = True
    needs_tool: bool = False
    readable_after_set: bool = False


@dataclass(frozen=True)
class Experiment:
    """A default experiment: start, stop and step [s], and the solvers' tolerance; None for what is not known."""

    start: float | None = None
    stop: float | None = None
    step: float | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Head:
    """What a description says of the whole container.

    Attributes:
        name: of the model.
        identifier: of its library.
        token: FMI 2.0's GUID, FMI 3.0's instantiation token; empty in a draft.
        description: one sentence.
        categories: names and descriptions of messages; the standard's for None.
        time: name of the independent variable. FMI 2.0 has none without it; in FMI 3.0 it is "time", or the like, then.
    """

    name: str
    identifier: str
    token: str
    description: str = ""
    experiment: Experiment = field(default_factory=Experiment)
    capabilities: Capabilities = field(default_factory=Capabilities)
    categories: Sequence[tuple[str, str]] | None = None
    time: str | None = None

    def add_categories(self, root: etree._Element, prefix: str) -> None:
        """The categories of messages; `prefix` is that of the version's C names."""
        if self.categories is None:
            add_log_categories(root, prefix, events=False)
            return
        parent = etree.SubElement(root, "LogCategories")
        for name, description in self.categories:
            etree.SubElement(parent, "Category", name=name, description=description)


def new_document(head: Head, version: str, token: str, names: Sequence[str]) -> etree._Element:
    """The root element; `token` is the name of the attribute."""
    about = {"description": head.description} if head.description else {}
    convention = "structured" if all(NAME.fullmatch(name) for name in names) else "flat"
    return new_root(version, head.name, {token: head.token}, about, f"shaper-fmu {__version__}", convention)


def time_name(head: Head, outer: Sequence[OuterVariable], fmi: int) -> str | None:
    """The name of the independent variable, which no other variable has; None if FMI 2.0 shows none."""
    if fmi == 2 and head.time is None:
        return None
    taken, name = {variable.name for variable in outer}, head.time or "time"
    while name in taken:
        name += "_"
    return name


def add_experiment(root: etree._Element, experiment: Experiment) -> None:
    """The default experiment, if anything of it is known."""
    known = {
        "startTime": experiment.start,
        "stopTime": experiment.stop,
        "tolerance": experiment.tolerance,
        "stepSize": experiment.step,
    }
    attributes = {name: repr(float(value)) for name, value in known.items() if value is not None}
    if attributes:
        etree.SubElement(root, "DefaultExperiment", attributes)
