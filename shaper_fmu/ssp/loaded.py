"""A system that was read from an SSP archive: the system that runs, and the archive's names for its parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from shaper_fmu.errors import ComponentError, ModelError, nearest
from shaper_fmu.master.results import Results
from shaper_fmu.master.signals import Interpolation
from shaper_fmu.quantities import Defined, in_unit
from shaper_fmu.ssp.conversion import IDENTITY, Affine
from shaper_fmu.ssp.document import Parameter, ParameterSet, SystemDescription
from shaper_fmu.ssp.findings import Finding, Findings, Weight
from shaper_fmu.ssp.network import TARGETS, Network, Node
from shaper_fmu.ssp.parameters import known_names, settings_of, targets
from shaper_fmu.ssp.resolve import start_values_of
from shaper_fmu.ssp.system import System

_TYPES = {bool: "Boolean", int: "Integer", float: "Real", str: "String"}


@dataclass(frozen=True)
class SspSystem:
    """A system read from an SSP archive.

    Attributes:
        system: what runs; nested components are instances called "sub.inner".
        structure: the description that was read, with the default experiment.
        digest: SHA-256 of the file.
        parameter_sets: the files of the archive's folder of that name: file name -> content (see parameter_sets.py).
        notes: what the standard lets pass, but people should know: values that are ignored, inputs that nothing feeds.
        findings: all that is not as it should be, but did not stop the archive from being read; more of it than in the notes.
        network: the connectors of all levels, and what leads where.
        instances: the instances' names by the components' paths (they differ where a path is not a name for an instance).
    """

    system: System
    structure: SystemDescription
    digest: str
    parameter_sets: dict[str, bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    network: Network = field(kw_only=True)
    instances: dict[str, str] = field(kw_only=True)

    @property
    def inputs(self) -> list[str]:
        """The root system's own inputs and parameters, which `set` takes."""
        return [connector.name for connector in self.structure.system.connectors if connector.kind in TARGETS]

    @property
    def outputs(self) -> list[str]:
        """The root system's own outputs that something feeds, which can be recorded."""
        known = (c.name for c in self.structure.system.connectors if c.kind not in TARGETS)
        return [name for name in known if Node("", name) in self.network.into]

    def set(self, name: str, value: Any) -> None:
        """Give a start value to all that a name means: "component.variable", or a connector of any of the systems.

        A connector's value is in the connector's unit; a text may have another one of its kind ("0.8Hz", "20mm"). Raises
        ModelError if nothing has the name, or something else feeds it.
        """
        root = self.network.places[""]
        if all(node.path in self.instances for node in targets(self.network, root, name) or ()):
            self._set_variable(name, value)
            return
        if isinstance(value, str):
            value = self._in_connectors_unit(name, value)
        kind = _kind_of_text(value) if isinstance(value, str) else _TYPES.get(type(value), "Real")
        parameter = Parameter(name, kind, str(value).lower() if kind == "Boolean" else str(value))
        self.apply(ParameterSet("", [parameter], file=f"{name} = {value}"))

    def _in_connectors_unit(self, name: str, text: str) -> str | float:
        """A number with a unit in that of the connector; other texts unchanged."""
        for node in targets(self.network, self.network.places[""], name) or ():
            unit = self.network.unit(node)
            defined = Defined(unit.exponents, unit.factor, unit.offset) if unit is not None else None
            try:
                return in_unit(text, unit.name if unit is not None else "", name, defined)
            except ComponentError as error:
                raise ModelError([str(error)]) from None
        return text

    def _set_variable(self, name: str, value: Any) -> None:
        for path, instance in sorted(self.instances.items(), key=lambda item: -len(item[0])):
            if name.startswith(f"{path}."):
                self.system.set(f"{instance}.{name.removeprefix(f'{path}.')}", value)
                self.network.fmus[path] = self.system.fmus[instance]
                return
        names = known_names(self.network, self.network.places[""])
        element = name.split(".")[0]
        known = [*self.inputs, *(place.element.name for place in self.network.structure.inside(""))]
        raise ModelError([f"{name!r}: there is no instance {element!r}.{nearest(element, known) or nearest(name, names)}"])

    def apply(self, values: ParameterSet, findings: Findings | None = None) -> None:
        """Set all values of a set, or none: then ModelError lists every problem, such as a value for a connected input.

        `findings` are those of its file.
        """
        findings = findings or Findings()
        found = self.checked(values, findings)
        problems = findings.texts(Weight.LOAD)
        if problems:
            raise ModelError(problems)
        for instance, own in found:
            self.system.start_values[instance].update(own)

    def checked(self, values: ParameterSet, findings: Findings) -> list[tuple[str, dict[str, float | int | bool]]]:
        """The start values by instance in a set; problems are added to `findings`."""
        found = []
        for (path, variable), setting in settings_of(self.network, values, findings).items():
            instance, given = self.instances[path], setting.given
            try:
                self.system.check_settable(f"{instance}.{variable}")
            except ModelError as error:
                for problem in error.problems:
                    given.scope.report(given.line, f"{given.what}: {problem}")
                continue
            try:
                found.append((instance, start_values_of(self.network, path, variable, setting.value)))
            except ModelError as error:
                given.refuse([problem.removeprefix(f"{self.network.fmus[path].name}: ") for problem in error.problems])
        return found

    def drive(self, name: str, source: Any, interpolation: Interpolation = "hold") -> None:
        """Feed one of the system's own inputs from outside: a function of time, a number, or a table (see `System.drive`)."""
        node = Node("", name)
        if name not in self.inputs:
            raise ModelError([f"the system has no input {name!r}.{nearest(name, self.inputs)}"])
        for path in self.network.paths_from(node):
            end = path[-1].target
            port = f"{self.instances[end.path]}.{end.name}"
            self.system.drive(port, source, interpolation)
            gain = self.network.affine(list(path))
            if gain != IDENTITY:
                self.system.scalings[self.system.split(port)] = gain

    def simulate(self, stop_time: float, step: float, *, record: Sequence[str] | None = None, **options: Any) -> Results:
        """Run the system as `System.simulate` does; its own outputs are recorded under their names, in their units.

        `record` may name "instance.variable" and outputs of the system; all of both if it is None.
        """
        own = {name: found for output in self.outputs for name, found in self._output(output).items()}
        chosen, wanted = None, [record] if isinstance(record, str) else list(record or [])
        if record is not None:
            own = {name: found for name, found in own.items() if name in wanted or name.split("[")[0] in wanted}
            outer = {*own, *(name.split("[")[0] for name in own)}
            chosen = list(dict.fromkeys([*(name for name in wanted if name not in outer), *(port for port, _ in own.values())]))
        results = self.system.simulate(stop_time, step, record=chosen, **options)
        columns = {name: gain * results.values[port] + offset for name, (port, (gain, offset)) in own.items()}
        kept = results.values
        if record is not None:
            kept = {name: column for name, column in kept.items() if name in wanted}
        units = {name: self._unit(name.split("[")[0]) for name in own}
        return replace(results, values={**kept, **columns}, units={**results.units, **units})

    def to_fmu(self, path: Path | str, fmi: int = 2, **options: Any) -> Path:
        """Write the system as one FMU, as `System.to_fmu` does; its own connectors are shown (see `pack_ssp_system`)."""
        from shaper_fmu.ssp.packing import pack_ssp_system  # which has use of this class

        return pack_ssp_system(self, path, fmi, **options).path

    def _output(self, name: str) -> dict[str, tuple[str, Affine]]:
        """An output of the system by name, or the elements of an array: the port it comes from, and its gain and offset."""
        path = self.network.path_to(Node("", name))
        source = path[0].source
        if not self.network.is_variable(source):
            return {}
        affine = self.network.affine(path)
        elements = self.network.fmus[source.path].elements_of(source.name)
        return {
            name + element.removeprefix(source.name) if len(elements) > 1 else name: (
                f"{self.instances[source.path]}.{element}",
                affine,
            )
            for element in elements
        }

    def _unit(self, output: str) -> str:
        path = self.network.path_to(Node("", output))
        unit = self.network.unit(path[0].source)
        for wire in path:
            unit = self.network.unit(wire.target) or unit
        return unit.name if unit is not None else ""


def _kind_of_text(text: str) -> str:
    """The type that a text from a command line has: a number, a boolean, or an item's name."""
    if text.lower() in ("true", "false"):
        return "Boolean"
    for kind, parse in (("Integer", int), ("Real", float)):
        try:
            parse(text)
        except ValueError:
            continue
        return kind
    return "Enumeration"
