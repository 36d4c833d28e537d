"""Inputs that are linear over a step: for FMUs of FMI 1.0 and 2.0 that take derivatives of inputs.

Where the input's source steps before it (Gauss-Seidel), the input is the line between the source's values at both ends of
the step; else it goes on with the slope of the step before. After an event, and where nothing is known yet, it is held.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.variables import kind_of
from shaper_fmu.master.wiring import Port


def linear_inputs(instances: Mapping[str, Instance], connections: Mapping[Port, Port]) -> list[Port]:
    """The connected real inputs of instances that take their derivatives, an instance's together."""
    taking = [name for name, instance in instances.items() if instance.takes_input_derivatives]
    return [
        target
        for name in taking
        for target in connections
        if target[0] == name and kind_of(instances[name].fmu.variables[target[1]]) == "real"
    ]


@dataclass(frozen=True)
class LinearInputs:
    """The arrays of the loop for these inputs (see layout.py), and the numbers of their instances' calls."""

    slopes: np.ndarray
    slopes_of: np.ndarray
    calls: dict[str, int]
    memory: tuple[np.ndarray, ...]  # that the addresses in them point into


def lay_out(
    ports: list[Port],
    instances: Mapping[str, Instance],
    places: Callable[[Port], tuple[int, int]],
    gain: Callable[[Port], float],
    known: Callable[[Port], bool],
) -> LinearInputs:
    """Arrays for linear inputs; `places` of their sources' values on the bus, now and held, and whether the source steps first."""
    slopes, names = np.zeros(len(ports), of.SLOPE), list(dict.fromkeys(port[0] for port in ports))
    values, orders = np.zeros(max(1, len(ports))), np.ones(max(1, len(ports)), np.int32)
    variables = [instances[name].fmu.variables[variable] for name, variable in ports]
    references = np.array([variable.valueReference for variable in variables] or [0], np.uint32)
    for row, port in zip(slopes, ports, strict=True):
        (row["source"], row["held"]), row["gain"], row["known"] = places(port), gain(port), known(port)
    calls = np.zeros(len(names), of.SLOPES_OF)
    for i, name in enumerate(names):
        rows = [k for k, port in enumerate(ports) if port[0] == name]
        first, instance = rows[0], instances[name]
        calls[i] = (
            instance.address(instance.input_derivatives), instance.handle, references[first:].ctypes.data,
            orders[first:].ctypes.data, values[first:].ctypes.data, list(instances).index(name), first, len(rows),
        )  # fmt: skip
    return LinearInputs(slopes, calls, {name: i for i, name in enumerate(names)}, (values, orders, references))
