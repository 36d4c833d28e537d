"""What the standards say of an instance's life, to judge the calls of native_fuzz.py by, and its calls of life and values.

The model is the text of FMI 2.0.5 (state machines of sections 3.2.3 and 4.2.4) and FMI 3.0.2 (sections 2.3, 3.2 and 4.2):
which function may be called in which phase, and which arguments are right.
"""

from __future__ import annotations

import math
import random
from ctypes import c_char_p, c_double, c_int, c_uint32
from dataclasses import dataclass
from typing import Any

from native_calls import DISCARD, ERROR, OK, REALS, Host, array

BEFORE, INITIALIZING, STEP, EVENT, CONTINUOUS, ENDED, UNKNOWN = (
    "before",
    "initializing",
    "step",
    "event",
    "continuous",
    "ended",
    "?",
)
READABLE = {INITIALIZING, STEP, EVENT, CONTINUOUS, ENDED}
WRITABLE = {BEFORE, INITIALIZING, STEP, EVENT, CONTINUOUS}
ALL = READABLE | WRITABLE
STRANGE = [math.nan, math.inf, -math.inf, 1e308, -1e308, 1e30, 5e-324, -1.0, 0.0]
INT_MAX = 2**31 - 1


@dataclass
class Life:
    """What the model knows of an instance; it is saved and restored with the instance's state."""

    phase: str = BEFORE
    tainted: bool = False
    time: float = 0.0
    event_time: float = 0.0  # of the last event: model exchange cannot go back behind it


REACH = {"reference_position": 0.2}
"""Inputs whose values must be smaller than 1: beyond, the plant would run into its end, which is an error."""


