/* CVODE's steps, and the events between them. */

#include "solver.h"

#include "crossings.h"
#include "events.h"
#include "execution.h"
#include "faults.h"
#include "parts.h"

#include <string.h>

#define MOST_EVENTS 100 /* one after the other within the rounding of the step */
#define MOST_SHRINKING 5 /* intervals between events, one after the other, the last of them below a millionth of the step */
#define MOST_SOLVER_STEPS 1000000 /* in one step of the master */
#define MOST_STEPS_OF_ADAMS 1000 /* likewise; then the system counts as stiff */
#define MOST_STANDING 100 /* steps one after the other that are as short as times can be told apart */

enum { ONE_STEP = 2, REACHED_ROOT = 2 }; /* CV_ONE_STEP, CV_ROOT_RETURN */

typedef int Step(void *memory, double limit, void *state, double *reached, int task);
typedef int Restart(void *memory, double t, void *state);
typedef int SetTolerances(void *memory, double relative, void *absolute);
typedef int Interpolate(void *memory, double t, int derivative, void *state);
typedef int SetTime(void *memory, double t);
typedef double *Data(void *vector);
typedef double *Column(void *matrix, int64_t number);

static const System *system_of(const Solver *solver) { return (const System *)solver->system; }

static Control *control_of(const Solver *solver) { return (Control *)solver->control; }

int loop_derivatives(double t, void *state, void *rates, void *data) {
    Solver *const solver = data;
    const System *const system = system_of(solver);
    double *const found = ((Data *)solver->data)(rates);
    if (!solver->states) found[0] = 0.0; /* there is one that stands for none */
    const int placed = place_parts(system, control_of(solver), t, ((Data *)solver->data)(state));
    return placed ? placed : get_derivatives(system, control_of(solver), t, found);
}

int loop_indicators(double t, void *state, double *indicators, void *data) {
    Solver *const solver = data;
    const System *const system = system_of(solver);
    const int placed = place_parts(system, control_of(solver), t, ((Data *)solver->data)(state));
    return placed ? placed : get_indicators(system, control_of(solver), t, indicators);
}

/* The Jacobian by differences. Those that CVODE takes are far smaller at times than what is left open where loops are closed: it
   would take that for slopes, and for solutions what are none. Where states are refused the other side is tried. */
static int differ(Solver *solver, double t, void *state, void *rates, void *moved_rates) {
    double *const x = ((Data *)solver->data)(state);
    const double *const here = ((Data *)solver->data)(rates), *const there = ((Data *)solver->data)(moved_rates);
    for (int i = 0; i < solver->states; i++) {
        const double kept = x[i], nominal = solver->absolute_values[i] / solver->relative;
        double step = 1e-7 * fmax(fabs(kept), nominal);
        int found = REFUSED;
        for (int side = 0; side < 2 && found == REFUSED; side++, step = -step) {
            x[i] = kept + step;
            found = loop_derivatives(t, state, moved_rates, solver);
            for (int k = 0; k < solver->states; k++) solver->columns[i][k] = (there[k] - here[k]) / (x[i] - kept);
        }
        x[i] = kept;
        if (found) return found;
    }
    return EVALUATED;
}

int loop_jacobian(double t, void *state, void *rates, void *matrix, void *data, void *one, void *two, void *three) {
    Solver *const solver = data;
    const System *const system = system_of(solver);
    (void)two; (void)three;
    for (int i = 0; i < solver->states; i++) {
        solver->columns[i] = ((Column *)solver->column)(matrix, i);
        memset(solver->columns[i], 0, (size_t)solver->states * sizeof(double));
    }
    if (system->cut_places.count) return differ(solver, t, state, rates, one);
    const int placed = place_parts(system, control_of(solver), t, ((Data *)solver->data)(state));
    return placed ? placed : get_jacobian(system, control_of(solver), t, solver->columns);
}

void restart_solver(const System *system) {
    Solver *const solver = solver_of(system);
    if (solver) solver->restart = 1;
}

