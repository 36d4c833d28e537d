"""What the loop works on: a system as arrays of numbers - addresses, references, places on the bus, times.

The bus is one array of doubles: the value of every output that is connected or recorded, and of every signal from outside.
A transfer moves values between the bus and one instance, by one call of one FMI function.

What is declared here is the loop's header, too (see loop_header.py): no offset and no number is written twice.
"""

from __future__ import annotations

import ctypes
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from shaper_fmu.component import NO_EVENT as NO_EVENT
from shaper_fmu.metrics.metric import GATHERED
from shaper_fmu.records import ctypes_fields, numpy_type, record

INSTANCE = record(
    "Instance",
    """
    void *handle;
    int32_t version;                // of FMI
    int32_t event_mode;
    int32_t model_exchange;
    int32_t rigid;                  // whether it takes steps of one length alone
    Function do_step;
    Function enter_event_mode;
    Function enter_step_mode;
    Function update;
    Function reset;
    Function setup;                 // fmi2SetupExperiment
    Function enter_initialization;
    Function exit_initialization;
    double tolerance;               // of its solver, told at initialization; 0 for none
    double next_event;              // told by the last update of discrete states
    int32_t initialized;            // since it was made or reset, of FMI 1.0
    int32_t informed;               // whether its initialization, of FMI 1.0, knows all inputs
    int32_t settled;                // whether its discrete states were updated by that
    """,
)

ELEMENT = record(
    "Element",
    """
    double *bus;                    // its place there
    double gain;
    double shift;
    const double *mapping;          // pairs: a value, and what it becomes
    uint32_t mapped;                // their number
    uint32_t closed;                // whether a value that is not among them is a fault: no item of an enumeration
    """,
)

TRANSFER = record(
    "Transfer",
    """
    Function function;              // none where the values are wanted, but not for the FMU
    void *handle;
    int32_t version;                // of FMI
    int32_t type;                   // of the values
    const uint32_t *references;
    size_t reference_count;
    const Element *elements;
    size_t element_count;
    int32_t sparing;                // whether the FMU is only told values that differ from the last ones
    int32_t told;                   // whether it has been told any
    void *values;
    """,
)

OPERATION = record(
    "Operation",
    """
    int32_t code;
    int32_t number;                 // of what it works on
    """,
)

TABLE = record(
    "Table",
    """
    int32_t place;
    int32_t linear;
    int32_t first;
    int32_t count;
    int32_t cursor;
    """,
)

SLOPE = record(
    "Slope",
    """
    int32_t source;                 // its place on the bus
    int32_t held;                   // place of the source's value at the beginning of the step
    int32_t known;                  // whether the source steps before the input's instance
    double gain;
    double previous;                // the source's value at the beginning of the step before
    double previous_time;
    double held_time;
    """,
)
"""An input that is linear over a step."""

SLOPES_OF = record(
    "SlopeCall",
    """
    Function function;              // none for a part: the solver moves its inputs itself, by the functions below
    void *handle;
    const uint32_t *references;
    const int32_t *orders;
    double *values;
    Function get;
    Function set;
    double *base;                   // values at the beginning of the step
    double *moved;
    double from;                    // when that was
    int32_t version;                // of FMI
    int32_t instance;
    int32_t first;                  // of the slopes
    int32_t count;
    """,
)
"""The call that tells an instance the slopes of its inputs."""

CLOCK = record(
    "Clock",
    """
    int32_t kind;
    int32_t instance;
    int32_t asked;                  // for its interval
    int32_t fraction;               // as a fraction
    const uint32_t *reference;
    Function set;                   // fmi3SetClock
    Function get;                   // fmi3GetClock
    Function get_interval;
    Function get_shift;
    int32_t targets;                // of an output clock: the first of the clocks that tick with it, among `clock_numbers`
    int32_t target_count;
    int32_t within;                 // of an output clock: the first of those clocks while which it can be read
    int32_t within_count;           // 0: always
    double origin;                  // a periodic clock ticks at origin + (shift + count * interval) / resolution
    double shift;
    double interval;
    double resolution;
    int64_t count;
    double next;                    // tick, if it is timed
    int32_t active;                 // it ticks now: 1, and 2 once it has sampled
    double ticked;                  // when it has ticked last
    int32_t ticks;                  // how often it has then
    """,
)

CLOCK_GUARD = record(
    "ClockGuard",
    """
    int32_t first;                  // of its clocks, among `clock_numbers`
    int32_t count;
    int32_t skip;                   // how many operations it guards
    int32_t once;                   // for a tick, not again when another clock ticks because of it
    """,
)
"""Of the operations after it in a program."""

GUARD = record(
    "Guard",
    """
    int32_t first;                  // of its causes
    int32_t count;
    int32_t skip;                   // how many operations it guards
    int32_t due;                    // whether one of the causes is
    int32_t open;                   // whether the operations are done
    """,
)
"""Of the operations after it in a program."""

