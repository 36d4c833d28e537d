"""Inputs that are linear over a step: for FMUs of co-simulation that take derivatives of inputs (FMI 1.0 and 2.0), and of model
exchange, whose solver moves them.

Where the input's source steps before it (Gauss-Seidel), the input is the line between the source's values at both ends of
the step; else it goes on with the slope of the step before. After an event, and where nothing is known yet, it is held.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.functions import standard_name
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.variables import kind_of
from shaper_fmu.master.wiring import Port


def linear_inputs(instances: Mapping[str, Instance], connections: Mapping[Port, Port], monolithic: bool) -> list[Port]:
    """The connected real inputs of instances that take their derivatives, an instance's together.

    `monolithic`: what FMUs of model exchange give each other moves by itself.
    """
    parts = [name for name, instance in instances.items() if instance.fmu.exchanges_model]

    def is_taken(target: Port, source: Port) -> bool:
        if target[0] not in parts:
            return kind_of(instances[target[0]].fmu.variables[target[1]]) == "real"
        return _is_moved(instances[target[0]], target[1]) and not (monolithic and source[0] in parts)

    taking = [name for name, instance in instances.items() if name in parts or instance.takes_input_derivatives]
    return [target for name in taking for target, source in connections.items() if target[0] == name and is_taken(target, source)]


def _is_moved(instance: Instance, name: str) -> bool:
    """Whether the solver moves this input: a scalar of 64 bits that may change at any time."""
    variable = instance.fmu.variables[name]
    continuous = variable.variability in ("continuous", None)
    return continuous and not variable.dimensions and str(variable.type) in ("Real", "Float64")


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
    base, moved = np.zeros_like(values), np.zeros_like(values)
    variables = [instances[name].fmu.variables[variable] for name, variable in ports]
    references = np.array([variable.valueReference for variable in variables] or [0], np.uint32)
    for row, port in zip(slopes, ports, strict=True):
        (row["source"], row["held"]), row["gain"], row["known"] = places(port), gain(port), known(port)
    calls = np.zeros(len(names), of.SLOPES_OF)
    for i, name in enumerate(names):
        rows = [k for k, port in enumerate(ports) if port[0] == name]
        first, instance = rows[0], instances[name]
        part, version = instance.fmu.exchanges_model, instance.fmu.version
        kind = "Float64" if version == 3 else "Real"
        moves = [instance.address(standard_name(f"fmi{version}{verb}{kind}")) if part else 0 for verb in ("Get", "Set")]
        calls[i] = (
            0 if part else instance.address(instance.input_derivatives), instance.handle, references[first:].ctypes.data,
            orders[first:].ctypes.data, values[first:].ctypes.data, *moves, base[first:].ctypes.data, moved[first:].ctypes.data,
            np.nan, version, list(instances).index(name), first, len(rows),
        )  # fmt: skip
    return LinearInputs(slopes, calls, {name: i for i, name in enumerate(names)}, (values, orders, references, base, moved))
