"""Components: declared variables, a record of their values, and kernel functions over that record.

A component is a subclass of `Component`. Its class attributes declare its variables; the instance is the record.
Two methods do the work and may use only scalars, loops, `math`, functions of the same kind and the record's fields,
so that the same source runs as plain Python and compiles:

- `start(self)` computes calculated parameters and initial states from the parameters;
- `step(self, t, h)` takes the inputs, held over [t, t + h], and sets the outputs to their values at t + h, from the
  right where they jump. `h` may be zero: at the start it gives the initial outputs, later it serves an event.
  While `left_limits` is true, events at t + h itself are left for later and outputs are the values from the left;
  a kernel that asks `time_tolerance` whether an event is reached has nothing else to do for this.

Either returns nothing (or 0) for success, or a number that `messages` explains; "{name}" in a message stands for the
value of a variable.

For model exchange a component tells its `continuous_states`, each a variable with a `derivative`; a step of length zero
then computes outputs and derivatives from them. Components with time events alone give an empty tuple, and `sampled`
where their inputs act only at communication points and events. A State `next_kink_time` tells solvers where an output's
derivative jumps, though the output does not. `about` names author, version, copyright and license. `terminals` groups
inputs and outputs that are connected together: for each terminal, the variables by the names that the other side knows.
How variables are declared is in `shaper_fmu.variable`. Both modules use the standard library alone, because every exported
FMU carries them.
"""

from __future__ import annotations

import enum
import hashlib
import math
import os
import re
import struct
from collections.abc import Callable, Iterable, Iterator
from typing import Any, ClassVar

from shaper_fmu.errors import ArgumentError, ComponentError, nearest
from shaper_fmu.variable import Calculated as Calculated
from shaper_fmu.variable import Input as Input
from shaper_fmu.variable import Local as Local
from shaper_fmu.variable import Output as Output
from shaper_fmu.variable import Parameter as Parameter
from shaper_fmu.variable import Scalar as Scalar
from shaper_fmu.variable import State as State
from shaper_fmu.variable import Variable as Variable

NO_EVENT = 1e300
"""Value of `next_event_time` when nothing is pending [s]."""

MEAN = "mean of `{}` over the last step, for masters that hold inputs; in model exchange, between the last two events"
"""Description of an output that is another one's mean."""


def time_rounding(t: float, h: float) -> float:
    """How close to the end of the step [t, t + h] an event counts as reached [s].

    A master's communication points carry rounding errors; an edge that is meant to fall on one must not be missed by
    one unit in the last place, because a master that holds inputs would then lose a whole step.
    """
    return 1e-9 * h + 64.0 * 2.220446049250313e-16 * abs(t)


def time_tolerance(m: Component, t: float, h: float) -> float:
    """Tolerance with which a kernel decides whether an event at t + h is reached [s]; negative while left limits are wanted."""
    return -time_rounding(t, h) if m.left_limits else time_rounding(t, h)


_ELEMENT = re.compile(r"(.+)\[(\d+)\]$")


