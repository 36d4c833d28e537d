"""What the loop works on: a system as arrays of numbers - addresses, references, places on the bus, times.

The bus is one array of doubles: the value of every output that is connected or recorded, and of every signal from outside.
A transfer moves values between the bus and one instance, by one call of one FMI function.

What is declared here is the loop's header, too (see loop_header.py): no offset and no number is written twice.
"""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from shaper_fmu.component import NO_EVENT as NO_EVENT
from shaper_fmu.master.layout_numbers import AGAIN as AGAIN
from shaper_fmu.master.layout_numbers import ALWAYS as ALWAYS
from shaper_fmu.master.layout_numbers import BAD_INTERVAL as BAD_INTERVAL
from shaper_fmu.master.layout_numbers import BOOLEAN2 as BOOLEAN2
from shaper_fmu.master.layout_numbers import BOOLEAN3 as BOOLEAN3
from shaper_fmu.master.layout_numbers import CALL_FAILED as CALL_FAILED
from shaper_fmu.master.layout_numbers import CHANGING as CHANGING
from shaper_fmu.master.layout_numbers import CLOCKED as CLOCKED
from shaper_fmu.master.layout_numbers import COUNTDOWN as COUNTDOWN
from shaper_fmu.master.layout_numbers import EARLY_RETURN as EARLY_RETURN
from shaper_fmu.master.layout_numbers import ENDLESS_EVENTS as ENDLESS_EVENTS
from shaper_fmu.master.layout_numbers import ENDLESS_STATE_EVENTS as ENDLESS_STATE_EVENTS
from shaper_fmu.master.layout_numbers import ENDLESS_TICKS as ENDLESS_TICKS
from shaper_fmu.master.layout_numbers import F4 as F4
from shaper_fmu.master.layout_numbers import F8 as F8
from shaper_fmu.master.layout_numbers import FAULT as FAULT
from shaper_fmu.master.layout_numbers import FINISHED as FINISHED
from shaper_fmu.master.layout_numbers import FULL as FULL
from shaper_fmu.master.layout_numbers import GET as GET
from shaper_fmu.master.layout_numbers import GET2 as GET2
from shaper_fmu.master.layout_numbers import GOING_ON as GOING_ON
from shaper_fmu.master.layout_numbers import GUARDED as GUARDED
from shaper_fmu.master.layout_numbers import HOLD as HOLD
from shaper_fmu.master.layout_numbers import I1 as I1
from shaper_fmu.master.layout_numbers import I2 as I2
from shaper_fmu.master.layout_numbers import I4 as I4
from shaper_fmu.master.layout_numbers import I8 as I8
from shaper_fmu.master.layout_numbers import JUMPS as JUMPS
from shaper_fmu.master.layout_numbers import KEEP as KEEP
from shaper_fmu.master.layout_numbers import NO_FAULT as NO_FAULT
from shaper_fmu.master.layout_numbers import NO_INTERVAL as NO_INTERVAL
from shaper_fmu.master.layout_numbers import NO_ITEM as NO_ITEM
from shaper_fmu.master.layout_numbers import NOT_A_NUMBER as NOT_A_NUMBER
from shaper_fmu.master.layout_numbers import NOT_FINITE as NOT_FINITE
from shaper_fmu.master.layout_numbers import NOT_IN_RANGE as NOT_IN_RANGE
from shaper_fmu.master.layout_numbers import OFF_GRID as OFF_GRID
from shaper_fmu.master.layout_numbers import ONCE as ONCE
from shaper_fmu.master.layout_numbers import OPEN_LOOP as OPEN_LOOP
from shaper_fmu.master.layout_numbers import OTHER_COUNT as OTHER_COUNT
from shaper_fmu.master.layout_numbers import PERIODIC as PERIODIC
from shaper_fmu.master.layout_numbers import SET as SET
from shaper_fmu.master.layout_numbers import SET2 as SET2
from shaper_fmu.master.layout_numbers import SIZES as SIZES
from shaper_fmu.master.layout_numbers import SLOPES as SLOPES
from shaper_fmu.master.layout_numbers import SOLVE as SOLVE
from shaper_fmu.master.layout_numbers import SOLVER_FAULT as SOLVER_FAULT
from shaper_fmu.master.layout_numbers import STEP1 as STEP1
from shaper_fmu.master.layout_numbers import STEP2 as STEP2
from shaper_fmu.master.layout_numbers import STEP3 as STEP3
from shaper_fmu.master.layout_numbers import TABLES_BEFORE as TABLES_BEFORE
from shaper_fmu.master.layout_numbers import TABLES_NOW as TABLES_NOW
from shaper_fmu.master.layout_numbers import TERMINATED as TERMINATED
from shaper_fmu.master.layout_numbers import TRIGGERED as TRIGGERED
from shaper_fmu.master.layout_numbers import TRIGGERING as TRIGGERING
from shaper_fmu.master.layout_numbers import U1 as U1
from shaper_fmu.master.layout_numbers import U2 as U2
from shaper_fmu.master.layout_numbers import U4 as U4
from shaper_fmu.master.layout_numbers import U8 as U8
from shaper_fmu.master.layout_numbers import Answer as Answer
from shaper_fmu.master.layout_numbers import Asked as Asked
from shaper_fmu.master.layout_numbers import Called as Called
from shaper_fmu.master.layout_numbers import ClockKind as ClockKind
from shaper_fmu.master.layout_numbers import Code as Code
from shaper_fmu.master.layout_numbers import Fault as Fault
from shaper_fmu.master.layout_numbers import ValueType as ValueType
from shaper_fmu.master.layout_records import CLOCK as CLOCK
from shaper_fmu.master.layout_records import CLOCK_GUARD as CLOCK_GUARD
from shaper_fmu.master.layout_records import CONTROL as CONTROL
from shaper_fmu.master.layout_records import ELEMENT as ELEMENT
from shaper_fmu.master.layout_records import GUARD as GUARD
from shaper_fmu.master.layout_records import INSTANCE as INSTANCE
from shaper_fmu.master.layout_records import OPERATION as OPERATION
from shaper_fmu.master.layout_records import RUNS as RUNS
from shaper_fmu.master.layout_records import SLOPE as SLOPE
from shaper_fmu.master.layout_records import SLOPES_OF as SLOPES_OF
from shaper_fmu.master.layout_records import TABLE as TABLE
from shaper_fmu.master.layout_records import TRANSFER as TRANSFER
from shaper_fmu.master.layout_records import WATCHED as WATCHED
from shaper_fmu.master.layout_solver import INPUT_QUERY as INPUT_QUERY
from shaper_fmu.master.layout_solver import PART as PART
from shaper_fmu.master.layout_solver import SOLVER as SOLVER
from shaper_fmu.metrics.metric import GATHERED
from shaper_fmu.records import ctypes_fields, numpy_type