class Model:
    """An instance and what is known of it."""

    def __init__(self, host: Host, seed: str):
        self.host, self.random = host, random.Random(seed)
        self.life, self.calls = Life(), 0
        self.history: list[str] = []

    def told(self) -> str:
        return f"{self.host.name}, FMI {self.host.fmi}: {'; '.join(self.history[-12:])}; the log: {self.host.log}"

    def check(self, function: str, arguments: tuple, phases: set[str], legal: bool | None = True, then: str = "") -> bool:
        """Call and judge; returns whether it was done. `legal` is None where nothing is known."""
        life = self.life
        refused = legal is False or (life.phase != UNKNOWN and life.phase not in phases)
        self.history.append(f"{function} {life.phase} {'refused' if refused else legal}")
        status = self.host.call(function, *arguments)
        self.calls += 1
        if status != OK:
            assert [told for told, text in self.host.log[-1:] if self.host.name in text] == [status], self.told()
        if refused:
            assert status in (DISCARD, ERROR), f"{status}, {self.told()}"
            return False
        if status != OK:
            assert legal is None or life.tainted or life.phase == UNKNOWN, self.told()
            life.phase = UNKNOWN
            return False
        if then:
            life.phase = then
        return True

    def defect(self, *kinds: str) -> str:
        """Mostly none."""
        return self.random.choice([*kinds, *[""] * (2 * len(kinds) + 2)])

    # life

    def enter(self) -> None:
        start = self.random.choice([0.0, 1.5, -2.0])
        bad = self.defect("start", "stop")
        times = (math.nan if bad == "start" else start, bad == "stop", start - 1.0)
        if self.host.fmi == 3:
            done = self.check("EnterInitializationMode", (False, 0.0, *times), {BEFORE}, not bad, INITIALIZING)
        else:
            done = self.check("SetupExperiment", (0, 0.0, *times), {BEFORE}, not bad)
            self.life.time = self.life.event_time = start if done else self.life.time
            self.check("EnterInitializationMode", (), {BEFORE}, True, INITIALIZING)
        if done:
            self.life.time = self.life.event_time = start

    def leave(self) -> None:
        self.check("ExitInitializationMode", (), {INITIALIZING}, True, EVENT if self.host.exchange or self.host.events else STEP)

    def terminate(self) -> None:
        if self.random.random() < 0.2 or self.life.phase == ENDED:
            self.check("Terminate", (), {STEP, EVENT, CONTINUOUS}, True, ENDED)

    def reset(self) -> None:
        if self.random.random() < 0.2 or self.life.phase in (ENDED, UNKNOWN):
            self.check("Reset", (), ALL, True, BEFORE)
            self.life = Life()

    def instantiate(self) -> None:
        """A second instance that cannot be."""
        self.host.log.clear()
        wrong: list[dict[str, Any]] = [{"name": None}, {"name": b""}, {"token": None}, {"token": b"{0}"}, {"token": b"x" * 5000}]
        if self.host.fmi == 2:
            wrong.append({"kind": 7})
        elif not self.host.exchange:
            wrong.append({"required": [0, 9999]})
        assert self.host.instantiate(**self.random.choice(wrong)) is None
        assert [told for told, _ in self.host.log] == [ERROR], self.told()
        self.calls += 1

    def logging(self) -> None:
        categories = [b"logStatusError", b"logAll", b"logEvents"]
        bad = self.defect("unknown", "null", "no array")
        names = array(c_char_p, [self.random.choice(categories), {"unknown": b"logNothing", "null": None}.get(bad, categories[0])])
        self.check("SetDebugLogging", (1, 2, None if bad == "no array" else names), ALL, not bad)

    # values

    def get(self) -> None:
        self.access("Get", "")

    def set(self) -> None:
        self.access("Set", "value")

    def access(self, verb: str, legal_value: str) -> None:
        host, life = self.host, self.life
        kind = self.random.choice([k for k in host.types if host.of_type(k)])
        bad = self.defect("references", "values", "unknown", "type", *(["count"] if host.fmi == 3 else []), "not settable")
        settable = [v for v in host.of_type(kind) if v.causality in ("input", "parameter")]
        chosen = self.random.choices(settable if verb == "Set" and settable else host.of_type(kind), k=self.random.randint(1, 3))
        values, right, strange = (
            self.values_for(chosen, kind) if verb == "Set" else ([0] * sum(map(host.size, chosen)), True, False)
        )
        references = [v.valueReference for v in chosen]
        if bad == "unknown":
            references[-1] = self.random.choice([10**6, 2**32 - 1])
        others = [v for v in host.variables if v.type != kind and {v.type, kind} != {"Integer", "Enumeration"}]
        if bad == "type" and not others:
            bad = ""
        if bad == "type":
            references[-1] = self.random.choice(others).valueReference
        fixed = [v for v in host.of_type(kind) if v not in settable]
        if bad == "not settable" and (verb == "Get" or not fixed):
            bad = ""
        if bad == "not settable":
            references[-1] = self.random.choice(fixed).valueReference
            values = [0] * sum(host.size(v) for v in [*chosen[:-1], next(v for v in fixed if v.valueReference == references[-1])])
        count = len(values) + (self.random.choice([-1, 1, 10**9]) if bad == "count" else 0)
        arguments = (None if bad == "references" else array(c_uint32, references), len(references),
                     None if bad == "values" else array(host.types[kind], values + [0] * 40), *([count] if host.fmi == 3 else []))  # fmt: skip
        name = verb + {(2, "Enumeration"): "Integer", (3, "Enumeration"): "Int64"}.get((host.fmi, kind), kind)
        done = self.check(
            name, arguments, READABLE if verb == "Get" else WRITABLE, False if bad or not right else None if strange else True
        )
        life.tainted |= done and strange

    def values_for(self, chosen: list[Any], kind: str) -> tuple[list, bool, bool]:
        """Values to set, whether the variables may be set now, and whether it is left to their use whether they are right."""
        values, right, strange = [], True, False
        real = kind in REALS
        for v in chosen:
            phases = {"input": WRITABLE, "parameter": {BEFORE, INITIALIZING}}.get(v.causality, set())
            if v.variability == "tunable" and phases:
                phases = WRITABLE - {CONTINUOUS}
            right &= self.life.phase in phases or (self.life.phase == UNKNOWN and bool(phases))
            new = self.host.starts(v)
            if v.causality == "input" and real:
                new = [self._moderate(v)] * len(new)
            if self.random.random() < 0.1:
                odd = STRANGE if real else [0, 1] if kind == "Boolean" else [-INT_MAX - 1, INT_MAX, 0, -1, 3]
                new, strange = [self.random.choice(odd)] * len(new), True
            values += new
        return values, right, strange

    def _moderate(self, variable: Any) -> float:
        """A value for a real input: within its bounds, if it tells any."""
        reach = REACH.get(variable.name, 1.0)
        low, high = (side if bound is None else float(bound) for side, bound in ((-reach, variable.min), (reach, variable.max)))
        return self.random.uniform(min(low, high), max(low, high))

    def output_derivatives(self) -> None:
        host = self.host
        name = "GetRealOutputDerivatives" if host.fmi == 2 else "GetOutputDerivatives"
        bad: str = self.random.choice(["order", "unknown", "null", "huge", *(["count"] if host.fmi == 3 else [])])
        reals = [v for v in host.of_type("Real" if host.fmi == 2 else "Float64") if v.causality == "output" and host.size(v) == 1]
        if not reals:
            return
        with_derivative = [v for v in reals if any(d.derivative is v for d in host.variables if d.derivative)]
        if bad == "count" and not with_derivative:
            bad = "unknown"
        reference = self.random.choice(with_derivative if bad == "count" else reals).valueReference
        references = array(c_uint32, [10**6 if bad == "unknown" else reference])
        orders = array(c_int, [self.random.choice([0, -1]) if bad == "order" else INT_MAX if bad == "huge" else 1])
        values = None if bad == "null" else array(c_double, [0.0] * 4)
        count = [self.random.choice([0, 2])] if bad == "count" else [1]
        self.check(name, (references, 1, orders, values, *(count if host.fmi == 3 else [])), READABLE, False)
