/* Macro steps, one after the other. */

#include "events.h"
#include "execution.h"
#include "metrics.h"

/* Take into account that an event is due: it ends the step if it comes before the step's target. */
static inline void consider(Control *control, double due, double near) {
    if (!(control->t + near < due)) return;
    if (due < control->target - near) control->target = due;
    if (due < control->horizon) control->horizon = due;
}

/* Where the next step ends: at the next point of the grid, or at the earliest event before it. */
static void plan(const System *system, Control *control) {
    const int last = control->done + 1 >= control->steps;
    const double grid = last ? control->stop : control->start + (double)(control->done + 1) * control->step;
    control->target = grid;
    control->horizon = NO_EVENT;
    if (control->exact) {
        const double near = time_rounding(control->t, grid - control->t);
        for (size_t i = 0; i < system->event_places.count; i++)
            consider(control, system->bus.at[system->event_places.at[i]], near);
        for (size_t i = 0; i < system->instances.count; i++) consider(control, system->instances.at[i].next_event, near);
        const double *const jumps = system->jumps.at;
        const int count = (int)system->jumps.count;
        while (control->jump < count && jumps[control->jump] <= control->t + near) control->jump++;
        if (control->jump < count) consider(control, jumps[control->jump], near);
    }
    control->at_grid = control->target == grid;
    control->at_event = 0;
}

/* The next jump of the tables. */
static double next_jump(const System *system, const Control *control) {
    return control->jump < (int)system->jumps.count ? system->jumps.at[control->jump] : NO_EVENT;
}

/* Whether an announced event is at the target. */
static int is_event(const System *system, const Control *control, double near) {
    for (size_t i = 0; i < system->event_places.count; i++)
        if (fabs(system->bus.at[system->event_places.at[i]] - control->target) <= near) return 1;
    for (size_t i = 0; i < system->instances.count; i++)
        if (fabs(system->instances.at[i].next_event - control->target) <= near) return 1;
    return fabs(next_jump(system, control) - control->target) <= near;
}

/* Find out which guards' causes have an event at the target, before the step overwrites what was announced. */
static void find_due(const System *system, const Control *control, double near) {
    for (size_t i = 0; i < system->guards.count; i++) {
        Guard *const guard = &system->guards.at[i];
        guard->due = 0;
        for (int k = guard->first; k < guard->first + guard->count; k++) {
            const int cause = system->causes.at[k];
            const double when = cause == JUMPS  ? next_jump(system, control)
                                : cause >= 0 ? system->bus.at[cause]
                                             : system->instances.at[-1 - cause].next_event;
            if (fabs(when - control->target) <= near) guard->due = 1;
        }
    }
}

/* What the guards let through from now on; everything at a point of the grid, and after an event that nobody announced. */
static void set_guards(const System *system, Control *control, int off_grid) {
    control->all_open = !(off_grid && !control->at_event);
    for (size_t i = 0; i < system->guards.count; i++) system->guards.at[i].open = system->guards.at[i].due;
}

/* Record a row; on the grid alone unless events are wanted, too. `left`: with the values from the left. */
static void note(const System *system, Control *control, int left) {
    if (control->silent) return;
    if (system->metrics.count) measure(system, control->t);
    if (control->unrecorded || (!control->everywhere && (left || !control->at_grid))) return;
    *control->next_time++ = control->t;
    for (size_t i = 0; i < system->recorded.count; i++) control->next_row[i] = system->bus.at[system->recorded.at[i]];
    control->next_row += system->recorded.count;
    control->rows++;
}

static int is_at_end(const Control *control) { return control->done >= control->steps; }

/* Whether an event at the end of the step is left to somebody else. */
static int pauses(Control *control) {
    control->paused = control->pausing == 2 || (control->pausing && is_at_end(control));
    return control->paused;
}

/* Exchange values after a step that ends at no event; a change of an input that is set in event mode alone is one. */
static int exchange(const System *system, Control *control, double t) {
    if (control->exchange) {
        const Operations program = is_at_end(control) ? system->final_program : system->exchange_program;
        if (!execute(system, control, program, t, 0.0)) return 0;
    }
    if (!has_changed(system)) return 1;
    control->events++;
    note(system, control, 1);
    return pauses(control) || end_in_event(system, control, t);
}

/* The length of the step; all that are meant whole are equal to the bit. */
static double length_of_step(const Control *control, double t) {
    const int unbroken = control->at_grid && t == control->start + (double)control->done * control->step;
    const int whole = unbroken && (control->done + 1 < control->steps || control->ends_whole);
    return whole ? control->step : control->target - t;
}

/* Step to the planned target and record. */
static int take_step(const System *system, Control *control) {
    const double t = control->t, near = time_rounding(t, control->target - t);
    if (!control->exchange && has_changed(system) && !handle_event(system, control, t, 1)) return 0; /* a function's value has */
    const int event = control->exact && is_event(system, control, near), off_grid = event && !control->at_grid;
    control->ends_at_event = event;
    if (off_grid && system->guards.count) find_due(system, control, near);
    const Operations program = event ? system->jump_program : system->step_program;
    if (!execute(system, control, program, t, length_of_step(control, t))) return 0;
    if (system->guards.count) set_guards(system, control, off_grid);
    control->t = control->target; /* which an early return may have moved */
    if (control->at_grid) control->done++;
    if (event || control->at_event) {
        control->events++;
        note(system, control, 1);
        if (pauses(control)) return 1;
        if (!end_in_event(system, control, control->t)) {
            if (control->fault == FAULT_TERMINATED && !control->everywhere) note(system, control, 0); /* what was before the event */
            return 0;
        }
    } else if (!exchange(system, control, control->t)) {
        return 0;
    }
    note(system, control, 0);
    return 1;
}

/* Whether the variable that ends the run has been true long enough. */
static int is_to_stop(const System *system, Control *control) {
    if (control->stop_place < 0) return 0;
    if (system->bus.at[control->stop_place] == 0.0)
        control->true_since = NO_EVENT;
    else if (control->true_since == NO_EVENT)
        control->true_since = control->t;
    return control->t - control->true_since >= control->stop_hold;
}

int loop_run(const System *system, Control *control, int64_t most) {
    for (int64_t i = 0; i < most; i++) {
        if (control->paused || is_at_end(control)) return ANSWER_FINISHED;
        if (control->rows + 2 > control->room) return ANSWER_FULL;
        plan(system, control);
        if (!take_step(system, control)) return ANSWER_FAULT;
        if (is_to_stop(system, control)) return ANSWER_FINISHED;
    }
    return is_at_end(control) ? ANSWER_FINISHED : ANSWER_GOING_ON;
}

void loop_plan_step(const System *system, Control *control) { plan(system, control); }

int loop_take_planned_step(const System *system, Control *control) { return take_step(system, control); }

int loop_go_on(const System *system, Control *control) {
    const double t = control->t;
    const int after_event = control->smooth_from == t;
    if (after_event && !execute(system, control, system->resume_program, t, 0.0)) return 0;
    if (control->exchange && !execute(system, control, system->exchange_program, t, 0.0)) return 0;
    return !has_changed(system) || handle_event(system, control, t, 1);
}

int loop_look_through(const System *system, Control *control) {
    return execute(system, control, system->final_program, control->t, 0.0);
}

double loop_next_event(const System *system, Control *control) {
    plan(system, control);
    return control->horizon;
}

void loop_first_row(const System *system, Control *control) { note(system, control, 0); }
