/* Events are rare, and the loop's code has to fit into the processor's cache: nothing here is to be inlined there. */

#include "events.h"

#include "algebraic.h"
#include "arithmetic.h"
#include "clocks.h"
#include "crossings.h"
#include "execution.h"
#include "faults.h"
#include "fmi.h"
#include "parts.h"
#include "solver.h"

#define MOST_UPDATES 100
#define MOST_FOLLOWING 10 /* updates: where values close a loop, rounding may take an indicator back and forth, and some time events are
                            never but in the past */

/* In a chain each instance may follow the one before it. */
static int most(int number, const System *system) { return number + (int)system->instances.count; }

/* What an instance answers to the update of its discrete states. */
typedef struct {
    int again;
    int terminate;
    int event_defined;
    double event_time;
} Update;

static int update1(const Instance *instance, Update *found) {
    Fmi1EventInfo info = {0, 0, 0, 0, 0, 0.0};
    const int status = ((Fmi1EventUpdate *)instance->update)(instance->handle, 0, &info);
    *found = (Update){!info.converged, info.terminate, info.event_defined, info.event_time};
    return status;
}

static int update2(const Instance *instance, Update *found) {
    Fmi2EventInfo info = {0, 0, 0, 0, 0, 0.0};
    const int status = ((Fmi2NewDiscreteStates *)instance->update)(instance->handle, &info);
    *found = (Update){info.again, info.terminate, info.event_defined, info.event_time};
    return status;
}

/* Flags 2 and 3 of the answers: whether nominal values, and values of continuous states, have changed; both are asked for anew. */
static int update3(const Instance *instance, Update *found) {
    Answers answers = {{0}, {0}};
    Fmi3Boolean *const flag = answers.flag;
    double event_time = 0.0;
    const int status = ((Fmi3UpdateDiscreteStates *)instance->update)(instance->handle, &flag[0], &flag[1], &flag[2], &flag[3],
                                                                      &flag[4], &event_time);
    *found = (Update){flag[0], flag[1], flag[4], event_time};
    return status;
}

/* Update an instance's discrete states; 1 if it needs another update, 0 if not, or FAILED. */
static int update(const System *system, Control *control, int number, double t) {
    Instance *const instance = &system->instances.at[number];
    if (instance->settled) { /* by FMI 1.0's initialization; another update would be another event */
        instance->settled = 0;
        return 0;
    }
    if (instance->version == 1 && !complete_before_event(system, control, number, t)) return FAILED;
    Update found;
    const int status = instance->version == 3   ? update3(instance, &found)
                       : instance->version == 2 ? update2(instance, &found)
                                                : update1(instance, &found);
    keep_arithmetic();
    if (!judge(control, status, -1 - number, CALLED_UpdateDiscreteStates, t)) return FAILED;
    if (found.terminate) {
        fail(control, FAULT_TERMINATED, 0, -1 - number, CALLED_UpdateDiscreteStates, t);
        return FAILED;
    }
    instance->next_event = found.event_defined ? found.event_time : NO_EVENT;
    return found.again ? 1 : 0;
}

/* Have all instances with event mode enter or leave it; of the parts alone with `parts`. FMI 1.0 has no modes. */
static int all_in_mode(const System *system, Control *control, int entering, int parts, double t) {
    for (size_t i = 0; i < system->instances.count; i++) {
        const Instance *const instance = &system->instances.at[i];
        if (!instance->event_mode || (parts && !instance->model_exchange)) continue;
        const Function function = entering ? instance->enter_event_mode : instance->enter_step_mode;
        if (!function) continue;
        const int status = ((SimpleFunction *)function)(instance->handle);
        keep_arithmetic();
        if (!judge(control, status, -1 - (int)i, entering ? CALLED_EnterEventMode : CALLED_EnterStepMode, t)) return 0;
    }
    return 1;
}

/* Note what inputs have got in event mode, and set those that a step begins with. */
static int resume(const System *system, Control *control, double t) {
    for (size_t i = 0; i < system->watched.count; i++) {
        WatchedInput *const input = &system->watched.at[i];
        if (control->all_open) input->value = system->bus.at[input->place]; /* else a guard may have kept some from being set */
    }
    return control->done >= control->steps || execute(system, control, system->resume_program, t, 0.0);
}

/* Whether all has to be read again, since not all that follows the inputs has been. */
static int is_rereading(const System *system, const Control *control) {
    for (size_t i = 0; i < system->instances.count; i++)
        if (system->instances.at[i].event_mode) return 1;
    return control->rereading != 0;
}

/* Keep what the sources of inputs give that are set in event mode alone. */
static void note_sources(const System *system) {
    for (size_t i = 0; i < system->watched.count; i++)
        system->watched.at[i].before = system->bus.at[system->watched.at[i].place];
}

/* Whether an update has changed an input that is set in event mode alone, of a part with `parts`: that instance has to be updated
   in turn. */
static int has_fed(const System *system, int parts, int *asking) {
    for (size_t i = 0; i < system->watched.count; i++) {
        const WatchedInput *const input = &system->watched.at[i];
        if (system->bus.at[input->place] == input->before) continue;
        if (parts && !system->instances.at[input->instance].model_exchange) continue;
        *asking = input->instance;
        return 1;
    }
    return 0;
}

