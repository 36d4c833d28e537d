/* The beginning of runs, and whole ones: reset, start values, initialization, and all steps, one run after the other. */

#include "arithmetic.h"
#include "events.h"
#include "execution.h"
#include "faults.h"
#include "fmi.h"
#include "parts.h"
#include "solver.h"

int loop_begin_early(const System *system, Control *control, double t) {
    return execute(system, control, system->early_program, t, 0.0);
}

int loop_initialize(const System *system, Control *control, double t) {
    if (!open_after_event(system, control, t, 1)) return 0;
    if (system->clocks.count && !execute(system, control, system->clock_program, t, 0.0)) return 0;
    return execute(system, control, system->read_program, t, 0.0) && execute(system, control, system->initial_program, t, 0.0);
}

int loop_exchange(const System *system, Control *control, double t) {
    return execute(system, control, system->initial_program, t, 0.0);
}

int loop_begin(const System *system, Control *control, double t, int in_event_mode) {
    if (!execute(system, control, system->read_program, t, 0.0)) return 0;
    if (in_event_mode) return handle_event(system, control, t, 0);
    return !control->exchange || execute(system, control, system->exchange_program, t, 0.0);
}

static int call_simple(const Instance *instance, Function function, Control *control, int number, int called) {
    const int status = ((SimpleFunction *)function)(instance->handle);
    keep_arithmetic();
    return judge(control, status, -1 - number, called, control->start);
}

static int set_up(const Instance *instance, Control *control, int number) {
    Fmi2SetupExperiment *const function = (Fmi2SetupExperiment *)instance->setup;
    const int status = function(instance->handle, instance->tolerance > 0.0, instance->tolerance, control->start, 1, control->stop);
    keep_arithmetic();
    return judge(control, status, -1 - number, CALLED_SetupExperiment, control->start);
}

static int initialize_model(Instance *instance, Control *control, int number) {
    int status = ((FmiSetTime *)instance->setup)(instance->handle, control->start);
    keep_arithmetic();
    if (!judge(control, status, -1 - number, CALLED_SetupExperiment, control->start)) return 0;
    Fmi1EventInfo info = {0, 0, 0, 0, 0, 0.0};
    Fmi1Initialize *const function = (Fmi1Initialize *)instance->enter_initialization;
    status = function(instance->handle, instance->tolerance > 0.0, instance->tolerance, &info);
    keep_arithmetic();
    if (!judge(control, status, -1 - number, CALLED_EnterInitializationMode, control->start)) return 0;
    if (info.event_defined) instance->next_event = info.event_time;
    instance->settled = info.converged && instance->informed;
    if (!info.terminate) return 1;
    return fail(control, FAULT_TERMINATED, 0, -1 - number, CALLED_EnterInitializationMode, control->start);
}

static int initialize_slave(const Instance *instance, Control *control, int number) {
    Fmi1InitializeSlave *const function = (Fmi1InitializeSlave *)instance->enter_initialization;
    const int status = function(instance->handle, control->start, 1, control->stop);
    keep_arithmetic();
    return judge(control, status, -1 - number, CALLED_EnterInitializationMode, control->start);
}

static int initialize1(Instance *instance, Control *control, int number) {
    instance->initialized = 1;
    return instance->model_exchange ? initialize_model(instance, control, number) : initialize_slave(instance, control, number);
}

static int enter_initialization(const Instance *instance, Control *control, int number) {
    if (instance->version == 2)
        return call_simple(instance, instance->enter_initialization, control, number, CALLED_EnterInitializationMode);
    Fmi3EnterInitializationMode *const function = (Fmi3EnterInitializationMode *)instance->enter_initialization;
    const int status = function(instance->handle, instance->tolerance > 0.0, instance->tolerance, control->start, 1, control->stop);
    keep_arithmetic();
    return judge(control, status, -1 - number, CALLED_EnterInitializationMode, control->start);
}

/* FMI 1.0 resets no instance that has not been initialized. */
static int reset(Instance *instance, Control *control, int number) {
    if (instance->version == 1 && !instance->initialized) return 1;
    instance->initialized = 0;
    return call_simple(instance, instance->reset, control, number, CALLED_Reset);
}

/* FMI 1.0 has no initialization mode. */
static int exit_initialization(const Instance *instance, Control *control, int number) {
    return instance->version == 1 ||
           call_simple(instance, instance->exit_initialization, control, number, CALLED_ExitInitializationMode);
}

/* Bring what the loop changes back to the state before a run. */
static void forget(const System *system) {
    for (size_t i = 0; i < system->tables.count; i++) system->tables.at[i].cursor = system->tables.at[i].first;
    for (size_t i = 0; i < system->instances.count; i++) system->instances.at[i].next_event = NO_EVENT;
    for (size_t i = 0; i < system->metrics.count; i++) system->metrics.at[i].time = NAN;
    reset_solver(system);
    for (size_t i = 0; i < system->slopes.count; i++)
        system->slopes.at[i].previous_time = system->slopes.at[i].held_time = NAN;
}

int loop_start_again(const System *system, Control *control, int in_event_mode) {
    Instance *const instances = system->instances.at;
    const int count = (int)system->instances.count;
    for (int i = 0; i < count; i++)
        if (!reset(&instances[i], control, i)) return 0;
    forget(system);
    for (int i = 0; i < count; i++)
        if (instances[i].version == 2 && !set_up(&instances[i], control, i)) return 0;
    if (!execute(system, control, system->start_program, control->start, 0.0)) return 0;
    for (int i = 0; i < count; i++)
        if (instances[i].version != 1 && !enter_initialization(&instances[i], control, i)) return 0;
    if (!loop_begin_early(system, control, control->start)) return 0;
    for (int i = 0; i < count; i++)
        if (instances[i].version == 1 && !initialize1(&instances[i], control, i)) return 0;
    if (!loop_initialize(system, control, control->start)) return 0;
    if (system->clocks.count && !loop_start_clocks(system, control)) return 0;
    for (int i = 0; i < count; i++)
        if (!exit_initialization(&instances[i], control, i)) return 0;
    return loop_begin(system, control, control->start, in_event_mode);
}

/* A run from its start on; answers as loop_run does. */
static int one_run(const System *system, Control *control, int in_event_mode, int64_t most) {
    if (!loop_start_again(system, control, in_event_mode)) return ANSWER_FAULT;
    loop_first_row(system, control);
    return loop_run(system, control, most);
}

void loop_whole_runs(const System *system, Control *controls, int in_event_mode, Runs *runs) {
    runs->answer = ANSWER_FINISHED;
    for (runs->finished = 0; runs->finished < runs->count; runs->finished++) {
        const size_t i = runs->finished;
        if (runs->now) *runs->now = runs->numbers[i];
        controls[0] = controls[1];
        for (size_t k = 0; k < runs->values; k++) system->bus.at[runs->places[k]] = runs->rows[i * runs->values + k];
        runs->answer = one_run(system, &controls[0], in_event_mode, runs->most);
        if (runs->answer != ANSWER_FINISHED) return;
        for (size_t k = 0; k < system->metrics.count; k++) runs->gathered[i * system->metrics.count + k] = system->metrics.at[k];
    }
}