class Control(ctypes.Structure):
    """The state of a run."""

    _fields_ = ctypes_fields(CONTROL)
    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...
        def __setattr__(self, name: str, value: Any) -> None: ...


class Runs(ctypes.Structure):
    """Whole runs, and how far they have come."""

    _fields_ = ctypes_fields(RUNS)
    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...


class Layout(NamedTuple):
    """A system, ready for the loop: arrays, with what their elements are in C."""

    instances: Annotated[np.ndarray, INSTANCE]
    transfers: Annotated[np.ndarray, TRANSFER]
    elements: Annotated[np.ndarray, ELEMENT]
    references: Annotated[np.ndarray, "uint32_t"]
    memory: Annotated[np.ndarray, "double"]  # addresses in the tables above point into it
    bus: Annotated[np.ndarray, "double"]
    tables: Annotated[np.ndarray, TABLE]
    table_times: Annotated[np.ndarray, "double"]
    table_values: Annotated[np.ndarray, "double"]
    jumps: Annotated[np.ndarray, "double"]  # times at which tables jump
    event_places: Annotated[np.ndarray, "int32_t"]  # of outputs that announce events
    recorded: Annotated[np.ndarray, "int32_t"]
    metrics: Annotated[np.ndarray, GATHERED]
    step_program: Annotated[np.ndarray, OPERATION]
    exchange_program: Annotated[np.ndarray, OPERATION]  # between steps
    read_program: Annotated[np.ndarray, OPERATION]
    slopes: Annotated[np.ndarray, SLOPE]
    slopes_of: Annotated[np.ndarray, SLOPES_OF]
    jump_program: Annotated[np.ndarray, OPERATION]  # for steps that end at an announced event
    guards: Annotated[np.ndarray, GUARD]
    causes: Annotated[np.ndarray, "int32_t"]  # of guards
    start_program: Annotated[np.ndarray, OPERATION]  # sets the start values of a batch's runs
    mappings: Annotated[np.ndarray, "double"]  # pairs of values, one after the other
    initial_program: Annotated[np.ndarray, OPERATION]  # the exchange during initialization
    final_program: Annotated[np.ndarray, OPERATION]  # the exchange after the last step
    event_program: Annotated[np.ndarray, OPERATION]  # the exchange at events
    event_read_program: Annotated[np.ndarray, OPERATION]
    resume_program: Annotated[np.ndarray, OPERATION]  # between event mode and the next step
    watched: Annotated[np.ndarray, WATCHED]  # sources of inputs that are set in event mode alone
    clocks: Annotated[np.ndarray, CLOCK]
    clock_guards: Annotated[np.ndarray, CLOCK_GUARD]
    clock_numbers: Annotated[np.ndarray, "int32_t"]  # of clocks that belong to another one, or to a guard
    clock_program: Annotated[np.ndarray, OPERATION]  # sets and reads clocked variables in initialization mode
    tick_program: Annotated[np.ndarray, OPERATION]  # exchanges values while clocks tick
    parts: Annotated[np.ndarray, PART]  # FMUs of model exchange
    solvers: Annotated[np.ndarray, SOLVER]  # theirs; none, or one
    input_queries: Annotated[np.ndarray, INPUT_QUERY]  # of parts, from outside: where they change, the solver begins anew
    coupled_read_program: Annotated[np.ndarray, OPERATION]  # reads what parts that are solved as one give each other
    coupled_program: Annotated[np.ndarray, OPERATION]  # the exchange between them
    coupled_event_program: Annotated[np.ndarray, OPERATION]  # the same at events
    cut_places: Annotated[np.ndarray, "int32_t"]  # of the sources of cut inputs in loops between them
    loop_memory: Annotated[np.ndarray, "double"]  # four vectors, a matrix, and whether it is known
    early_program: Annotated[np.ndarray, OPERATION]  # sets inputs of FMI 1.0's instances before they are initialized


ELEMENTS: dict[str, np.dtype | str] = {
    name: hint.__metadata__[0] for name, hint in get_type_hints(Layout, include_extras=True).items()
}
"""What the elements of each array are: a record, or a type of C."""

_TYPES = [kind if isinstance(kind, np.dtype) else numpy_type(kind) for kind in ELEMENTS.values()]


def addresses_of(layout: Layout) -> np.ndarray:
    """Address and length of each array, shape (n, 2), in the order of the fields: what the loop is given as its System."""
    for name, array, kind in zip(Layout._fields, layout, _TYPES, strict=True):
        if array.dtype != kind or array.ndim != 1 or not array.flags.c_contiguous:
            raise TypeError(f"{name}: {array.dtype} in {array.ndim} dimensions is not {kind}")
    return np.array([(array.ctypes.data, len(array)) for array in layout], np.uintp)
