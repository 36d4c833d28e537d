"""The records that the loop and Python share: each declared once, as the body of a struct in C (see records.py)."""

from __future__ import annotations

from shaper_fmu.records import record

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
    int32_t pausing;                // whether somebody else handles the events: 1 at the end of a run, 2 at any time
    int32_t paused;                 // an event waits at t for somebody else
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
