/* Events are rare, and the loop's code has to fit into the processor's cache: nothing here is to be inlined there. */

#include "events.h"

#include "arithmetic.h"
#include "clocks.h"
#include "execution.h"
#include "faults.h"
#include "fmi.h"

#define MOST_UPDATES 100

/* Update an instance's discrete states; 1 if it needs another update, 0 if not, or FAILED. */
static int update(const System *system, Control *control, int number, double t) {
    Instance *const instance = &system->instances.at[number];
    Answers answers = {{0}, {0}};
    Fmi3Boolean *const again = &answers.flag[0], *const terminate = &answers.flag[1], *const event_defined = &answers.flag[4];
    double event_time = 0.0; /* flags 2 and 3: whether nominal values, and values of continuous states, have changed */
    const int status = ((Fmi3UpdateDiscreteStates *)instance->update)(
        instance->handle, again, terminate, &answers.flag[2], &answers.flag[3], event_defined, &event_time);
    keep_arithmetic();
    if (!judge(control, status, -1 - number, CALLED_UpdateDiscreteStates, t)) return FAILED;
    if (*terminate) {
        fail(control, FAULT_TERMINATED, 0, -1 - number, CALLED_UpdateDiscreteStates, t);
        return FAILED;
    }
    instance->next_event = *event_defined ? event_time : NO_EVENT;
    return *again ? 1 : 0;
}

static int all_in_mode(const System *system, Control *control, int entering, double t) {
    for (size_t i = 0; i < system->instances.count; i++) {
        const Instance *const instance = &system->instances.at[i];
        if (!instance->event_mode) continue;
        const Function function = entering ? instance->enter_event_mode : instance->enter_step_mode;
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

/* One super-dense instant: exchange values, and update discrete states; 1 if another one is needed, 0 if not, or FAILED.
   `settled` tells whether all but the ticks that are due has settled, `asking` which instance has asked last. */
static int settle(const System *system, Control *control, double t, int *settled, int *asking) {
    int again = 0;
    if (!execute(system, control, system->event_program, t, 0.0)) return FAILED;
    if (system->clocks.count && !tick(system, control, t, *settled)) return FAILED;
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

int handle_event(const System *system, Control *control, double t, int entering) {
    control->smooth_from = t;
    control->resuming = entering ? 1 : 0;
    if (entering && !all_in_mode(system, control, 1, t)) return 0;
    const int rereading = is_rereading(system, control);
    int asking = 0, settled = 0;
    for (int i = 0; i < MOST_UPDATES; i++) {
        const int again = settle(system, control, t, &settled, &asking);
        if (again == FAILED) return 0;
        if (!rereading) return 1; /* all that follows the inputs has been read */
        if (!execute(system, control, system->event_read_program, t, 0.0)) return 0;
        if (!execute(system, control, system->event_program, t, 0.0)) return 0;
        if (!again) return all_in_mode(system, control, 0, t) && resume(system, control, t);
    }
    return fail(control, FAULT_ENDLESS_EVENTS, 0, -1 - asking, CALLED_UpdateDiscreteStates, t);
}

int end_in_event(const System *system, Control *control, double t) {
    /* inputs that functions give have kept their value from the beginning of the step so far */
    for (int i = control->function_place; i < control->function_place + control->functions; i++)
        system->bus.at[i] = system->bus.at[i + control->functions];
    return handle_event(system, control, t, 1);
}
