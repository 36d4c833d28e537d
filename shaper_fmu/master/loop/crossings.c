/* CVODE looks for changes of signs after a tenth of its first step; what is 0 then counts as inactive until it is not. */

#include "crossings.h"

#include "faults.h"
#include "parts.h"

#include <math.h>
#include <string.h>

#define UNKNOWN 2 /* the sign of an indicator that is 0 near the beginning, too: it is watched until it is not */

/* Whether an indicator is 0. */
static int is_any_zero(const Solver *solver) {
    for (int i = 0; i < solver->indicators; i++)
        if (solver->indicator_values[i] == 0.0) return 1;
    return 0;
}

/* The indicators a little later than t, by the derivatives there; the states then to `between_values`, those at t to
   `begin_values`. */
static int look_ahead(const System *system, Control *control, Solver *solver, double t, double later) {
    double *const x = solver->between_values;
    memcpy(solver->begin_values, solver->state_values, size_of_state(solver));
    int refused = loop_derivatives(t, solver->state, solver->between, solver);
    if (refused) return refused;
    for (int i = 0; i < solver->states; i++) x[i] = solver->begin_values[i] + later * x[i];
    refused = place_parts(system, control, t + later, x);
    return refused ? refused : get_indicators(system, control, t + later, solver->indicator_values);
}

int watch(const System *system, Control *control, Solver *solver, double t, double near, int *leaving) {
    const double *const z = solver->indicator_values;
    solver->watching = WATCHING_NONE;
    *leaving = 0;
    if (loop_indicators(t, solver->state, solver->indicator_values, solver)) return broken(control, solver, 0, t);
    for (int i = 0; i < solver->indicators; i++) solver->signs[i] = z[i] == 0.0;
    if (!is_any_zero(solver)) return 1;
    solver->watching = WATCHING_FIRST;
    near = fmin(near, control->stop - t); /* there are FMUs that refuse later times */
    if (look_ahead(system, control, solver, t, near)) return broken(control, solver, 0, t);
    for (int i = 0; i < solver->indicators; i++) {
        if (!solver->signs[i]) continue;
        solver->signs[i] = z[i] > 0.0 ? 1 : z[i] < 0.0 ? -1 : UNKNOWN;
        if (z[i] != 0.0) *leaving = 1;
    }
    return !place_parts(system, control, t, solver->begin_values) || broken(control, solver, 0, t);
}

int has_been_missed(Solver *solver, int *missed) {
    const double *const z = solver->indicator_values;
    if (loop_indicators(solver->reached, solver->state, solver->indicator_values, solver)) return 0;
    for (int i = 0; i < solver->indicators; i++)
        if (solver->signs[i] == UNKNOWN ? z[i] != 0.0 : z[i] * solver->signs[i] < 0.0) *missed = 1;
    return 1;
}

void go_on_watching(Solver *solver) {
    if (!solver->watching) return;
    solver->watching = WATCHING_NONE;
    for (int i = 0; i < solver->indicators; i++) {
        if (solver->signs[i] != UNKNOWN || solver->indicator_values[i] != 0.0) solver->signs[i] = 0;
        if (solver->signs[i]) solver->watching = WATCHING_ON;
    }
}

int pass_zeros(const System *system, Control *control, Solver *solver, double near) {
    const double t = solver->reached;
    if (loop_indicators(t, solver->state, solver->indicator_values, solver)) return broken(control, solver, 0, t);
    if (!is_any_zero(solver)) return 1;
    for (int i = 0; i < solver->indicators; i++) solver->signs[i] = solver->indicator_values[i] == 0.0;
    for (double later = 0.01 * near; later <= near && t + later <= control->stop; later *= 100.0) {
        const int refused = look_ahead(system, control, solver, t, later);
        if (refused) return refused == REFUSED || broken(control, solver, 0, t);
        for (int i = 0; i < solver->indicators; i++) {
            if (!solver->signs[i] || solver->indicator_values[i] == 0.0) continue;
            memcpy(solver->state_values, solver->between_values, size_of_state(solver));
            solver->reached = t + later;
            return 1;
        }
    }
    return 1;
}

int have_inputs_crossed(const System *system, Control *control, double t, int *crossed) {
    Solver *const solver = solver_of(system);
    if (!solver || !solver->indicators || !solver->has_left) return 1;
    double *const now = solver->indicator_values;
    control->refused = FAULT_NO_FAULT;
    if (get_indicators(system, control, t, now)) return broken(control, solver, 0, t);
    for (int i = 0; i < solver->indicators; i++)
        if ((now[i] > 0.0) != (solver->left_indicators[i] > 0.0)) *crossed = 1;
    return 1;
}

int note_indicators(const System *system, Control *control, double t) {
    Solver *const solver = solver_of(system);
    if (!solver || !solver->indicators) return 1;
    control->refused = FAULT_NO_FAULT;
    if (get_indicators(system, control, t, solver->left_indicators)) return broken(control, solver, 0, t);
    return solver->has_left = 1;
}
