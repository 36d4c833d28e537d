"""The base class of metrics: each metric is a class in its own file, and declares itself.

The compiled loop sees every macro step and both sides of every event, and gathers a few numbers of each run (`GATHERED`); a metric
says of which variables and in which way (`Needs`), and makes its value of them.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

import msgspec
import numpy as np

from shaper_fmu.records import record


class Gathering(IntEnum):
    """What the loop gathers besides the first and the last value."""

    EXTREMES, ENVELOPE, OUTSIDE, SQUARE = range(4)


EXTREMES, ENVELOPE, OUTSIDE, SQUARE = Gathering

GATHERED = record(
    "Metric",
    """
    int32_t kind;
    int32_t place;
    int32_t command;                // whose last change begins it; -1 for none
    int32_t rate;
    double parameter;
    double rest;
    double commanded;
    double begin;
    double time;                    // of the last value
    double first;
    double last;
    double largest;
    double smallest;
    double sum;
    """,
)
"""A metric's numbers in the loop; `begin` and `time` are those of the first and the last value [s]."""


class Needs(NamedTuple):
    """What is to be gathered of the variable `output`, x: `largest` and `smallest`, and by `kind`

    - EXTREMES: nothing else;
    - ENVELOPE: `largest` is that of hypot(x - rest, rate / parameter), from 0 on;
    - OUTSIDE: `sum` is the last time at which |x - rest| was above `parameter` [s];
    - SQUARE: `sum` is the integral of x^2 over time, x held over the steps.

    All begin anew at each change of the variable `command`. `parameter` has to be positive where it is used.
    """

    output: str
    command: str = ""
    rate: str = ""
    parameter: float = 0.0
    rest: float = 0.0
    kind: int = EXTREMES

    @property
    def variables(self) -> list[str]:
        """The variables, "instance.variable"."""
        return [name for name in (self.output, self.command, self.rate) if name]


class Metric(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind"):
    """Base of all metrics: of the variable `output`, "instance.variable".

    A metric is a class with a `tag`, its `kind` in study files; its fields are the keys there, in this order, and both are in
    people's files and never change. The first line of its docstring is its row in the documentation.
    """

    output: str

    unit: ClassVar[str] = ""
    """The unit in which people see it; "" for that of the output. "%" is for shares, of which 5 % are tolerated."""

    factor: ClassVar[float] = 1.0
    """What people see is the value times this; used with a unit of its own."""

    def needs(self) -> Needs:
        """The quantities that the loop gathers."""
        return Needs(self.output)

    def values(self, gathered: np.ndarray) -> np.ndarray:
        """The metric of each run, shape (n,), from what the loop has gathered, shape (n,), of type `GATHERED`."""
        raise NotImplementedError

    def unfinished(self, gathered: np.ndarray) -> np.ndarray:
        """Whether the value of each run means nothing: a command that is measured from its end must have come to it."""
        return (gathered["begin"] >= gathered["time"]) & bool(self.needs().command)

    def problem(self, row: Any) -> str:
        """The message for an unfinished run."""
        return f"{self.needs().command} has not come to its end by t = {row['time']:g} s; run for longer"

    @classmethod
    def kind(cls) -> str:
        """Its name in study files."""
        return str(cls.__struct_config__.tag)

    @classmethod
    def fields(cls) -> tuple[str, ...]:
        """Its keys in study files."""
        return cls.__struct_fields__

    @classmethod
    def summary(cls) -> str:
        """A description in one line."""
        return (cls.__doc__ or "").partition("\n")[0].removesuffix(".")