static void exchange_memories(Solver *solver) {
    void *const memory = solver->memory;
    solver->memory = solver->stiff_memory;
    solver->stiff_memory = memory;
    solver->is_stiff = !solver->is_stiff;
}

void reset_solver(const System *system) {
    Solver *const solver = solver_of(system);
    if (!solver) return;
    solver->restart = 1;
    solver->has_left = 0;
    solver->shrinking = solver->events_at_once = 0;
    solver->last_event = solver->last_interval = (double)NAN;
    if (solver->is_stiff) exchange_memories(solver);
}

int broken(Control *control, const Solver *solver, int flag, double t) {
    if (control->fault) return 0;
    if (control->refused)
        return fail(control, control->refused, control->refused_status, control->refused_where, control->refused_element, t);
    return fail(control, FAULT_SOLVER, flag, -1 - system_of(solver)->parts.at[0].instance, CALLED_DoStep, t);
}

/* Have CVODE begin at t from its state, with a first step of this length; it chooses one for 0. */
static int begin_with(Control *control, Solver *solver, double t, double first) {
    int flag = ((SetTime *)solver->set_first)(solver->memory, first);
    if (flag >= 0) flag = ((Restart *)solver->begin)(solver->memory, t, solver->state);
    solver->reached = t;
    return flag >= 0 ? 1 : broken(control, solver, flag, t);
}

/* Begin anew from the parts' own states, as they are. */
static int begin_here(const System *system, Control *control, Solver *solver, double t) {
    if (get_states(system, control, t, solver->state_values, solver->absolute_values)) return broken(control, solver, 0, t);
    const int count = solver->states > 0 ? solver->states : 1;
    for (int i = 0; i < count; i++) solver->absolute_values[i] = solver->relative * (solver->states ? solver->absolute_values[i] : 1.0);
    int flag = ((SetTolerances *)solver->set_tolerances)(solver->memory, solver->relative, solver->absolute);
    if (flag >= 0 && solver->indicators) flag = ((SetTime *)solver->set_longest)(solver->memory, control->step);
    if (flag < 0) return broken(control, solver, flag, t);
    solver->restart = solver->pending = solver->at_root = 0;
    return begin_with(control, solver, t, 0.0);
}

/* Begin anew. Event indicators that leave 0 at once, as those that were 0 at an event, have another event then. */
static int begin(const System *system, Control *control, Solver *solver, double t, double near) {
    const double then = fmin(t + near, control->stop);
    int leaving = 0;
    if (!begin_here(system, control, solver, t)) return 0;
    if (!solver->indicators) return 1;
    if (!watch(system, control, solver, t, near, &leaving)) return 0;
    if (!leaving) return 1;
    if (place_parts(system, control, then, solver->between_values)) return broken(control, solver, 0, t);
    if (!handle_event_of_parts(system, control, then) || !begin_here(system, control, solver, then)) return 0;
    return watch(system, control, solver, then, near, &leaving);
}

/* One step of CVODE's, whose end is not completed yet. */
static int take_step_of_solver(Control *control, Solver *solver, double limit) {
    const double from = solver->reached;
    solver->pending = 1;
    if (!solver->states && !solver->indicators) {
        solver->reached = limit;
        return 1;
    }
    int flag = ((SetTime *)solver->set_stop)(solver->memory, limit);
    if (flag >= 0) flag = ((Step *)solver->step)(solver->memory, limit, solver->state, &solver->reached, ONE_STEP);
    solver->at_root = flag == REACHED_ROOT;
    return flag >= 0 ? 1 : broken(control, solver, flag, from);
}

/* The next step; while event indicators that were 0 are watched it is taken again, shorter, until it misses nothing. What comes and
   goes, or leaves 0, within the rounding of times is an event at once. */