PART = record(
    "Part",
    """
    void *handle;
    int32_t instance;               // its number
    int32_t version;                // of FMI
    int32_t first;                  // of its states, among all
    int32_t states;
    int32_t first_indicator;
    int32_t indicators;             // of events
    Function set_time;
    Function set_states;
    Function get_states;
    Function get_nominals;          // of states; none where the FMU has none
    Function get_derivatives;
    Function get_indicators;
    Function completed;             // none where it does not want to hear of completed steps
    Function directional;           // derivatives; none where it has none
    const uint32_t *references;     // of states
    const uint32_t *rates;          // references of their derivatives
    int32_t placed;                 // whether it has been since it has heard of the end of a step
    uint32_t checked;               // functions that are known to write no more values than they are asked for
    """,
)
"""An FMU without a solver of its own: a part of the system of equations."""

SOLVER = record(
    "Solver",
    """
    void *memory;                   // CVODE's
    void *stiff_memory;             // for stiff systems: taken instead where the first one takes too many steps; or none
    int32_t is_stiff;               // whether both have been exchanged
    void *state;                    // vectors of CVODE's, and their values
    double *state_values;
    void *absolute;                 // tolerances
    double *absolute_values;
    void *between;                  // states at a time within a step
    double *between_values;
    double relative;                // tolerance
    int32_t states;
    int32_t indicators;
    Function step;                  // CVode
    Function begin;                 // CVodeReInit
    Function interpolate;           // CVodeGetDky
    Function set_stop;              // CVodeSetStopTime
    Function set_longest;           // CVodeSetMaxStep
    Function set_first;             // CVodeSetInitStep
    Function set_tolerances;        // CVodeSVtolerances
    Function data;                  // N_VGetArrayPointer
    Function column;                // SUNDenseMatrix_Column
    double **columns;               // of the Jacobian
    double *begin_values;           // states at the beginning
    double *left_indicators;        // at the end of a step
    int32_t has_left;               // whether they are known
    double *indicator_values;
    double *spare;                  // where what functions write is looked at once
    size_t spare_count;
    int32_t *signs;                 // of event indicators that are 0 there: what they become
    const void *system;             // at work
    void *control;
    double reached;                 // the end of its last step
    double last_event;
    double last_interval;           // between events
    int32_t restart;                // whether it has to begin anew
    int32_t pending;                // whether the parts have not heard of the end of its last step
    int32_t at_root;                // whether an event indicator changes its sign there
    int32_t held_back;              // whether it does not go beyond the step's end, where inputs may jump
    int32_t events_at_once;
    int32_t shrinking;              // intervals between events, one after the other
    int32_t watching;               // indicators that were 0, in the first step or in later ones: they must not leave it unseen
    int32_t leaving;                // whether one has
    """,
)
"""Of all parts together."""

INPUT_QUERY = record(
    "InputQuery",
    """
    int32_t transfer;               // that asks for inputs of a part
    size_t bytes;                   // of their values
    void *known;                    // the values at the last step
    int32_t refused;                // it is not answered
    """,
)

WATCHED = record(
    "WatchedInput",
    """
    int32_t place;                  // of its source on the bus
    int32_t instance;
    double value;                   // that it has got
    double before;                  // that of its source before the last update of discrete states
    """,
)
"""Of an input that is set in event mode alone."""

CONTROL = record(
    "Control",
    """
    double start;
    double stop;
    double step;
    int64_t steps;                  // on the grid
    int64_t done;                   // of them
    double t;
    double target;
    double horizon;                 // the earliest known event
    int32_t exact;                  // whether steps end at events
    int32_t at_grid;                // whether the target is a point of the grid
    int32_t at_event;
    int32_t ends_whole;             // whether the last step is as long as the others
    int32_t resuming;               // whether steps have been taken before the event
    int32_t all_open;               // whether no guard counts
    int32_t ends_at_event;          // whether an announced event is at the end of the step
    double smooth_from;             // time of the last event
    int32_t everywhere;             // whether rows are recorded at events, too, on both sides
    int32_t silent;                 // nothing is recorded or measured: the step may be taken back
    int32_t unrecorded;             // the metrics are all that is kept
    int32_t stop_place;             // of a variable that ends the run once it has been true for `stop_hold`; -1 for none
    double stop_hold;
    double true_since;
    int32_t exchange;               // whether values are exchanged after each step (jacobi)
    int32_t returning;              // whether FMUs may be set back to earlier times; they are told
    int32_t rereading;              // whether all is read again at events, since what follows the inputs is not declared
    int32_t on_grid;                // clocks tick at points of the grid alone
    int32_t functions;              // how many values at the end of the step wait on the bus, of inputs that functions give
    int32_t function_place;         // of the first one; those at the end come after all of them
    int32_t cut;                    // whether an early return may end the step for all
    int32_t jump;                   // the next one of the tables
    int64_t rows;                   // recorded
    int64_t room;                   // for rows
    double *next_time;              // of the next row, in the record
    double *next_row;
    int64_t events;
    int64_t warnings;
    int64_t warned;                 // by the last of them: the instance, or the transfer
    int32_t fault;
    int32_t fault_status;
    int32_t fault_where;            // the transfer, or -1 - the instance
    int32_t fault_element;          // or the function, where no transfer has failed
    double fault_time;
    int32_t refused;                // an evaluation of the parts: the fault that it is if no other state does; likewise below
    int32_t refused_status;
    int32_t refused_where;
    int32_t refused_element;
    """,
)

