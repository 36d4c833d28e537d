"""Resolves a description of an archive to a system: names, files, directions, units and values, with all findings.

`check` prints the findings, reading an archive raises those that stop it, and what is resolved here is what runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.connectors import flatten
from shaper_fmu.ssp.conversion import IDENTITY
from shaper_fmu.ssp.document import SystemDescription
from shaper_fmu.ssp.files import Files
from shaper_fmu.ssp.findings import Findings, Weight
from shaper_fmu.ssp.network import TARGETS, Network, Node, WireError
from shaper_fmu.ssp.parameters import Settings, collect_settings
from shaper_fmu.ssp.read import read_description
from shaper_fmu.ssp.system import System
from shaper_fmu.ssp.wires import make_network


@dataclass
class Resolved:
    """A description that is resolved as far as it can be: the system, and its instances' names by the components' paths."""

    structure: SystemDescription
    files: Files
    network: Network
    system: System
    instances: dict[str, str] = field(default_factory=dict)

    @property
    def findings(self) -> Findings:
        """All that was found."""
        return self.files.findings


def resolve(content: Mapping[str, bytes], name: str) -> tuple[Files, Resolved | None]:
    """The description of this file name in an archive's files; None if nothing of it can be read, with findings in the files."""
    files = Files(content, Findings())
    structure = files.read(name, read_description)
    if structure is None:
        return files, None
    network = make_network(flatten(structure, files))
    settings = collect_settings(network)
    _resize(network, settings)
    found = Resolved(structure, files, network, System(structure.name), _instance_names(network.fmus))
    _add(found, settings)
    _connect(found)
    _check_outputs(found)
    return files, found


def _instance_names(fmus: Iterable[str]) -> dict[str, str]:
    """Names for instances by path: the path, if it is one."""
    names: dict[str, str] = {}
    for path in fmus:
        parts = [re.sub(r"^(?=\d)|[^A-Za-z0-9_]", "_", part) or "_" for part in path.split(".")]
        name = ".".join(parts)
        while name in names.values():
            name += "_"
        names[path] = name
    return names


def _resize(network: Network, settings: Settings) -> None:
    """Give components their structural parameters, which sizes of arrays follow."""
    for (path, variable), setting in list(settings.items()):
        try:
            fmu, rest = network.fmus[path].split_structure({variable: setting.value})
        except ModelError as error:
            setting.given.refuse(_bare(network, path, error))
            continue
        if not rest:
            network.fmus[path] = fmu
            del settings[path, variable]


def _add(found: Resolved, settings: Settings) -> None:
    """Add the instances with their start values."""
    for path, name in found.instances.items():
        found.system.add(name, found.network.fmus[path])
    for (path, variable), setting in settings.items():
        try:
            found.system.start_values[found.instances[path]].update(start_values_of(found.network, path, variable, setting.value))
        except ModelError as error:
            setting.given.refuse(_bare(found.network, path, error))


def _bare(network: Network, path: str, error: ModelError) -> list[str]:
    return [problem.removeprefix(f"{network.fmus[path].name}: ") for problem in error.problems]


def _connect(found: Resolved) -> None:
    """Connect what wires connect through all levels."""
    network = found.network
    for target, last in network.into.items():
        if not network.is_variable(target):
            continue
        path = [last]
        try:
            path = network.path_to(target)
            source, mapping = path[0].source, network.mapping(path)
            affine = IDENTITY if mapping else network.affine(path)
            if not network.is_variable(source):
                continue  # a connector that nothing feeds; its value, if it has one, is among the settings
            start, end = (f"{found.instances[node.path]}.{node.name}" for node in (source, target))
            if network.variable(target).causality != "input":
                raise WireError(last, [f"{start} feeds the parameter {end}; this master connects only inputs"])
            found.system.connect_raw(start, end, *affine, mapping=mapping)
        except WireError as error:
            error.report(found.findings)
        except ModelError as error:
            faulty = next((wire for wire in path if wire.faults), last)
            WireError(faulty, error.problems).report(found.findings)


def _check_outputs(found: Resolved) -> None:
    """The system's own outputs: what stops each run, since they are recorded."""
    for connector in found.structure.system.connectors:
        node = Node("", connector.name)
        try:
            if connector.kind not in TARGETS and node in found.network.into:
                found.network.affine(found.network.path_to(node))
        except WireError as error:
            error.report(found.findings, Weight.RUN)


def start_values_of(network: Network, path: str, variable: str, value: Any) -> dict[str, float | int | bool]:
    """The start values by scalar name that a value for a component's variable gives. Raises ModelError."""
    fmu = network.fmus[path]
    elements = fmu.elements_of(variable)
    if elements == [variable]:
        return fmu.start_values({variable: value})
    values = list(np.atleast_1d(value)) if not isinstance(value, str) else [value]
    if len(values) != len(elements):
        raise ModelError([f"{path}.{variable} has {len(elements)} elements but is given {len(values)} values"])
    found: dict[str, float | int | bool] = {}
    for element, single in zip(elements, value if isinstance(value, list) else values, strict=True):
        found |= fmu.start_values({element: single})
    return found
