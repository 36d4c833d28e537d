"""An instance in a native library, called as an importer would: every function, with whatever arguments."""

from __future__ import annotations

import ctypes
import math
from ctypes import byref, c_bool, c_double, c_int, c_int32, c_int64, c_uint32, c_void_p
from functools import lru_cache
from typing import Any

import fmpy
from native_host import load, native_fmu, signatures, token_of

from shaper_fmu.registry import components

OK, DISCARD, ERROR = 0, 2, 3
REALS = ("Real", "Float64", "Float32")
C_TYPES = {2: {"Real": c_double, "Integer": c_int, "Boolean": c_int, "Enumeration": c_int},
           3: {"Float64": c_double, "Int32": c_int32, "Boolean": c_bool, "Enumeration": c_int64}}  # fmt: skip
ACCESSOR = {2: {"Enumeration": "Integer"}, 3: {"Enumeration": "Int64"}}


class Callbacks2(ctypes.Structure):
    """fmi2CallbackFunctions; the logger takes the arguments of its format, here always one text."""

    _fields_ = [(name, c_void_p) for name in ("logger", "allocateMemory", "freeMemory", "stepFinished", "environment")]


LOGGER2 = ctypes.CFUNCTYPE(None, c_void_p, ctypes.c_char_p, c_int, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p)
LOGGER3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, ctypes.c_char_p, ctypes.c_char_p)
UPDATE3 = ctypes.CFUNCTYPE(
    None, c_void_p, c_double, c_bool, c_bool, c_bool, c_bool, ctypes.POINTER(c_bool), ctypes.POINTER(c_double)
)


@lru_cache
def description(name: str, fmi: int) -> Any:
    """The model description, read by fmpy."""
    return fmpy.read_model_description(str(native_fmu(name, fmi)), validate=False)


def array(kind: Any, values: list) -> Any:
    return (kind * max(1, len(values)))(*values)