def _place(error: BaseException) -> str:
    """File and line in which an error was raised."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return f"{os.path.basename(trace.tb_frame.f_code.co_filename)}:{trace.tb_lineno}" if trace is not None else "unknown place"


def _is_finite(value: Any) -> bool:
    return isinstance(value, float | int) and math.isfinite(value)  # the power of a negative number is complex


def _integer_problem(variable: Variable[Any], values: list[Any]) -> str | None:
    """What is wrong with values that a kernel has given an integer or Boolean variable; native code holds them in 32 bits."""
    low, high = (0, 1) if variable.kind is bool else (-(2**31), 2**31 - 1)
    if all(issubclass(kind, int) for kind in set(map(type, values))) and low <= min(values) and max(values) <= high:
        return None
    pairs = zip(variable.scalar_names, values, strict=True)
    label, value = next((n, x) for n, x in pairs if not isinstance(x, int) or not low <= x <= high)
    if not isinstance(value, int):
        return f"{label} became {value!r}, which is no integer; write int(...), round(...) or math.floor(...)"
    if variable.kind is bool:
        return f"{label} became {value}, which is no Boolean; write bool(...), or a comparison"
    shown = str(value) if value.bit_length() < 100 else f"an integer of {value.bit_length()} bits"
    return f"{label} = {shown} does not fit into an integer of 32 bits"


class Component:
    """Base of all components; see the module's text. The keyword arguments are start values of inputs and parameters."""

    left_limits: Variable[bool] = State(False)
    variables: ClassVar[dict[str, Variable[Any]]] = {"left_limits": left_limits}
    messages: ClassVar[dict[int, str]] = {}
    continuous_states: ClassVar[tuple[str, ...] | None] = None
    sampled: ClassVar[bool] = False
    default_stop_time: ClassVar[float] = 10.0
    default_step_size: ClassVar[float] = 0.01
    default_tolerance: ClassVar[float] = 1e-6
    about: ClassVar[dict[str, str]] = {}
    terminals: ClassVar[dict[str, dict[str, str]]] = {}
    _real_results: ClassVar[list[Variable[Any]]]
    _integers: ClassVar[list[Variable[Any]]]
    _slopes: ClassVar[frozenset[str]]
    _layout: ClassVar[struct.Struct]
    _digest: ClassVar[bytes]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        own = {name: value for name, value in vars(cls).items() if isinstance(value, Variable)}
        for name in own:
            if own[name].name != name:
                raise ComponentError(f"{cls.__name__}: {name} and {own[name].name} are one variable; declare each by itself")
            if name in Component.__dict__:
                raise ComponentError(f"{cls.__name__}: a variable cannot be called {name!r}, Component uses that name")
        cls.variables = {**cls.variables, **own}
        for base in cls.__mro__[1:]:
            cls.messages = {**getattr(base, "messages", {}), **cls.messages}
        results = [v for v in cls.variables.values() if v.causality in ("output", "local", "calculatedParameter")]
        cls._real_results = [v for v in results if v.kind is float]
        cls._integers = [v for v in cls.variables.values() if v.kind is not float]
        fields = [(v.name, v.code, v.size) for v in cls.variables.values()]
        cls._slopes = frozenset(v.slope for v in cls.variables.values() if v.slope)
        for name in cls._slopes:
            if cls.variables.get(name) is None or cls.variables[name].causality != "state":
                raise ComponentError(f"{cls.__name__}: the slope {name!r} of an input must be declared as a State")
        cls._layout = struct.Struct("<" + "".join(f"{v.size or 1}{v.code}" for v in cls.variables.values()))
        cls._digest = hashlib.sha256(repr((cls.__name__, fields)).encode()).digest()[:8]

    def __init__(self, **values: Any):
        for variable in self.variables.values():
            setattr(self, variable.name, variable.start)
        for name, value in values.items():
            self.set(name, value)

    def start(self) -> int | None:
        """Kernel: calculated parameters and initial states."""

    def step(self, t: float, h: float) -> int | None:
        """Kernel: outputs at t + h for inputs held over [t, t + h]."""
        raise ComponentError(f"{type(self).__name__} has no step function")

    def set(self, name: str, value: Any) -> None:
        """Set an input or parameter by name: a scalar, an element "x[2]", a sequence for the first elements of an array,
        or an enumeration item's name. Raises ComponentError for an unknown name or a value of another type."""
        match = _ELEMENT.match(name)
        variable = self.variables.get(match[1] if match else name)
        if variable is None or variable.causality not in ("input", "parameter") or (match and variable.size is None):
            known = [v.name for v in self.variables.values() if v.causality in ("input", "parameter")]
            raise ComponentError(f"{type(self).__name__} has no input or parameter {name!r}.{nearest(name, known)}")
        if variable.size is None:
            setattr(self, variable.name, self._converted(variable, value))
            return
        if not match and (isinstance(value, str) or not isinstance(value, Iterable)):
            what = f"{name} is an array of {variable.size} elements, not {value!r}"
            raise ComponentError(f"{type(self).__name__}: {what}; give a list, or one element: {name}[1]")
        values, offset = ([value], int(match[2]) - 1) if match else (list(value), 0)
        if not 0 <= offset <= variable.size - len(values):
            raise ComponentError(f"{type(self).__name__}: {name} takes elements 1 to {variable.size}, not {offset + len(values)}")
        for i, element in enumerate(values):
            getattr(self, variable.name)[offset + i] = self._converted(variable, element)

    def _converted(self, variable: Variable[Any], value: Any) -> Scalar:
        kind = variable.kind
        if isinstance(value, str) and issubclass(kind, enum.IntEnum):
            if value not in kind.__members__:
                raise ComponentError(
                    f"{type(self).__name__}: {value!r} is not a value of {variable.name}.{nearest(value, kind.__members__)}"
                )
            return kind[value]
        try:
            if not isinstance(value, str) and (kind is float or value == int(value)):
                return int(value) if issubclass(kind, enum.IntEnum) else kind(value)
        except (TypeError, ValueError, OverflowError):  # a list for a scalar, None, an integer of nan
            pass
        raise ComponentError(f"{type(self).__name__}: {variable.name} = {value!r} is not of type {kind.__name__}")

    def initialize(self, time: float = 0.0) -> None:
        """Check the parameters, then compute states and outputs at `time` [s] from scratch. Raises ComponentError."""
        self.check_values("parameter", "input")
        for variable in self.variables.values():
            if variable.causality not in ("input", "parameter") and variable.name not in self._slopes:
                setattr(self, variable.name, variable.start)
        self._run(time, self.start)
        self._run(time, self.step, time, 0.0)

    def do_step(self, time: float, step: float, left_limits: bool = False) -> None:
        """Advance from `time` by `step` >= 0 [s] with the inputs held. Raises ComponentError, and then the record is spent.

        With `left_limits`, events at the end of the step are left to a following step of length zero.
        """
        if not (math.isfinite(time) and math.isfinite(step) and step >= 0.0):
            raise ComponentError(
                f"{type(self).__name__}: a step of {step} s at t = {time} s is not possible; it must be finite and not negative"
            )
        self.check_values("input", when=f" at t = {time:.15g} s")
        self.left_limits = left_limits
        self._run(time, self.step, time, step)
        self.left_limits = False

    def check_values(self, *causalities: str, when: str = "") -> None:
        """Raise ArgumentError for the first value outside its domain among variables of these causalities."""
        for variable in self.variables.values():
            if variable.causality in causalities:
                for label, value in zip(variable.scalar_names, self._elements(variable), strict=True):
                    problem = variable.problem(label, value)
                    if problem:
                        raise ArgumentError(f"{type(self).__name__}: {variable.causality} {problem}{when}")

    def _elements(self, variable: Variable[Any]) -> list[Any]:
        value = getattr(self, variable.name)
        return [value] if variable.size is None else value

    def _run(self, time: float, kernel: Callable[..., int | None], *arguments: float) -> None:
        try:
            status = kernel(*arguments)
        except (ArithmeticError, ValueError, IndexError, TypeError, NameError) as error:  # native code has faults there
            raise ComponentError(f"{type(self).__name__}: {error} ({_place(error)}, t = {time:.15g} s)") from error
        if status:
            raise ComponentError(f"{type(self).__name__}: {self.explain(status)} (t = {time:.15g} s)")
        for variable in self._integers:
            problem = _integer_problem(variable, self._elements(variable))
            if problem:
                raise ComponentError(f"{type(self).__name__}: {problem} (t = {time:.15g} s)")
        for variable in self._real_results:
            values = self._elements(variable)
            if not all(map(_is_finite, values)):
                label, value = next(pair for pair in zip(variable.scalar_names, values, strict=True) if not _is_finite(pair[1]))
                raise ComponentError(f"{type(self).__name__}: {label} became {value} at t = {time:.15g} s")

    def explain(self, status: int) -> str:
        """The text of a kernel's status number, with the values of the variables it names."""

        def shown(match: re.Match[str]) -> str:
            if match[1] not in self.variables:
                return match[0]
            value, variable = getattr(self, match[1]), self.variables[match[1]]
            if issubclass(variable.kind, enum.IntEnum):
                return variable.kind(value).name
            return f"{value:.9g}" if isinstance(value, float) else str(value)

        return re.sub(r"\{(\w+)\}", shown, self.messages.get(status, f"failed with status {status}"))

    def _flat(self) -> Iterator[Scalar]:
        for variable in self.variables.values():
            yield from self._elements(variable)

    def get_state(self) -> bytes:
        """The whole record, exactly, as bytes of one length."""
        return self._digest + self._layout.pack(*self._flat())

    def set_state(self, state: bytes) -> None:
        """Restore what `get_state` returned. Raises ComponentError for the state of another component or version."""
        if len(state) != 8 + self._layout.size or state[:8] != self._digest:
            raise ComponentError(f"{type(self).__name__}: this is not the state of this component and version")
        values = iter(self._layout.unpack_from(state, 8))
        for variable in self.variables.values():
            elements = [variable.kind(next(values)) if variable.kind is bool else next(values) for _ in range(variable.size or 1)]
            setattr(self, variable.name, elements[0] if variable.size is None else elements)
