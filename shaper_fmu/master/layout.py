"""What the compiled loop works on: a system as arrays of numbers - addresses, references, places on the bus, times.

The bus is one array of doubles: the value of every output that is connected or recorded, and of every signal from outside.
A transfer moves values between the bus and one instance, by one call of one FMI function.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

INSTANCE = np.dtype(
    [
        ("handle", "u8"),
        ("version", "i4"),  # of FMI
        ("event_mode", "i4"),
        ("do_step", "u8"),
        ("enter_event_mode", "u8"),
        ("enter_step_mode", "u8"),
        ("update", "u8"),
        ("reset", "u8"),
        ("setup", "u8"),  # fmi2SetupExperiment
        ("enter_initialization", "u8"),
        ("exit_initialization", "u8"),
        ("tolerance", "f8"),  # of its solver, told at initialization; 0 for none
        ("answers", "u8"),  # address of 64 bytes for the answers of calls
        ("next_event", "f8"),  # told by the last update of discrete states
    ],
    align=True,
)

TRANSFER = np.dtype(
    [
        ("function", "u8"),
        ("handle", "u8"),
        ("version", "i4"),
        ("kind", "i4"),
        ("references", "u8"),  # their address
        ("reference_count", "u8"),
        ("elements", "u8"),  # address of the first of them
        ("element_count", "u8"),
        ("values", "u8"),  # their address
    ],
    align=True,
)

ELEMENT = np.dtype(
    [
        ("bus", "u8"),  # the address of its place on the bus
        ("gain", "f8"),
        ("shift", "f8"),
        ("mapping", "u8"),  # address of pairs: a value, and what it becomes
        ("mapped", "u4"),  # their number
        ("closed", "u4"),  # whether a value that is not among them is a fault: no item of an enumeration
    ],
    align=True,
)

TABLE = np.dtype(
    [("place", "i4"), ("linear", "i4"), ("first", "i4"), ("count", "i4"), ("cursor", "i4")],
    align=True,
)

SLOPE = np.dtype(
    [
        ("source", "i4"),  # its place on the bus
        ("held", "i4"),  # place of the source's value at the beginning of the step
        ("known", "i4"),  # whether the source steps before the input's instance
        ("gain", "f8"),
        ("previous", "f8"),  # the source's value at the beginning of the step before
        ("previous_time", "f8"),
        ("held_time", "f8"),
    ],
    align=True,
)
"""An input that is linear over a step."""

SLOPES_OF = np.dtype(
    [
        ("function", "u8"),
        ("handle", "u8"),
        ("references", "u8"),
        ("orders", "u8"),
        ("values", "u8"),
        ("instance", "i4"),
        ("first", "i4"),  # of the rows of SLOPE
        ("rows", "i4"),
    ],
    align=True,
)
"""The call that tells an instance the slopes of its inputs."""

CLOCK = np.dtype(
    [
        ("kind", "i4"),
        ("instance", "i4"),
        ("asked", "i4"),  # for its interval: 0 never, or ONCE, or ALWAYS
        ("fraction", "i4"),  # as a fraction
        ("reference", "u8"),  # address of its value reference
        ("set", "u8"),  # fmi3SetClock
        ("get", "u8"),  # fmi3GetClock
        ("get_interval", "u8"),
        ("get_shift", "u8"),
        ("targets", "i4"),  # of an output clock: the first of the clocks that tick with it, among `clock_numbers`
        ("target_count", "i4"),
        ("within", "i4"),  # of an output clock: the first of those clocks while which it can be read, among `clock_numbers`
        ("within_count", "i4"),  # 0: always
        ("origin", "f8"),  # a periodic clock ticks at origin + (shift + count * interval) / resolution
        ("shift", "f8"),
        ("interval", "f8"),
        ("resolution", "f8"),
        ("count", "i8"),
        ("next", "f8"),  # tick, if it is timed
        ("active", "i4"),  # it ticks now
        ("ticked", "f8"),  # when it has ticked last
        ("ticks", "i4"),  # how often it has then
    ],
    align=True,
)

CLOCK_GUARD = np.dtype([("first", "i4"), ("count", "i4"), ("skip", "i4"), ("once", "i4")], align=True)
"""Of the operations after it in a program: their clocks among `clock_numbers`, how many operations these are, and whether they are
done once for a tick, not again when another clock ticks because of it."""

# Kinds of clocks.
PERIODIC, CHANGING, COUNTDOWN, TRIGGERED, TRIGGERING = range(5)
ONCE, ALWAYS = 1, 2  # in initialization mode; in event mode, too

_SOURCES = ("layout", "arithmetic", "calls", "transfers", "execution", "clock_loop", "event_loop", "compiled", "whole_run")


def _sources_digest() -> str:
    folder = Path(__file__).parent
    others = [folder.parent / "component.py", folder.parent / "metrics" / "metric.py"]  # time_rounding; what metrics gather
    files = [*others, *[folder / f"{name}.py" for name in _SOURCES]]
    texts = [file.read_bytes() for file in files]
    return hashlib.sha256(b"\0".join(texts)).hexdigest()[:16]


SOURCES_DIGEST = _sources_digest()
"""Stands for the loop's sources; see transfers.compiled."""

GUARD = np.dtype([("first", "i4"), ("count", "i4"), ("skip", "i4"), ("due", "i4"), ("open", "i4")], align=True)
"""Of the operations after it in a program: its causes, how many operations it guards, whether one is due, whether they are done."""

WATCHED = np.dtype([("place", "i4"), ("value", "f8")], align=True)
"""Of an input that is set in event mode alone: its source's place on the bus, and the value that it has got."""

