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
derivative jumps, though the output does not. This module uses the standard library alone, because
every exported FMU carries it.
"""

from __future__ import annotations

import copy
import enum
import hashlib
import math
import re
import struct
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from shaper_fmu.errors import ArgumentError, ComponentError, nearest

NO_EVENT = 1e300
"""Value of `next_event_time` when nothing is pending [s]."""

MEAN = "mean of `{}` over the last step, for masters that hold inputs; in model exchange, between the last two events"
"""Description of an output that is another one's mean."""

MOST_ELEMENTS = 65535
"""Elements of an array; the exported C code counts them in 16 bits."""

Scalar = float | int | bool
Exclusive = bool | Literal["min", "max"]


def time_rounding(t: float, h: float) -> float:
    """How close to the end of the step [t, t + h] an event counts as reached [s].

    A master's communication points carry rounding errors; an edge that is meant to fall on one must not be missed by
    one unit in the last place, because a master that holds inputs would then lose a whole step.
    """
    return 1e-9 * h + 64.0 * 2.220446049250313e-16 * abs(t)


def time_tolerance(m: Component, t: float, h: float) -> float:
    """Tolerance with which a kernel decides whether an event at t + h is reached [s]; negative while left limits are wanted."""
    return -time_rounding(t, h) if m.left_limits else time_rounding(t, h)


class Variable:
    """One declared variable of a component: a scalar, or an array of `size` elements (named x[1] .. x[size] in FMI 2)."""

    def __init__(
        self,
        causality: str,
        start: Any,
        unit: str,
        description: str,
        *,
        kind: type | None = None,
        size: int | None = None,
        min: float | None = None,
        max: float | None = None,
        exclusive: Exclusive = False,
        published: tuple[float | None, float | None] | None = None,
        tunable: bool = False,
        display_unit: str = "",
        depends: tuple[str, ...] | None = None,
        derivative: str = "",
        slope: str = "",
        nominal: float | str | None = None,
    ):
        self.name = ""
        self.causality, self.unit, self.description = causality, unit, description
        self.size, self.min, self.max, self.exclusive, self.published = size, min, max, exclusive, published
        self.tunable, self.display_unit, self.depends = tunable, display_unit, depends
        self.derivative, self.slope, self.nominal = derivative, slope, nominal
        first = start[0] if isinstance(start, list | tuple) and start else start
        if kind is not None and not isinstance(kind, type):
            raise ComponentError(f"{description!r}: kind = {kind!r} must be float, int, bool or an IntEnum")
        self.kind: type = kind or (type(first) if isinstance(first, enum.IntEnum | bool | int) else float)
        if size is not None and (type(size) is not int or not 1 <= size <= MOST_ELEMENTS):
            raise ComponentError(
                f"{description!r}: size = {size!r} must be a whole number from 1 to {MOST_ELEMENTS}; None is a scalar"
            )
        given = list(start) if isinstance(start, list | tuple) else [start] * (size or 1)
        if len(given) != (size or 1):
            raise ComponentError(f"{description!r}: {len(given)} start values for {size or 1} elements")
        self.starts = [self._started(value) for value in given]

    def _started(self, value: Any) -> Any:
        """A start value in the variable's type, if it has that type."""
        try:
            converted = self.kind(value)
            if not isinstance(value, str | bytes) and (self.kind is float or converted == value):
                return converted
        except (TypeError, ValueError, OverflowError):
            pass
        name = getattr(self.kind, "__name__", self.kind)
        raise ComponentError(f"{self.name or self.description!r}: the start value {value!r:.60} is not of type {name}")

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    if TYPE_CHECKING:  # seen through an instance, a variable is its value

        def __get__(self, instance: object, owner: type) -> Any: ...
        def __set__(self, instance: object, value: Any) -> None: ...

    @property
    def start(self) -> Any:
        """A fresh start value: a scalar, or a list for an array."""
        return self.starts[0] if self.size is None else list(self.starts)

    def starting_at(self, start: Any) -> Variable:
        """The same variable with another start value (of an array, all of them), for a subclass of its component."""
        other = copy.copy(self)
        other.starts = [self._started(value) for value in ([start] if self.size is None else start)]
        if len(other.starts) != len(self.starts):
            raise ComponentError(f"{self.name}: {len(other.starts)} start values for {len(self.starts)} elements")
        return other

    def hidden(self) -> Variable:
        """The same result as a field of the record that the FMU does not show, for a subclass of its component."""
        other = copy.copy(self)
        other.causality = "state"
        return other

    @property
    def published_bounds(self) -> dict[str, Scalar]:
        """Bounds as FMI has them, which belong to the domain: the `published` ones, where they are told; for an excluded one the
        next number; at zero the smallest that is normal, since some readers of XML refuse smaller ones."""
        if self.published is not None:
            told = zip(("min", "max"), self.published, strict=True)
            return {side: self.kind(bound) for side, bound in told if bound is not None}
        bounds: dict[str, Scalar] = {}
        for side, bound, inwards in (("min", self.min, 1), ("max", self.max, -1)):
            if bound is None:
                continue
            if self.exclusive not in (True, side):
                bounds[side] = self.kind(bound)
            elif self.kind is int:
                bounds[side] = int(bound) + inwards
            else:
                bounds[side] = inwards * sys.float_info.min if bound == 0.0 else math.nextafter(bound, inwards * math.inf)
        return bounds

    @property
    def scalar_names(self) -> list[str]:
        """The FMI 2 names: the name itself, or name[1] .. name[size]."""
        return [self.name] if self.size is None else [f"{self.name}[{i + 1}]" for i in range(self.size)]

    @property
    def code(self) -> str:
        """Format of one element in the record: a C double or a C int."""
        return "d" if self.kind is float else "i"

    @property
    def domain(self) -> str:
        """The values that it may have: "> 0", "0 <= . < 1", or the items of an enumeration; empty for all of them."""
        if issubclass(self.kind, enum.IntEnum):
            return ", ".join(f"{item.name} = {item.value}" for item in self.kind)
        low, high = ("<" if self.exclusive in (True, side) else "<=" for side in ("min", "max"))
        if self.min is not None and self.max is not None:
            return f"{self.min:g} {low} . {high} {self.max:g}"
        if self.min is not None:
            return f"{low.replace('<', '>')} {self.min:g}"
        return f"{high} {self.max:g}" if self.max is not None else ""

    def problem(self, label: str, value: Scalar) -> str | None:
        """The reason why `value` is invalid for the element named `label`, or None."""
        unit = f" {self.unit}" if self.unit else ""
        if issubclass(self.kind, enum.IntEnum):
            if value not in self.kind._value2member_map_:
                options = ", ".join(f"{item.name} ({item.value})" for item in self.kind)
                return f"{label} = {value} is not one of {options}"
            return None
        if not math.isfinite(value):
            return f"{label} is {value}; it must be a finite number"
        if self.min is not None:
            if self.exclusive in (True, "min") and not value > self.min:
                return f"{label} = {value:.15g}{unit} must be greater than {self.min:g}{unit}"
            if not value >= self.min:
                return f"{label} = {value:.15g}{unit} must be at least {self.min:g}{unit}"
        if self.max is not None:
            if self.exclusive in (True, "max") and not value < self.max:
                return f"{label} = {value:.15g}{unit} must be less than {self.max:g}{unit}"
            if not value <= self.max:
                return f"{label} = {value:.15g}{unit} must be at most {self.max:g}{unit}"
        return None


