"""Variables of components, as they are declared: name, type, unit, domain, and how FMI shows them.

Seen through the class, a declared variable is a `Variable`; through an instance, its value: a float, int or bool, or a list of
them for an array. This module uses the standard library alone, because every exported FMU carries it.
"""

from __future__ import annotations

import copy
import enum
import math
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, Literal, Protocol, TypedDict, TypeVar, overload

from shaper_fmu.errors import ComponentError

if TYPE_CHECKING:
    from typing import Unpack

MOST_ELEMENTS = 65535
"""Elements of an array; the exported C code counts them in 16 bits."""

Scalar = float | int | bool
Exclusive = bool | Literal["min", "max"]
Value = TypeVar("Value")
Number = TypeVar("Number", bool, int, float)


class Values(Protocol):
    """Numbers that a kernel reads: a list or a tuple in Python, a C array when compiled."""

    def __getitem__(self, index: int, /) -> float: ...


class Array(Values, Protocol):
    """An array of numbers that a kernel writes."""

    def __setitem__(self, index: int, value: float, /) -> None: ...


class Variable(Generic[Value]):
    """One declared variable of a component: a scalar, or an array of `size` elements (named x[1] .. x[size] in FMI 2).

    `Value` is what an instance of the component holds: float, int (also for an enumeration), bool, or a list of one of them.
    """

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
        self.name: str = ""
        self.causality: str = causality
        self.unit: str = unit
        self.description: str = description
        self.size: int | None = size
        self.min: float | None = min
        self.max: float | None = max
        self.exclusive: Exclusive = exclusive
        self.published: tuple[float | None, float | None] | None = published
        self.tunable: bool = tunable
        self.display_unit: str = display_unit
        self.depends: tuple[str, ...] | None = depends
        self.derivative: str = derivative
        self.slope: str = slope
        self.nominal: float | str | None = nominal
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
        self.starts: list[Scalar] = [self._started(value) for value in given]

    def _started(self, value: Any) -> Scalar:
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

        @overload
        def __get__(self, instance: None, owner: type) -> Variable[Value]: ...
        @overload
        def __get__(self, instance: object, owner: type) -> Value: ...
        def __get__(self, instance: object, owner: type) -> Any: ...
        def __set__(self, instance: object, value: Value) -> None: ...

    @property
    def start(self) -> Scalar | list[Scalar]:
        """A fresh start value: a scalar, or a list for an array."""
        return self.starts[0] if self.size is None else list(self.starts)

    def starting_at(self, start: Any) -> Variable[Value]:
        """The same variable with another start value (of an array, all of them), for a subclass of its component."""
        other = copy.copy(self)
        other.starts = [self._started(value) for value in ([start] if self.size is None else start)]
        if len(other.starts) != len(self.starts):
            raise ComponentError(f"{self.name}: {len(other.starts)} start values for {len(self.starts)} elements")
        return other

    def hidden(self) -> Variable[Value]:
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


class Options(TypedDict, total=False):
    """Arguments of a declaration besides start value and size; see Input, Output and Parameter."""

    kind: type
    min: float | None
    max: float | None
    exclusive: Exclusive
    published: tuple[float | None, float | None] | None
    tunable: bool
    display_unit: str
    depends: tuple[str, ...] | None
    derivative: str
    slope: str
    nominal: float | str | None


class Declaration(Protocol):
    """How a variable is declared whose start value is 0 unless it is given: its type follows from the start value and the size."""

    @overload
    def __call__(self, unit: str, description: str, *, size: None = None, **options: Unpack[Options]) -> Variable[float]: ...
    @overload
    def __call__(
        self, unit: str, description: str, start: Number, *, size: None = None, **options: Unpack[Options]
    ) -> Variable[Number]: ...
    @overload
    def __call__(self, unit: str, description: str, *, size: int, **options: Unpack[Options]) -> Variable[list[float]]: ...
    @overload
    def __call__(
        self, unit: str, description: str, start: Number | Sequence[Number], *, size: int, **options: Unpack[Options]
    ) -> Variable[list[Number]]: ...


class ParameterDeclaration(Protocol):
    """How a parameter is declared."""

    @overload
    def __call__(
        self, start: Number, unit: str, description: str, *, size: None = None, **options: Unpack[Options]
    ) -> Variable[Number]: ...
    @overload
    def __call__(
        self, start: Number | Sequence[Number], unit: str, description: str, *, size: int, **options: Unpack[Options]
    ) -> Variable[list[Number]]: ...


class StateDeclaration(Protocol):
    """How a field of the record is declared."""

    @overload
    def __call__(self, *, size: None = None, **options: Unpack[Options]) -> Variable[float]: ...
    @overload
    def __call__(self, start: Number, *, size: None = None, **options: Unpack[Options]) -> Variable[Number]: ...
    @overload
    def __call__(self, *, size: int, **options: Unpack[Options]) -> Variable[list[float]]: ...
    @overload
    def __call__(self, start: Number | Sequence[Number], *, size: int, **options: Unpack[Options]) -> Variable[list[Number]]: ...


def _declaration(function: Callable[..., Variable[Any]]) -> Declaration:
    return function


def _parameter_declaration(function: Callable[..., Variable[Any]]) -> ParameterDeclaration:
    return function


def _state_declaration(function: Callable[..., Variable[Any]]) -> StateDeclaration:
    return function


@_declaration
def Input(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable[Any]:
    """An input, held over a step. `slope` names the State that is its time derivative over the step, for kernels that are exact
    for inputs linear over the step, and that advance the input to the step's end. Options: kind, size."""
    return Variable("input", start, unit, description, **options)


@_declaration
def Output(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable[Any]:
    """An output. `depends` names the inputs that act on it without delay (default: all), `derivative` the variable that is
    its time derivative. `nominal` is its usual size, which solvers scale their tolerances by: a number, or the name of a
    variable of the same size that `start` computes. Options: kind, size, display_unit."""
    return Variable("output", start, unit, description, **options)


@_declaration
def Local(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable[Any]:
    """A variable to look at, not to connect: such as a state that is not an output, or its derivative. Options as of Output."""
    return Variable("local", start, unit, description, **options)


@_parameter_declaration
def Parameter(start: Any, unit: str, description: str, **options: Any) -> Variable[Any]:
    """A parameter with its start value and domain. `published` are the bounds (min, max) that the FMU tells in place of the
    domain's, None for none: numbers that it runs at, where the domain ends at one that it does not run at, such as a mass of 0.
    Options: kind, size, min, max, exclusive, published, tunable, display_unit."""
    return Variable("parameter", start, unit, description, **options)


@_declaration
def Calculated(unit: str, description: str, start: Any = 0.0, **options: Any) -> Variable[Any]:
    """A parameter that `start` computes from the others. Options: kind, size."""
    return Variable("calculatedParameter", start, unit, description, **options)


@_state_declaration
def State(start: Any = 0.0, **options: Any) -> Variable[Any]:
    """A field of the record that is not seen from outside, but saved with the FMU state. Options: kind, size."""
    return Variable("state", start, "", "internal state", **options)
