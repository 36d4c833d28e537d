/* CVODE's steps, and the events between them. */

#include "solver.h"

#include "events.h"
#include "execution.h"
#include "faults.h"
#include "parts.h"

#include <string.h>

#define MOST_EVENTS 100 /* one after the other within the rounding of the step */
#define MOST_SOLVER_STEPS 1000000 /* in one step of the master */

enum { ONE_STEP = 2, REACHED_ROOT = 2 }; /* CV_ONE_STEP, CV_ROOT_RETURN */

typedef int Step(void *memory, double limit, void *state, double *reached, int task);
typedef int Restart(void *memory, double t, void *state);
typedef int SetTolerances(void *memory, double relative, void *absolute);
typedef int Interpolate(void *memory, double t, int derivative, void *state);
typedef int SetTime(void *memory, double t);
typedef double *Data(void *vector);
typedef double *Column(void *matrix, int64_t number);

static Solver *solver_of(const System *system) { return system->solvers.count ? &system->solvers.at[0] : NULL; }

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

int loop_jacobian(double t, void *state, void *rates, void *matrix, void *data, void *one, void *two, void *three) {
    Solver *const solver = data;
    const System *const system = system_of(solver);
    (void)rates; (void)one; (void)two; (void)three;
    for (int i = 0; i < solver->states; i++) {
        solver->columns[i] = ((Column *)solver->column)(matrix, i);
        memset(solver->columns[i], 0, (size_t)solver->states * sizeof(double));
    }
    const int placed = place_parts(system, control_of(solver), t, ((Data *)solver->data)(state));
    return placed ? placed : get_jacobian(system, control_of(solver), t, solver->columns);
}

void restart_solver(const System *system) {
    Solver *const solver = solver_of(system);
    if (solver) solver->restart = 1;
}

/* What could not be done; where an evaluation was refused, that is the reason. */
static int broken(Control *control, const Solver *solver, int flag, double t) {
    if (control->fault) return 0;
    if (control->refused)
        return fail(control, control->refused, control->refused_status, control->refused_where, control->refused_element, t);
    return fail(control, FAULT_SOLVER, flag, -1 - system_of(solver)->parts.at[0].instance, CALLED_DoStep, t);
}

/* Begin anew from the parts' own states. */
static int begin(const System *system, Control *control, Solver *solver, double t) {
    control->refused = FAULT_NO_FAULT;
    if (get_states(system, control, t, solver->state_values, solver->absolute_values)) return broken(control, solver, 0, t);
    const int count = solver->states > 0 ? solver->states : 1;
    for (int i = 0; i < count; i++) solver->absolute_values[i] = solver->relative * (solver->states ? solver->absolute_values[i] : 1.0);
    int flag = ((SetTolerances *)solver->set_tolerances)(solver->memory, solver->relative, solver->absolute);
    if (flag >= 0 && solver->indicators) flag = ((SetTime *)solver->set_longest)(solver->memory, control->step);
    if (flag >= 0) flag = ((Restart *)solver->begin)(solver->memory, t, solver->state);
    solver->reached = t;
    solver->restart = solver->pending = solver->at_root = 0;
    return flag >= 0 ? 1 : broken(control, solver, flag, t);
}

/* One step of CVODE's, whose end is not completed yet. */
static int go_on(Control *control, Solver *solver, double limit) {
    const double from = solver->reached;
    control->refused = FAULT_NO_FAULT;
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

/* Bring the parts to the end of the solver's step; *event: whether there is one. */
static int complete(const System *system, Control *control, Solver *solver, int *event) {
    *event = solver->at_root;
    control->refused = FAULT_NO_FAULT;
    solver->pending = solver->at_root = 0;
    if (place_parts(system, control, solver->reached, solver->state_values)) return broken(control, solver, 0, solver->reached);
    if (complete_step(system, control, solver->reached, event)) return broken(control, solver, 0, solver->reached);
    return 1;
}

/* Whether events follow each other without time passing. */
static int goes_on(Control *control, Solver *solver, double t, double near) {
    solver->events_at_once = fabs(t - solver->last_event) <= near ? solver->events_at_once + 1 : 0;
    solver->last_event = t;
    if (solver->events_at_once < MOST_EVENTS) return 1;
    return fail(control, FAULT_ENDLESS_STATE_EVENTS, 0, -1 - system_of(solver)->parts.at[0].instance, 0, t);
}

/* The time event of a part that comes first. */
static double next_event(const System *system) {
    double earliest = NO_EVENT;
    for (size_t i = 0; i < system->parts.count; i++) {
        const double due = system->instances.at[system->parts.at[i].instance].next_event;
        if (due < earliest) earliest = due;
    }
    return earliest;
}

/* How far the solver may go: to the target, or beyond it where nothing is known to happen there and values are interpolated. */
static double limit_of(const System *system, const Control *control, const Solver *solver, double target, int may_end) {
    const double due = next_event(system);
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

/* Solve until the target, or until an event for which the step is ended (*ended). */
static int advance(const System *system, Control *control, Solver *solver, double target, double near, int may_end, int *ended) {
    for (int i = 0; i < MOST_SOLVER_STEPS; i++) {
        int event = 0;
        const int is_there = solver->reached >= target - near;
        if (solver->pending && solver->reached <= target + near && !complete(system, control, solver, &event)) return 0;
        if (!may_end && next_event(system) <= solver->reached + near) event = 1; /* else the step ends there, or goes on from there */
        if (event) {
            if (!goes_on(control, solver, solver->reached, near)) return 0;
            if (may_end) {
                end_step(control, target, solver->reached, near);
                *ended = 1;
                return 1;
            }
            if (!handle_event_of_parts(system, control, solver->reached)) return 0;
            if (!begin(system, control, solver, solver->reached)) return 0;
        }
        if (is_there) return 1;
        if (!go_on(control, solver, limit_of(system, control, solver, target, may_end))) return 0;
    }
    return fail(control, FAULT_SOLVER, -1, -1 - system->parts.at[0].instance, 0, solver->reached);
}

/* The inputs jump at t, before the end of the solver's last step: what comes after t does not count. */
static int cut_short(const System *system, Control *control, Solver *solver, double t) {
    int event = 0;
    if (complete_step(system, control, t, &event)) return broken(control, solver, 0, t);
    return !event || handle_event_of_parts(system, control, t);
}

int solve(const System *system, Control *control, double t, double h, int may_end) {
    Solver *const solver = solver_of(system);
    const double target = t + h, near = time_rounding(t, h);
    int changed = 0, ended = 0;
    solver->system = system;
    solver->control = control;
    if (!inputs_have_changed(system, control, t, &changed)) return 0;
    solver->held_back = changed && !solver->restart;
    if (solver->held_back && solver->pending && !cut_short(system, control, solver, t)) return 0;
    if ((changed || solver->restart) && !begin(system, control, solver, t)) return 0;
    if (!advance(system, control, solver, target, near, may_end, &ended)) return 0;
    const double end = ended ? solver->reached : target;
    if (solver->reached > end + near) {
        const int flag = ((Interpolate *)solver->interpolate)(solver->memory, end, 0, solver->between);
        if (flag < 0) return broken(control, solver, flag, end);
    } else {
        memcpy(solver->between_values, solver->state_values, sizeof(double) * (size_t)(solver->states ? solver->states : 1));
    }
    if (ended) return 1; /* the parts are there */
    return place_parts(system, control, end, solver->between_values) == EVALUATED || broken(control, solver, 0, end);
}
