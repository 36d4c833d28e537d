/* Model exchange: the importer's solver owns the time and the continuous states. */

#include "component.h"

#include <math.h>

static double *real_at(const Instance *instance, const Variable *v, int element) {
    return (double *)field(instance, v, element);
}

static const Variable *state_at(size_t i) { return &component.variable[component.state[i].variable]; }

static Status check_count(Instance *instance, const void *values, size_t n, const char *what) {
    if (n == (size_t)component.states && (values || !n)) return OK;
    return refuse(instance, ERROR, "%s: there are %d continuous states, but %s of %d were asked for", component.name, component.states,
                  what, values ? (int)n : 0);
}

/* Values set from now on belong to the record, and what was tried is void. */
static void invalidate(Instance *instance) {
    instance->stale = 1;
    instance->tried = 0;
}

Status set_time(Instance *instance, double t) {
    if (!isfinite(t)) return refuse(instance, ERROR, "%s: the time %g is not a finite number", component.name, t);
    if (t < instance->record_time)
        return refuse(instance, ERROR, "%s: the time %.15g s is before the last event at %.15g s", component.name, t,
                      instance->record_time);
    instance->time = t;
    invalidate(instance);
    return OK;
}

Status get_states(Instance *instance, double *x, size_t n) {
    if (check_count(instance, x, n, "states") || refresh(instance)) return ERROR;
    for (size_t i = 0; i < n; i++) x[i] = *real_at(instance, state_at(i), component.state[i].element);
    return OK;
}

Status set_states(Instance *instance, const double *x, size_t n) {
    if (check_count(instance, x, n, "states")) return ERROR;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return refuse(instance, ERROR, "%s: the state %s is %g; it must be a finite number", component.name, state_at(i)->name, x[i]);
    invalidate(instance);
    for (size_t i = 0; i < n; i++) *real_at(instance, state_at(i), component.state[i].element) = x[i];
    return OK;
}

Status get_derivatives(Instance *instance, double *dx, size_t n) {
    if (check_count(instance, dx, n, "derivatives") || refresh(instance)) return ERROR;
    for (size_t i = 0; i < n; i++)
        dx[i] = *real_at(instance, &component.variable[state_at(i)->derivative], component.state[i].element);
    return OK;
}

/* The usual size of a variable, which another one may hold. */
double nominal_value(const Instance *instance, const Variable *v, int element) {
    double nominal = v->nominal_of < 0 ? v->nominal : *real_at(instance, &component.variable[v->nominal_of], element);
    return isfinite(nominal) && nominal > 0.0 ? nominal : 1.0;
}

Status get_nominals(Instance *instance, double *x, size_t n) {
    if (check_count(instance, x, n, "nominal values") || refresh(instance)) return ERROR;
    for (size_t i = 0; i < n; i++) x[i] = nominal_value(instance, state_at(i), component.state[i].element);
    return OK;
}

Status enter_continuous_time(Instance *instance) {
    if (refresh(instance)) return ERROR;
    instance->phase = CONTINUOUS;
    invalidate(instance);
    return OK;
}

/* Where a solver has to stop next: at an event, or where an output has a kink. */
double next_solver_event(const Instance *instance) {
    double event = next_event(instance);
    if (component.next_kink_time < 0 || !instance->model_exchange) return event;
    return fmin(event, *(const double *)(instance->record + component.next_kink_time));
}

Status no_indicators(Instance *instance, size_t n) {
    return n ? refuse(instance, ERROR, "%s: there are no event indicators, but %d were asked for", component.name, (int)n) : OK;
}
