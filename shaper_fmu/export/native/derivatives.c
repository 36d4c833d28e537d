/* Directional derivatives: how results follow inputs, states and parameters at one instant, by differences of the kernel.

   The kernel runs over a copy of the record, by a step of length zero; during initialization its start runs before. Formulas of
   order four over four points close to the value give about twelve digits. Where the results are linear, which differences
   over three much wider intervals tell, the widest of those is taken: it is exact but for rounding. */

#include "component.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double NARROW = 1.0 / 1024; /* of the value's size */
static const double INSTANT = 1.0 / 1048576; /* s, for the time */

typedef struct {
    double place, weight; /* in intervals, and of the change up to there in the derivative times the interval */
} Point;

static const Point CENTRAL[] = {{-2, 1.0 / 12}, {-1, -8.0 / 12}, {1, 8.0 / 12}, {2, -1.0 / 12}};
static const Point FORWARD[] = {{1, 48.0 / 12}, {2, -36.0 / 12}, {3, 16.0 / 12}, {4, -3.0 / 12}};

/* The record's copy with one value changed, and what follows from it; no variable stands for the time. */
static Status evaluate(Instance *instance, const Variable *known, int element, double value) {
    double t = known ? instance->time : value;
    memcpy(instance->trial, instance->record, (size_t)component.record_size);
    if (known) ((double *)(instance->trial + known->offset))[element] = value;
    return run_trial(instance, t);
}

static double now_of(const Instance *instance, const Variable *known, int element) {
    return known ? ((const double *)(instance->record + known->offset))[element] : instance->time;
}

/* A power of two near the value's size: intervals of it round nothing. */
static double size_of(const Instance *instance, const Variable *known, int element, double value) {
    double size = fmax(fabs(value), known->causality == PARAMETER ? 0.0 : nominal_value(instance, known, element));
    return size > 0.0 && isfinite(size) ? ldexp(1.0, ilogb(size)) : 1.0;
}

/* Whether the value can be changed by this much. States are free; the time is so until the next event, and from the last on. */
static int is_free(const Instance *instance, const Variable *known, double value) {
    if (!known) return value >= instance->record_time && value <= next_solver_event(instance);
    return (known->causality != INPUT && known->causality != PARAMETER) || in_domain(known, value);
}

static double unknown_at(const Instance *instance, int offset) { return *(const double *)(instance->trial + offset); }

/* Differences of order four over points near the value, on one side of it where the other is not free. */
static Status narrow_differences(Instance *instance, const Variable *known, int element, double interval, const int *unknown, int n,
                                 double *difference) {
    double value = now_of(instance, known, element);
    int up = is_free(instance, known, value + 2.0 * interval), down = is_free(instance, known, value - 2.0 * interval);
    const Point *points = up && down ? CENTRAL : FORWARD;
    double along = (up && down) || is_free(instance, known, value + 4.0 * interval) ? interval : -interval;
    double here[UNKNOWNS_AT_ONCE];
    if (evaluate(instance, known, element, value)) return ERROR;
    for (int i = 0; i < n; i++) {
        here[i] = unknown_at(instance, unknown[i]);
        difference[i] = 0.0;
    }
    for (int k = 0; k < 4; k++) {
        if (evaluate(instance, known, element, value + points[k].place * along)) return ERROR;
        for (int i = 0; i < n; i++) difference[i] += points[k].weight * (unknown_at(instance, unknown[i]) - here[i]) / along;
    }
    return OK;
}

/* The difference over an interval to both sides, and the largest value met. */
static Status wide_differences(Instance *instance, const Variable *known, int element, double interval, const int *unknown, int n,
                               double *difference, double *largest) {
    double value = now_of(instance, known, element);
    for (int side = -1; side <= 1; side += 2) {
        double there = value + side * interval;
        if (!is_free(instance, known, there) || evaluate(instance, known, element, there)) return ERROR;
        for (int i = 0; i < n; i++) {
            double found = unknown_at(instance, unknown[i]), before = side < 0 ? 0.0 : difference[i];
            difference[i] = before + side * 0.5 * found / interval;
            largest[i] = fmax(largest[i], fabs(found));
        }
    }
    return OK;
}

/* Replace differences of what is linear by those that are exact but for rounding; what cannot be tried out stays. */
static void sharpen(Instance *instance, const Variable *known, int element, double size, const int *unknown, int n,
                    double *difference) {
    double wide[3][UNKNOWNS_AT_ONCE], largest[UNKNOWNS_AT_ONCE] = {0};
    for (int k = 0; k < 3; k++)
        if (wide_differences(instance, known, element, ldexp(size, -k), unknown, n, wide[k], largest)) return;
    for (int i = 0; i < n; i++) {
        double rounding = 16.0 * DBL_EPSILON * largest[i] / size;
        int linear = fabs(wide[1][i] - wide[0][i]) <= rounding && fabs(wide[2][i] - wide[0][i]) <= 2.0 * rounding;
        if (linear && fabs(difference[i] - wide[0][i]) <= rounding / NARROW) difference[i] = wide[0][i];
    }
}

/* Whether derivatives with respect to this variable can be asked for now; if not, says so. */
static int is_known_now(Instance *instance, const Variable *known) {
    int is_state = 0;
    for (int k = 0; k < component.states; k++) is_state |= &component.variable[component.state[k].variable] == known;
    if (!known || known->causality == INPUT || (is_state && instance->phase != INITIALIZING)) return 1;
    if (known->causality == PARAMETER && (instance->phase == INITIALIZING || (known->tunable && instance->phase != CONTINUOUS))) return 1;
    refuse(instance, ERROR, "%s: derivatives with respect to %s cannot be asked for now: it cannot be set", component.name, known->name);
    return 0;
}

/* Whether the variable is one that derivatives can be asked of; if not, says so. */
int is_unknown(Instance *instance, const Variable *v) {
    if (v->causality == OUTPUT || v->causality == LOCAL || v->causality == CALCULATED) return 1;
    refuse(instance, ERROR, "%s: %s is given, not computed: it has no derivatives", component.name, v->name);
    return 0;
}

/* Add the derivatives of unknowns (offsets of at most UNKNOWNS_AT_ONCE doubles) with respect to one value, times its seed. The
   instance stays as it is; a known that is null is the time. */
Status add_derivatives(Instance *instance, const Variable *known, int element, double seed, const int *unknown, int n,
                       double *sensitivity) {
    double difference[UNKNOWNS_AT_ONCE];
    if (!is_known_now(instance, known)) return ERROR;
    if (!isfinite(seed)) return refuse(instance, ERROR, "%s: a seed is %g; it must be a finite number", component.name, seed);
    if (seed == 0.0) return OK;
    if (instance->phase == INITIALIZING ? check_domains(instance) : refresh(instance)) return ERROR;
    double value = now_of(instance, known, element);
    double size = known ? size_of(instance, known, element, value) : 1.0;
    double interval = known ? size * NARROW : INSTANT * fmax(1.0, ldexp(1.0, ilogb(fabs(value) + 1.0)));
    if (narrow_differences(instance, known, element, interval, unknown, n, difference)) return ERROR;
    if (known) {
        void (*log)(Instance *, Status, const char *, const char *) = instance->log;
        instance->log = 0; /* what is tried out far away may fail */
        sharpen(instance, known, element, size, unknown, n, difference);
        instance->log = log;
    }
    for (int i = 0; i < n; i++) sensitivity[i] += seed * difference[i];
    return OK;
}