JUMPS = -(1 << 30)
"""The cause that stands for jumps of tables; others are places of announced times on the bus, or -1 - instance."""

CONTROL = np.dtype(
    [
        ("start", "f8"),
        ("stop", "f8"),
        ("step", "f8"),
        ("steps", "i8"),  # on the grid
        ("done", "i8"),  # of them
        ("t", "f8"),
        ("target", "f8"),
        ("exact", "i4"),  # whether steps end at events
        ("at_grid", "i4"),  # whether the target is a point of the grid
        ("at_event", "i4"),
        ("ends_whole", "i4"),  # whether the last step is as long as the others
        ("resuming", "i4"),  # whether steps have been taken before the event
        ("all_open", "i4"),  # whether no guard counts
        ("ends_at_event", "i4"),  # whether an announced event is at the end of the step
        ("smooth_from", "f8"),  # time of the last event
        ("everywhere", "i4"),  # whether rows are recorded at events, too, on both sides
        ("silent", "i4"),  # nothing is recorded or measured: the step may be taken back
        ("unrecorded", "i4"),  # the metrics are all that is kept
        ("stop_place", "i4"),  # of a variable that ends the run once it has been true for `stop_hold`; -1 for none
        ("stop_hold", "f8"),
        ("true_since", "f8"),
        ("exchange", "i4"),  # whether values are exchanged after each step (jacobi)
        ("returning", "i4"),  # whether FMUs may be set back to earlier times; they are told
        ("rereading", "i4"),  # whether all is read again at events, since what follows the inputs is not declared
        ("on_grid", "i4"),  # clocks tick at points of the grid alone
        ("functions", "i4"),  # how many values at the end of the step wait on the bus, of inputs that functions give
        ("function_place", "i4"),  # of the first one; those at the end come after all of them
        ("cut", "i4"),  # whether an early return may end the step for all
        ("jump", "i4"),  # the next one of the tables
        ("rows", "i8"),  # recorded
        ("room", "i8"),  # for rows
        ("next_time", "u8"),  # addresses of the next row, in the record
        ("next_row", "u8"),
        ("events", "i8"),
        ("warnings", "i8"),
        ("warned", "i8"),  # by the last of them: the instance, or the transfer
        ("fault", "i4"),
        ("fault_status", "i4"),
        ("fault_where", "i4"),  # the instance, or the transfer
        ("fault_element", "i4"),
        ("fault_time", "f8"),
    ],
    align=True,
)

# Types of values in memory.
F8, F4, I1, U1, I2, U2, I4, U4, I8, U8, BOOLEAN2, BOOLEAN3 = range(12)
SIZES = {F8: 8, F4: 4, I1: 1, U1: 1, I2: 2, U2: 2, I4: 4, U4: 4, I8: 8, U8: 8, BOOLEAN2: 4, BOOLEAN3: 1}

# Operations of a program: pairs of a code and what it works on. 2: reals, steps of FMI 2.0; KEEP: what has been set, to the bus;
# AGAIN: what has been set before the event.
SET2, GET2, STEP2, SET, GET, STEP3, TABLES_BEFORE, TABLES_NOW, HOLD, SLOPES, GUARDED, KEEP, AGAIN, CLOCKED = range(14)

# Faults.
NO_FAULT, CALL_FAILED, NOT_FINITE, EARLY_RETURN, TERMINATED, ENDLESS_EVENTS, NOT_IN_RANGE, NO_ITEM = range(8)
BAD_INTERVAL, NO_INTERVAL, OFF_GRID, ENDLESS_TICKS = range(8, 12)  # of a clock, whose number is the element

NO_EVENT = 1e300


class Layout(NamedTuple):
    """A system, ready for the loop. Shapes: (n,), but for programs, (n, 2), and the record, (rows, recorded)."""

    instances: np.ndarray
    transfers: np.ndarray
    elements: np.ndarray
    references: np.ndarray
    memory: np.ndarray  # addresses in the tables above point into it
    bus: np.ndarray
    tables: np.ndarray
    table_times: np.ndarray
    table_values: np.ndarray
    jumps: np.ndarray  # times at which tables jump
    event_places: np.ndarray  # of outputs that announce events
    recorded: np.ndarray
    metrics: np.ndarray
    step_program: np.ndarray
    exchange_program: np.ndarray  # between steps
    read_program: np.ndarray
    slopes: np.ndarray
    slopes_of: np.ndarray
    jump_program: np.ndarray  # for steps that end at an announced event
    guards: np.ndarray
    causes: np.ndarray  # of guards
    start_program: np.ndarray  # sets the start values of a batch's runs
    mappings: np.ndarray  # pairs of values, one after the other
    initial_program: np.ndarray  # the exchange during initialization
    final_program: np.ndarray  # the exchange after the last step
    event_program: np.ndarray  # the exchange at events
    event_read_program: np.ndarray
    resume_program: np.ndarray  # between event mode and the next step
    watched: np.ndarray  # sources of inputs that are set in event mode alone
    clocks: np.ndarray
    clock_guards: np.ndarray
    clock_numbers: np.ndarray  # of clocks that belong to another one, or to a guard
    clock_program: np.ndarray  # sets and reads clocked variables in initialization mode
    tick_program: np.ndarray  # exchanges values while clocks tick


def addresses_of(layout: Layout) -> np.ndarray:
    """Address and length of each array, shape (n, 2), in the order of the fields: what the compiled loop is given."""
    return np.array([(array.ctypes.data, len(array)) for array in layout], np.uintp)
