"""The records of the solver of model exchange (see loop/solver.c and loop/parts.h)."""

from __future__ import annotations

from shaper_fmu.records import record

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