static int go_on(Control *control, Solver *solver, double limit, double near) {
    const double from = solver->reached;
    int first = solver->watching == WATCHING_FIRST;
    solver->leaving = 0;
    if (solver->watching) memcpy(solver->begin_values, solver->state_values, size_of_state(solver));
    if (!take_step_of_solver(control, solver, limit)) return 0;
    while (solver->watching) {
        int missed = first && solver->at_root; /* which may be the wrong one: within its first step CVODE interpolates by a line */
        if (!missed && !has_been_missed(solver, &missed)) return broken(control, solver, 0, solver->reached);
        if (!missed) break;
        if (solver->reached <= from + near) {
            solver->at_root = solver->leaving = 1;
            break;
        }
        const double shorter = fmax(0.25 * (solver->reached - from), 0.5 * near);
        memcpy(solver->state_values, solver->begin_values, size_of_state(solver));
        if (!begin_with(control, solver, from, shorter)) return 0;
        if (!take_step_of_solver(control, solver, from + shorter)) return 0;
        first = 1;
    }
    go_on_watching(solver);
    return 1;
}

static int hears_of_steps(const System *system) {
    for (size_t i = 0; i < system->parts.count; i++)
        if (system->parts.at[i].completed) return 1;
    return 0;
}

/* Complete a step at t, where the parts have got their states, and evaluate all first: there are FMUs that compute what is read
   from them only when derivatives are asked for, or a step is completed. Derivatives that are refused here are the next step's
   matter. *event: whether there is one. `rates` is overwritten. */
static int complete_at(const System *system, Control *control, double t, double *rates, int *event) {
    const int refused = control->refused;
    if (!hears_of_steps(system)) return 1;
    if (get_derivatives(system, control, t, rates) == BROKEN) return 0;
    control->refused = refused;
    return !complete_step(system, control, t, event);
}

/* Bring the parts to the end of the solver's step; *event: whether there is one. */
static int complete(const System *system, Control *control, Solver *solver, double near, int *event) {
    *event = solver->at_root;
    if (solver->at_root && solver->indicators && !pass_zeros(system, control, solver, near)) return 0;
    solver->pending = solver->at_root = 0;
    if (place_parts(system, control, solver->reached, solver->state_values) ||
        !complete_at(system, control, solver->reached, solver->between_values, event))
        return broken(control, solver, 0, solver->reached);
    return 1;
}

/* Whether events follow each other without time passing. */
static int goes_on(Control *control, Solver *solver, double t, double near) {
    const double interval = fabs(t - solver->last_event);
    solver->events_at_once = interval <= near ? solver->events_at_once + 1 : 0;
    solver->shrinking = interval < solver->last_interval ? solver->shrinking + 1 : 0;
    solver->last_interval = interval;
    solver->last_event = t;
    if (solver->events_at_once < MOST_EVENTS && (solver->shrinking < MOST_SHRINKING || interval > 1e3 * near)) return 1;
    return fail(control, FAULT_ENDLESS_STATE_EVENTS, 0, -1 - system_of(solver)->parts.at[0].instance, 0, t);
}

/* The time event of a part that comes first, of those after `since`, when they have been asked. */
static double next_event(const System *system, double since) {
    double earliest = NO_EVENT;
    for (size_t i = 0; i < system->parts.count; i++) {
        const double due = system->instances.at[system->parts.at[i].instance].next_event;
        if (due > since && due < earliest) earliest = due;
    }
    return earliest;
}

/* How far the solver may go: to the target, or beyond it where nothing is known to happen there and values are interpolated. */
static double limit_of(const Control *control, const Solver *solver, double due, double target, int may_end) {
    if (due <= target) return due > solver->reached ? due : target;
    if (!may_end || !solver->states || solver->held_back || !control->exact || control->returning || control->at_grid == 0) return target;
    return fmax(target, fmin(fmin(due, control->horizon), control->stop));
}

/* End the step at an event, for all. */
static void end_step(Control *control, double target, double reached, double near) {
    control->at_event = 1;
    if (reached >= target - near) return;
    control->target = reached;
    control->at_grid = 0;
    control->at_event = SHORTENED;
}

/* Bring the parts to a time event that is due within the rounding of the time that the solver has reached. */
static int reach(const System *system, Control *control, Solver *solver, double due) {
    if (!(due > solver->reached)) return 1;
    solver->reached = due;
    return !place_parts(system, control, due, solver->state_values) || broken(control, solver, 0, due);
}