RUNS = record(
    "Runs",
    """
    int64_t most;                   // macro steps of one of them
    const int64_t *places;          // of start values on the bus
    size_t values;                  // their number
    const double *rows;             // start values of each run
    size_t count;
    const int64_t *numbers;         // of the runs
    int64_t *now;                   // where the number of the run at work is written, or null
    Metric *gathered;               // what the metrics gather in each run
    size_t finished;                // how many runs have
    int32_t answer;                 // what `run` has answered for the next one, or FINISHED
    """,
)


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


class ClockKind(IntEnum):
    """Kinds of clocks; the last one is an output."""

    PERIODIC, CHANGING, COUNTDOWN, TRIGGERED, TRIGGERING = range(5)


class Asked(IntEnum):
    """When a clock is asked for its interval: in initialization mode; in event mode, too."""

    NEVER, ONCE, ALWAYS = range(3)


class ValueType(IntEnum):
    """Types of values in memory."""

    F8, F4, I1, U1, I2, U2, I4, U4, I8, U8, BOOLEAN2, BOOLEAN3 = range(12)


class Code(IntEnum):
    """Operations of a program. 2: reals of FMI 1.0 and 2.0, steps of FMI 2.0; KEEP: what has been set, to the bus; AGAIN: what has
    been set before the event."""

    SET2, GET2, STEP2, SET, GET, STEP3, TABLES_BEFORE, TABLES_NOW, HOLD, SLOPES, GUARDED, KEEP, AGAIN, CLOCKED = range(14)
    SOLVE, STEP1 = range(14, 16)


class Fault(IntEnum):
    """What goes wrong. From BAD_INTERVAL on it is about a clock, whose number is the element.

    NOT_A_NUMBER: among the values of a call, whose number is the status. SOLVER: CVODE's answer is the status.
    OTHER_COUNT: a call writes more values than it was asked for, whose number is the status."""

    NO_FAULT, CALL_FAILED, NOT_FINITE, EARLY_RETURN, TERMINATED, ENDLESS_EVENTS, NOT_IN_RANGE, NO_ITEM = range(8)
    NOT_A_NUMBER, SOLVER, ENDLESS_STATE_EVENTS, OPEN_LOOP, OTHER_COUNT = range(8, 13)
    BAD_INTERVAL, NO_INTERVAL, OFF_GRID, ENDLESS_TICKS = range(13, 17)


class Answer(IntEnum):
    """How the loop comes back; FULL: there is no room in the record."""

    GOING_ON, FINISHED, FULL, FAULT = range(4)


class Called(IntEnum):
    """Functions of FMI that are no transfers, by the number that a fault tells; see faults.called_name."""

    DoStep, EnterEventMode, EnterStepMode, UpdateDiscreteStates, SetRealInputDerivatives = range(5)
    Reset, SetupExperiment, EnterInitializationMode, ExitInitializationMode = range(5, 9)
    SetClock, GetClock, GetIntervalDecimal, GetIntervalFraction, GetShiftDecimal, GetShiftFraction = range(9, 15)
    SetTime, SetContinuousStates, GetContinuousStates, GetNominals, GetDerivatives, GetEventIndicators = range(15, 21)
    CompletedIntegratorStep, GetDirectionalDerivative, GetInputs, SetInputs = range(21, 25)


PERIODIC, CHANGING, COUNTDOWN, TRIGGERED, TRIGGERING = ClockKind
ONCE, ALWAYS = Asked.ONCE, Asked.ALWAYS
F8, F4, I1, U1, I2, U2, I4, U4, I8, U8, BOOLEAN2, BOOLEAN3 = ValueType
SIZES: dict[int, int] = {F8: 8, F4: 4, I1: 1, U1: 1, I2: 2, U2: 2, I4: 4, U4: 4, I8: 8, U8: 8, BOOLEAN2: 4, BOOLEAN3: 1}
SET2, GET2, STEP2, SET, GET, STEP3, TABLES_BEFORE, TABLES_NOW, HOLD, SLOPES, GUARDED, KEEP, AGAIN, CLOCKED, SOLVE, STEP1 = Code
NO_FAULT, CALL_FAILED, NOT_FINITE, EARLY_RETURN, TERMINATED, ENDLESS_EVENTS, NOT_IN_RANGE, NO_ITEM = list(Fault)[:8]
NOT_A_NUMBER, SOLVER_FAULT, ENDLESS_STATE_EVENTS, OPEN_LOOP, OTHER_COUNT = list(Fault)[8:13]
BAD_INTERVAL, NO_INTERVAL, OFF_GRID, ENDLESS_TICKS = list(Fault)[13:]
GOING_ON, FINISHED, FULL, FAULT = Answer

JUMPS = -(1 << 30)
"""The cause that stands for jumps of tables; others are places of announced times on the bus, or -1 - instance."""


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