/* Whether a part's next time event is now, or was before. */
static int is_due(const System *system, double t) {
    for (size_t i = 0; i < system->parts.count; i++)
        if (system->instances.at[system->parts.at[i].instance].next_event <= t) return 1;
    return 0;
}

/* One super-dense instant: exchange values, and update discrete states; 1 if another one is needed, 0 if not, or FAILED.
   `settled` tells whether all but the ticks that are due has settled, `asking` which instance has asked last. */
static int settle(const System *system, Control *control, double t, int *settled, int *asking) {
    int again = 0;
    if (!execute(system, control, system->event_program, t, 0.0)) return FAILED;
    if (system->clocks.count && !tick(system, control, t, *settled)) return FAILED;
    note_sources(system);
    for (size_t i = 0; i < system->instances.count; i++) {
        if (!system->instances.at[i].event_mode) continue;
        const int answer = update(system, control, (int)i, t);
        if (answer == FAILED) return FAILED;
        if (answer) {
            again = 1;
            *asking = (int)i;
        }
    }
    if (system->clocks.count) {
        const int due = end_ticks(system, control, t);
        if (due == FAILED) return FAILED;
        *settled = due && !again;
        again = again || due;
    }
    return again;
}

/* Values between parts that are solved as one; what refuses an evaluation is a fault here. */
static int exchange_between_parts(const System *system, Control *control, double t) {
    if (!system->coupled_event_program.count) return 1;
    const int found = exchange_in_loops(system, control, system->coupled_event_program, t);
    if (found == EVALUATED || control->fault) return found == EVALUATED;
    return fail(control, control->refused, control->refused_status, control->refused_where, control->refused_element, t);
}

/* Bring what an update has changed to the inputs; *again: whether these ask for another one. */
static int spread(const System *system, Control *control, double t, int *again, int *asking, int *following) {
    int crossed = 0;
    if (!execute(system, control, system->event_read_program, t, 0.0) || !note_indicators(system, control, t)) return 0;
    if (!execute(system, control, system->event_program, t, 0.0)) return 0;
    if (system->cut_places.count) {
        if (!exchange_between_parts(system, control, t)) return 0;
        if (!execute(system, control, system->event_read_program, t, 0.0)) return 0;
    }
    if (!have_inputs_crossed(system, control, t, &crossed)) return 0;
    *again = has_fed(system, 0, asking) || ((crossed || is_due(system, t)) && ++*following < most(MOST_FOLLOWING, system));
    return 1;
}

int handle_event(const System *system, Control *control, double t, int entering) {
    control->smooth_from = t;
    control->resuming = entering ? 1 : 0;
    if (entering && !all_in_mode(system, control, 1, 0, t)) return 0;
    restart_solver(system);
    const int rereading = is_rereading(system, control);
    int asking = 0, settled = 0, following = 0;
    for (int i = 0; i < most(MOST_UPDATES, system); i++) {
        const int again = settle(system, control, t, &settled, &asking);
        if (again == FAILED) return 0;
        if (!rereading) return 1; /* all that follows the inputs has been read */
        int fed = 0;
        if (!spread(system, control, t, &fed, &asking, &following)) return 0;
        if (fed) settled = 0;
        if (again || fed) continue;
        return all_in_mode(system, control, 0, 0, t) && open_after_event(system, control, t, 0) &&
               note_indicators(system, control, t) && resume(system, control, t);
    }
    return fail(control, FAULT_ENDLESS_EVENTS, 0, -1 - asking, CALLED_UpdateDiscreteStates, t);
}

int handle_event_of_parts(const System *system, Control *control, double t) {
    int asking = 0, again = 1, following = 0;
    if (!all_in_mode(system, control, 1, 1, t)) return 0;
    for (int i = 0; i < most(MOST_UPDATES, system); i++) {
        int crossed = 0;
        note_sources(system);
        if (!note_indicators(system, control, t) || !exchange_between_parts(system, control, t)) return 0;
        if (!have_inputs_crossed(system, control, t, &crossed)) return 0;
        const int fed = has_fed(system, 1, &asking) || ((crossed || is_due(system, t)) && ++following < most(MOST_FOLLOWING, system));
        if (!again && !fed) return all_in_mode(system, control, 0, 1, t);
        again = 0;
        for (size_t k = 0; k < system->parts.count; k++) {
            const int number = system->parts.at[k].instance, answer = update(system, control, number, t);
            if (answer == FAILED) return 0;
            if (answer) again = 1, asking = number;
        }
    }
    return fail(control, FAULT_ENDLESS_EVENTS, 0, -1 - asking, CALLED_UpdateDiscreteStates, t);
}

int end_in_event(const System *system, Control *control, double t) {
    /* inputs that functions give have kept their value from the beginning of the step so far */
    for (int i = control->function_place; i < control->function_place + control->functions; i++)
        system->bus.at[i] = system->bus.at[i + control->functions];
    return handle_event(system, control, t, 1);
}

int loop_enter_event_mode(const System *system, Control *control) { return all_in_mode(system, control, 1, 0, control->t); }

int loop_handle_event(const System *system, Control *control, int entered) {
    control->paused = 0;
    return entered ? handle_event(system, control, control->t, 0) : end_in_event(system, control, control->t);
}