def Input(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable:
    """An input, held over a step. `slope` names the State that is its time derivative over the step, for kernels that are exact
    for inputs linear over the step, and that advance the input to the step's end. Options: kind, size."""
    return Variable("input", start, unit, description, **options)


def Output(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable:
    """An output. `depends` names the inputs that act on it without delay (default: all), `derivative` the variable that is
    its time derivative. `nominal` is its usual size, which solvers scale their tolerances by: a number, or the name of a
    variable of the same size that `start` computes. Options: kind, size, display_unit."""
    return Variable("output", start, unit, description, **options)


def Local(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable:
    """A variable to look at, not to connect: such as a state that is not an output, or its derivative. Options as of Output."""
    return Variable("local", start, unit, description, **options)


def Parameter(start: Any, unit: str, description: str, **options: Any) -> Variable:
    """A parameter with its start value and domain. `published` are the bounds (min, max) that the FMU tells in place of the
    domain's, None for none: numbers that it runs at, where the domain ends at one that it does not run at, such as a mass of 0.
    Options: kind, size, min, max, exclusive, published, tunable, display_unit."""
    return Variable("parameter", start, unit, description, **options)


def Calculated(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable:
    """A parameter that `start` computes from the others. Options: kind, size."""
    return Variable("calculatedParameter", start, unit, description, **options)


def State(start: Any = 0.0, **options: Any) -> Variable:
    """A field of the record that is not seen from outside, but saved with the FMU state. Options: kind, size."""
    return Variable("state", start, "", "internal state", **options)


_ELEMENT = re.compile(r"(.+)\[(\d+)\]$")


class Component:
    """Base of all components; see the module's text. The keyword arguments are start values of inputs and parameters."""

    left_limits = State(False)
    variables: ClassVar[dict[str, Variable]] = {"left_limits": left_limits}
    messages: ClassVar[dict[int, str]] = {}
    continuous_states: ClassVar[tuple[str, ...] | None] = None
    sampled: ClassVar[bool] = False
    default_stop_time: ClassVar[float] = 10.0
    default_step_size: ClassVar[float] = 0.01
    default_tolerance: ClassVar[float] = 1e-6
    _real_results: ClassVar[list[Variable]]
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
        values, offset = ([value], int(match[2]) - 1) if match else (list(value), 0)
        if not 0 <= offset <= variable.size - len(values):
            raise ComponentError(f"{type(self).__name__}: {name} takes elements 1 to {variable.size}, not {offset + len(values)}")
        for i, element in enumerate(values):
            getattr(self, variable.name)[offset + i] = self._converted(variable, element)

    def _converted(self, variable: Variable, value: Any) -> Scalar:
        kind = variable.kind
        if isinstance(value, str) and issubclass(kind, enum.IntEnum):
            if value not in kind.__members__:
                raise ComponentError(
                    f"{type(self).__name__}: {value!r} is not a value of {variable.name}.{nearest(value, kind.__members__)}"
                )
            return kind[value]
        if isinstance(value, str) or (kind is not float and value != int(value)):
            raise ComponentError(f"{type(self).__name__}: {variable.name} = {value!r} is not of type {kind.__name__}")
        return int(value) if issubclass(kind, enum.IntEnum) else kind(value)

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

    def _elements(self, variable: Variable) -> list[Any]:
        value = getattr(self, variable.name)
        return [value] if variable.size is None else value

    def _run(self, time: float, kernel: Any, *arguments: float) -> None:
        try:
            status = kernel(*arguments)
        except (ArithmeticError, ValueError) as error:  # math says "domain error" where C gives NaN
            raise ComponentError(f"{type(self).__name__}: {error} at t = {time:.15g} s") from error
        if status:
            raise ComponentError(f"{type(self).__name__}: {self.explain(status)} (t = {time:.15g} s)")
        for variable in self._real_results:
            if not all(map(math.isfinite, self._elements(variable))):
                found = zip(variable.scalar_names, self._elements(variable), strict=True)
                label, value = next(pair for pair in found if not math.isfinite(pair[1]))
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
