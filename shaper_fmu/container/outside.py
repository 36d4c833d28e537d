"""What a container shows: the variables of the FMU that a system becomes, and what they stand for inside."""

from __future__ import annotations

from dataclasses import dataclass

from fmpy.model_description import ModelVariable, Unit

from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.wiring import Port

Value = float | int | bool | str | bytes


@dataclass(frozen=True)
class Target:
    """A scalar inside, an element of an array by its own name, and how its value follows from the one outside.

    Of an input or a parameter: inside = gain * outside + offset; of all others: outside = gain * inside + offset. `mapping`, of
    booleans, integers and enumerations: what values become on that way, where they do not stay.
    """

    port: Port
    gain: float = 1.0
    offset: float = 0.0
    mapping: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class OuterVariable:
    """A variable of the container.

    Attributes:
        name: outside.
        causality: "input", "output", "parameter", "calculatedParameter", "local" or "structuralParameter" of FMI, as outside.
        variability: "continuous", "discrete", "tunable", "fixed" or "constant".
        type: in the outer version of FMI: "Real", "Integer", "Boolean", "String", "Enumeration" of FMI 2.0; "Float64", "Float32",
            "Int8" to "UInt64", "Boolean", "String", "Binary", "Enumeration" of FMI 3.0.
        dimensions: sizes of an array of FMI 3.0, () for a scalar.
        elements: for each element, in FMI's order, what it stands for: all that an input or a parameter sets; of any other, one.
        starts: a value for each element; () for none.
        shown: the inner variable whose unit, type, bounds, nominal value, description and initial it shows; a changed copy without
            a name where those are others outside.
        fmu: whose that is.
        unit: the definition of the unit outside, where it is another than the inner variable's.
        reference: its value reference (see interface.finished).
    """

    name: str
    causality: str
    variability: str
    type: str
    dimensions: tuple[int, ...]
    elements: tuple[tuple[Target, ...], ...]
    starts: tuple[Value, ...]
    shown: ModelVariable
    fmu: Fmu
    unit: Unit | None = None
    reference: int = 0
