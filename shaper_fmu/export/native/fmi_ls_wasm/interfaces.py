"""The interfaces of the draft of fmi-ls-wasm (July 2026, package fmi:fmi3@3.0.0), in the syntax of its language WIT.

https://github.com/modelica/fmi-ls-wasm, folder wit/. Only what an FMU needs for co-simulation and for model exchange is here.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

PACKAGE, VERSION = "fmi:fmi3", "3.0.0"

TYPES = {
    "value-reference": "u32",
    "status": "enum{ok, warning, discard, error, fatal}",
    "fmu-state": "list<u8>",
    "interval-qualifier": "enum{interval-not-yet-known, interval-unchanged, interval-changed}",
    "interval-fraction": "record{counter: u64, resolution: u64}",
    "dependency-kind": "enum{dependent, constant, fixed, tunable, discrete}",
    "variable-dependency": "record{dependent-value-reference: value-reference, element-index-of-dependent: u32, "
    "independent-value-reference: value-reference, element-index-of-independent: u32, kind: dependency-kind}",
    "discrete-states-info": "record{new-discrete-states-needed: bool, terminate-simulation: bool, "
    "nominals-of-continuous-states-changed: bool, values-of-continuous-states-changed: bool, "
    "next-event-time-defined: bool, next-event-time: f64}",
}
"""The interface `types`, which is imported."""

LOG_MESSAGE = "log-message: func(instance-name: string, status: status, category: string, message: string)"
"""Of the interface `callbacks`, all that our FMUs call."""

GET_VERSION = "get-version: func() -> string"
"""The interface `common`."""

_VALUES = {
    **{f"float{bits}": f"f{bits}" for bits in (32, 64)},
    **{f"int{bits}": f"s{bits}" for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": f"u{bits}" for bits in (8, 16, 32, 64)},
    "boolean": "bool",
    "string": "string",
    "binary": "list<u8>",
    "clock": "bool",
}

_METHODS = [
    "set-debug-logging: func(logging-on: bool, categories: list<string>) -> status",
    "enter-initialization-mode: func(tolerance: option<f64>, start-time: f64, stop-time: option<f64>) -> status",
    "exit-initialization-mode: func() -> status",
    "enter-event-mode: func() -> status",
    "update-discrete-states: func() -> result<discrete-states-info, status>",
    "terminate: func() -> status",
    "reset: func() -> status",
    "enter-configuration-mode: func() -> status",
    "exit-configuration-mode: func() -> status",
    *[f"get-{k}: func(value-references: list<value-reference>) -> result<list<{t}>, status>" for k, t in _VALUES.items()],
    *[f"set-{k}: func(value-references: list<value-reference>, values: list<{t}>) -> status" for k, t in _VALUES.items()],
    "get-number-of-variable-dependencies: func(vr: value-reference) -> result<u64, status>",
    "get-variable-dependencies: func(dependent: value-reference) -> result<list<variable-dependency>, status>",
    "get-fmu-state: func() -> result<fmu-state, status>",
    "set-fmu-state: func(state: fmu-state) -> status",
    *[
        f"get-{which}-derivative: func(unknowns: list<value-reference>, knowns: list<value-reference>, seed: list<f64>) "
        "-> result<list<f64>, status>"
        for which in ("directional", "adjoint")
    ],
    "get-interval-decimal: func(value-references: list<value-reference>) -> result<list<tuple<f64, interval-qualifier>>, status>",
    "get-interval-fraction: func(value-references: list<value-reference>) "
    "-> result<list<tuple<interval-fraction, interval-qualifier>>, status>",
    "get-shift-decimal: func(value-references: list<value-reference>) -> result<list<f64>, status>",
    "get-shift-fraction: func(value-references: list<value-reference>) -> result<list<interval-fraction>, status>",
    *[
        f"set-{what}-{form}: func(value-references: list<value-reference>, {what}s: list<{kind}>) -> status"
        for what in ("interval", "shift")
        for form, kind in (("decimal", "f64"), ("fraction", "interval-fraction"))
    ],
    "evaluate-discrete-states: func() -> status",
    "enter-step-mode: func() -> status",
    "get-output-derivatives: func(requests: list<tuple<value-reference, u32>>) -> result<list<f64>, status>",
]
"""What the draft has in both interfaces alike."""


@dataclass(frozen=True)
class Interface:
    """An exported interface with one resource, whose handle is an FMU's instance.

    Attributes:
        name: as in the draft; the resource is `name`-instance.
        record: name and type of what only this interface has.
        instantiate: the static function.
        methods: of the resource.
    """

    name: str
    record: tuple[str, str]
    instantiate: str
    methods: tuple[str, ...]

    @property
    def resource(self) -> str:
        return f"{self.name}-instance"


_INSTANTIATE = "instance-name: string, instantiation-token: string, resource-path: string, visible: bool, logging-on: bool"

CO_SIMULATION = Interface(
    "co-simulation",
    (
        "do-step-result",
        "record{last-successful-time: f64, event-handling-needed: bool, terminate-simulation: bool, early-return: bool}",
    ),
    f"instantiate-co-simulation: func({_INSTANTIATE}, event-mode-used: bool, early-return-allowed: bool, "
    "required-intermediate-variables: list<value-reference>) -> option<own<co-simulation-instance>>",
    (
        *_METHODS,
        "set-input-derivatives: func(requests: list<tuple<value-reference, u32>>, values: list<f64>) -> status",
        "do-step: func(current-communication-point: f64, communication-step-size: f64, "
        "no-set-fmu-state-prior-to-current-point: bool) -> result<do-step-result, status>",
    ),
)

MODEL_EXCHANGE = Interface(
    "model-exchange",
    ("completed-step-result", "record{enter-event-mode: bool, terminate-simulation: bool}"),
    f"instantiate-model-exchange: func({_INSTANTIATE}) -> option<own<model-exchange-instance>>",
    (
        *_METHODS,
        "enter-continuous-time-mode: func() -> status",
        "set-time: func(time: f64) -> status",
        "set-continuous-states: func(continuous-states: list<f64>) -> status",
        "get-continuous-state-derivatives: func() -> result<list<f64>, status>",
        "get-event-indicators: func() -> result<list<f64>, status>",
        "get-continuous-states: func() -> result<list<f64>, status>",
        "get-nominals-of-continuous-states: func() -> result<list<f64>, status>",
        "get-number-of-event-indicators: func() -> result<u64, status>",
        "get-number-of-continuous-states: func() -> result<u64, status>",
        "completed-integrator-step: func(no-set-fmu-state-prior-to-current-point: bool) -> result<completed-step-result, status>",
    ),
)


class Type(NamedTuple):
    """A type: its head ("list", "record", a primitive's or a declared one's name), and its parts by name ("" if they have none)."""

    head: str
    parts: tuple[tuple[str, Type], ...] = ()


class Function(NamedTuple):
    name: str
    parameters: tuple[tuple[str, Type], ...]
    result: Type | None


def type_of(text: str) -> Type:
    """A type as it is written in WIT."""
    match = re.fullmatch(r"([\w-]+)(?:[<{](.*)[>}])?", text.strip())
    assert match, text
    head, inside = match.groups()
    if inside is None:
        return Type(head)
    if head == "enum":
        return Type(head, tuple((item, Type("")) for item in _items(inside)))
    return Type(head, _named(inside) if head == "record" else tuple(("", type_of(item)) for item in _items(inside)))


def function_of(text: str) -> Function:
    """A function as it is written in WIT."""
    match = re.fullmatch(r"([\w-]+): func\((.*?)\)(?: -> (.*))?", text)
    assert match, text
    name, inside, result = match.groups()
    return Function(name, _named(inside), type_of(result) if result else None)


def _named(text: str) -> tuple[tuple[str, Type], ...]:
    pairs = (item.split(":", 1) for item in _items(text))
    return tuple((name, type_of(kind)) for name, kind in pairs)


def _items(text: str) -> list[str]:
    """What commas separate outside of brackets."""
    return [item.strip() for item in re.findall(r"(?:[^,<{]|<(?:[^<>]|<[^<>]*>)*>|\{[^}]*\})+", text)]