/* Solve until the target, or until an event for which the step is ended (*ended). An event within the rounding of its beginning ends
   no step. */
static int advance(const System *system, Control *control, Solver *solver, double t, double near, int may_end, int *ended) {
    const double target = control->target;
    double since = t;
    int standing = 0;
    for (int i = 0; i < MOST_SOLVER_STEPS; i++) {
        int event = 0;
        const int is_there = solver->reached >= target - near;
        if (solver->pending && solver->reached <= target + near && !complete(system, control, solver, near, &event)) return 0;
        const double due = next_event(system, since);
        const int is_due = due <= solver->reached + near && (!may_end || due <= t + near); /* later ones are at the target */
        if (event || is_due) {
            const int within = !may_end || is_due || (solver->leaving && solver->reached <= t + near);
            if (is_due && !reach(system, control, solver, due)) return 0;
            if (!goes_on(control, solver, solver->reached, near)) return 0;
            if (!within) {
                end_step(control, target, solver->reached, near);
                *ended = 1;
                return 1;
            }
            since = solver->reached;
            if (!handle_event_of_parts(system, control, solver->reached)) return 0;
            if (!begin(system, control, solver, solver->reached, near)) return 0;
        }
        if (is_there) return 1;
        if (is_due && next_event(system, since) <= solver->reached + near) continue; /* too near for a step */
        if (i >= MOST_STEPS_OF_ADAMS && solver->stiff_memory && !solver->is_stiff) {
            exchange_memories(solver);
            if (!begin(system, control, solver, solver->reached, near)) return 0;
        }
        const double from = solver->reached;
        if (!go_on(control, solver, limit_of(control, solver, next_event(system, since), target, may_end), near)) return 0;
        standing = solver->reached - from > 0x1p-48 * fabs(from) ? 0 : standing + 1;
        if (standing > MOST_STANDING) return broken(control, solver, -3, from);
    }
    return broken(control, solver, -1, solver->reached);
}

/* The step ends before the point that the solver has reached. For the parts it is completed here. */
static int end_between(const System *system, Control *control, Solver *solver, double t, double near, int may_end) {
    int event = 0;
    const int flag = ((Interpolate *)solver->interpolate)(solver->memory, t, 0, solver->between);
    if (flag < 0) return broken(control, solver, flag, t);
    if (place_parts(system, control, t, solver->between_values) || !complete_at(system, control, t, solver->between_values, &event))
        return broken(control, solver, 0, t);
    if (event) {
        if (!goes_on(control, solver, t, near)) return 0;
        restart_solver(system);
        control->at_event = may_end;
        if (may_end) return 1;
        if (!handle_event_of_parts(system, control, t)) return 0;
    }
    return open_after_event(system, control, t, 0) && note_indicators(system, control, t);
}

static int has_linear_inputs(const System *system) {
    for (size_t i = 0; i < system->slopes_of.count; i++)
        if (!system->slopes_of.at[i].function) return 1;
    return 0;
}

int solve(const System *system, Control *control, double t, double h, int may_end) {
    Solver *const solver = solver_of(system);
    const double target = control->target, near = time_rounding(t, h);
    int changed = 0, ended = 0, crossed = 0;
    solver->system = system;
    solver->control = control;
    control->refused = FAULT_NO_FAULT; /* in this step: if it fails, that is the likely reason */
    if (!inputs_have_changed(system, control, t, &changed)) return 0;
    solver->held_back = (changed && !solver->restart) || has_linear_inputs(system);
    if (changed && !have_inputs_crossed(system, control, t, &crossed)) return 0;
    if (crossed && !handle_event_of_parts(system, control, t)) return 0;
    if ((changed || solver->restart) && !begin(system, control, solver, t, near)) return 0;
    if (!advance(system, control, solver, t, near, may_end, &ended)) return 0;
    solver->has_left = 0;
    if (ended) return 1; /* the parts are there */
    if (solver->reached > target + near) return end_between(system, control, solver, target, near, may_end);
    if (place_parts(system, control, target, solver->state_values)) return broken(control, solver, 0, target);
    return note_indicators(system, control, target);
}