class Host:
    """One instance in a library, and what its logger got."""

    early = True  # with events, steps may return early

    def __init__(self, name: str, fmi: int, exchange: bool = False, events: bool = False, update: Any = None):
        self.name, self.fmi, self.exchange, self.events = name, fmi, exchange, events and not exchange and fmi == 3
        self.library = load(native_fmu(name, fmi), fmi)
        self.token = token_of(native_fmu(name, fmi)).encode()
        self.types: dict[str, Any] = C_TYPES[fmi]
        self.log: list[tuple[int, str]] = []
        self.variables = [v for v in description(name, fmi).modelVariables if v.causality != "independent"]
        self.states = sum(
            self.size(v) for v in self.variables if v.name.split("[")[0] in (components()[name].continuous_states or ())
        )
        self._logger = LOGGER2(self._log2) if fmi == 2 else LOGGER3(self._log3)
        self._functions = Callbacks2(logger=ctypes.cast(self._logger, c_void_p))
        self._update = UPDATE3(update) if update else None
        self.instance = self.instantiate()
        assert self.instance, self.log

    def _log2(self, environment: int, name: bytes, status: int, category: bytes, template: bytes, text: bytes) -> None:
        assert template == b"%s"
        self.log.append((status, text.decode()))

    def _log3(self, environment: int, status: int, category: bytes, text: bytes) -> None:
        self.log.append((status, text.decode()))

    def instantiate(
        self, name: bytes | None = b"fuzz", token: bytes | None = b"right", kind: int | None = None, required: Any = ()
    ) -> int | None:
        """The C instance, or None. `kind` is for FMI 2: 0 for model exchange, 1 for co-simulation."""
        token = self.token if token == b"right" else token
        if self.fmi == 2:
            kind = int(not self.exchange) if kind is None else kind
            return self.library.fmi2Instantiate(name, kind, token, None, byref(self._functions), 0, 0)
        if self.exchange:
            return self.library.fmi3InstantiateModelExchange(name, token, None, False, False, None, self._logger)
        needed = array(c_uint32, list(required))
        options = (False, False, self.events, self.events and self.early, needed, len(required), None, self._logger, self._update)
        return self.library.fmi3InstantiateCoSimulation(name, token, None, *options)

    def call(self, function: str, *arguments: Any) -> int:
        self.log.clear()
        return getattr(self.library, f"fmi{self.fmi}{function}")(self.instance, *arguments)

    def free(self) -> None:
        self.call("FreeInstance")

    def setup(self, start: float = 0.0, stop: float | None = None) -> int:
        """Into initialization mode."""
        times = (start, stop is not None, stop or 0.0)
        if self.fmi == 3:
            return self.call("EnterInitializationMode", False, 0.0, *times)
        return self.call("SetupExperiment", 0, 0.0, *times) or self.call("EnterInitializationMode")

    def step(self, t: float, h: float) -> int:
        if self.fmi == 2:
            return self.call("DoStep", t, h, 1)
        self.answers = (c_bool(), c_bool(), c_bool(), c_double())
        return self.call("DoStep", t, h, True, *map(byref, self.answers))

    def new_discrete_states(self) -> int:
        if self.fmi == 2:
            return self.call("NewDiscreteStates", array(ctypes.c_byte, [0] * 32))
        return self.call("UpdateDiscreteStates", *[byref(c_bool()) for _ in range(5)], byref(c_double()))

    def of_type(self, kind: str) -> list[Any]:
        return [v for v in self.variables if v.type == kind]

    @staticmethod
    def size(variable: Any) -> int:
        return math.prod(int(d.start) for d in variable.dimensions) if variable.dimensions else 1

    def starts(self, variable: Any) -> list[Any]:
        """The start values of all elements of an input or a parameter."""
        words = [{"true": "1", "false": "0"}.get(word, word) for word in str(variable.start or 0).split()]
        convert = float if variable.type in REALS else int
        return ([convert(word) for word in words] * self.size(variable))[: self.size(variable)]

    def access(self, verb: str, kind: str, references: Any, n: int, values: Any, count: int) -> int:
        """Get or Set of a type; only FMI 3 is told the number of values."""
        function = verb + ACCESSOR[self.fmi].get(kind, kind)
        return self.call(function, references, n, values, *([count] if self.fmi == 3 else []))

    def put(self, variable: Any, value: float) -> int:
        """Set all elements of a variable to a value."""
        kind, n = self.types[variable.type], self.size(variable)
        typed = value if variable.type in REALS else int(value)
        return self.access("Set", variable.type, array(c_uint32, [variable.valueReference]), 1, array(kind, [typed] * n), n)

    def all_values(self) -> list[bytes]:
        """The bytes of all variables."""
        found = []
        for kind, c_type in self.types.items():
            chosen = self.of_type(kind)
            n = sum(map(self.size, chosen))
            values = array(c_type, [0] * n)
            references = array(c_uint32, [v.valueReference for v in chosen])
            assert self.access("Get", kind, references, len(chosen), values, n) == OK, (self.name, kind, self.log)
            found.append(bytes(values))
        return found

    def standard_run(self) -> list[list[bytes]]:
        """Values along a short simulation from the start values, the inputs held at 0.3; ends before a reset."""
        assert self.setup() == OK, self.log
        for v in self.variables:
            assert v.causality != "input" or self.put(v, 0.3) == OK
        assert self.call("ExitInitializationMode") == OK, self.log
        found = [self.all_values()]
        if self.exchange:
            calls = [("CompletedIntegratorStep", (1, byref(c_int()), byref(c_int()))), ("EnterEventMode", ())]
            assert self.new_discrete_states() == self.call("EnterContinuousTimeMode") == self.call("SetTime", 0.013) == OK
            found.append(self.all_values())
            assert [self.call(name, *arguments) for name, arguments in calls] == [OK, OK]
            return [*found, self.all_values()]
        for i in range(3):
            if self.events:
                assert self.new_discrete_states() == self.call("EnterStepMode") == OK
            assert self.step(0.05 * i if not self.events or not i else self.answers[3].value, 0.05) == OK, self.log
            found.append(self.all_values())
            if self.events:
                assert self.call("EnterEventMode") == OK
        return found


def null_call(library: ctypes.CDLL, fmi: int, function: str) -> Any:
    """Call a function with null for every pointer and zero for every number."""
    _, arguments = signatures(fmi)[function]
    pointers = (c_void_p, ctypes.c_char_p)
    return getattr(library, function)(*[None if kind in pointers else kind(0).value for kind in arguments])
