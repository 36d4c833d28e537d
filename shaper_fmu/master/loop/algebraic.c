/* The Jacobian, by differences, is kept as long as it brings the values home within a few steps: of linear loops for the whole
   run. */

#include "algebraic.h"

#include "execution.h"
#include "faults.h"
#include "parts.h"

#define MOST_STEPS 40
#define PATIENCE 4 /* steps with the same Jacobian */
#define CLOSED 1e-13
#define NEARLY_CLOSED 1e-9

/* Where a fault is told: at the first of the parts, or instances. */
static int in_loops(const System *system) { return -1 - (system->parts.count ? system->parts.at[0].instance : 0); }

/* What comes back, less what went in; and how far from closed that is, over the tolerance 1 of a value of 1. */
static int miss(const System *system, Control *control, Operations program, double t, const double *values, double *missed,
                double *farthest) {
    const size_t count = system->cut_places.count;
    double *const bus = system->bus.at;
    for (size_t i = 0; i < count; i++) bus[system->cut_places.at[i]] = values[i];
    if (!execute(system, control, program, t, 0.0)) return 0;
    *farthest = 0.0;
    for (size_t i = 0; i < count; i++) {
        missed[i] = bus[system->cut_places.at[i]] - values[i];
        const double relative = fabs(missed[i]) / (1.0 + fabs(values[i]));
        if (!(relative <= *farthest)) *farthest = relative;
    }
    return 1;
}

/* Replace a matrix of n rows by its inverse (Gauss and Jordan, with pivots in columns); 0 if it has none. */
static int invert(double *a, double *swapped, size_t n) {
    for (size_t k = 0; k < n; k++) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(a[i * n + k]) > fabs(a[pivot * n + k])) pivot = i;
        swapped[k] = (double)pivot;
        if (!(fabs(a[pivot * n + k]) > 0.0)) return 0;
        for (size_t j = 0; j < n; j++) {
            const double kept = a[k * n + j];
            a[k * n + j] = a[pivot * n + j];
            a[pivot * n + j] = kept;
        }
        const double scale = 1.0 / a[k * n + k];
        a[k * n + k] = 1.0;
        for (size_t j = 0; j < n; j++) a[k * n + j] *= scale;
        for (size_t i = 0; i < n; i++) {
            if (i == k) continue;
            const double factor = a[i * n + k];
            a[i * n + k] = 0.0;
            for (size_t j = 0; j < n; j++) a[i * n + j] -= factor * a[k * n + j];
        }
    }
    for (size_t k = n; k-- > 0;) {
        const size_t other = (size_t)swapped[k];
        for (size_t i = 0; i < n; i++) {
            const double kept = a[i * n + k];
            a[i * n + k] = a[i * n + other];
            a[i * n + other] = kept;
        }
    }
    return 1;
}

/* The inverse of d missed / d values. */
static int linearize(const System *system, Control *control, Operations program, double t, double *values, const double *missed,
                     double *inverse, double *work) {
    const size_t count = system->cut_places.count;
    double farthest;
    for (size_t k = 0; k < count; k++) {
        const double value = values[k], moved = value + 1e-7 * (1.0 + fabs(value));
        values[k] = moved;
        const int going = miss(system, control, program, t, values, work, &farthest);
        values[k] = value;
        if (!going) return 0;
        for (size_t i = 0; i < count; i++) inverse[i * count + k] = (work[i] - missed[i]) / (moved - value);
    }
    return invert(inverse, work, count) || fail(control, FAULT_OPEN_LOOP, 0, in_loops(system), 0, t);
}

/* Newton's method. Steps that lead away from the solution are halved, by a Jacobian that is new. */
static int close_loops(const System *system, Control *control, Operations program, double t) {
    const size_t count = system->cut_places.count;
    double *const values = system->loop_memory.at, *const missed = values + count, *const work = missed + count;
    double *const step = work + count, *const inverse = step + count, *const is_known = inverse + count * count;
    double farthest = 0.0, before = NO_EVENT;
    int is_new = 0;
    for (size_t i = 0; i < count; i++) values[i] = system->bus.at[system->cut_places.at[i]];
    for (int k = 0, same = 0; k < MOST_STEPS; k++, same++) {
        if (!miss(system, control, program, t, values, missed, &farthest)) return 0;
        if (farthest <= CLOSED || (farthest <= NEARLY_CLOSED && farthest >= before)) return 1;
        if (is_new && !(farthest < before)) {
            for (size_t i = 0; i < count; i++) values[i] += step[i] *= 0.5;
            continue;
        }
        is_new = *is_known == 0.0 || same >= PATIENCE || farthest > 0.5 * before;
        if (is_new) {
            *is_known = 0.0;
            if (!linearize(system, control, program, t, values, missed, inverse, work)) return 0;
            *is_known = 1.0;
            same = 0;
        }
        before = farthest;
        for (size_t i = 0; i < count; i++) {
            step[i] = 0.0;
            for (size_t j = 0; j < count; j++) step[i] += inverse[i * count + j] * missed[j];
            values[i] -= step[i];
        }
    }
    return fail(control, FAULT_OPEN_LOOP, 0, in_loops(system), 0, t);
}

int exchange_in_loops(const System *system, Control *control, Operations program, double t) {
    int done = execute(system, control, system->coupled_read_program, t, 0.0);
    if (done) done = system->cut_places.count ? close_loops(system, control, program, t) : execute(system, control, program, t, 0.0);
    if (done) return EVALUATED;
    const int fault = control->fault;
    const int discarded = fault == FAULT_CALL_FAILED && control->fault_status == 2;
    if (fault != FAULT_NOT_FINITE && fault != FAULT_OPEN_LOOP && !discarded) return BROKEN;
    control->fault = FAULT_NO_FAULT;
    return refuse(control, fault, control->fault_status, control->fault_where, control->fault_element);
}

int loop_close_loops(const System *system, Control *control, double t) {
    return close_loops(system, control, system->initial_program, t);
}
