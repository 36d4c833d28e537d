/* Values of a component's variables: start values, domains, results. */

#include "component.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static double number(const unsigned char *record, const Variable *v, int element) {
    if (v->kind == REAL) return ((const double *)(record + v->offset))[element];
    return ((const int *)(record + v->offset))[element];
}

void *field(const Instance *instance, const Variable *v, int element) {
    const unsigned char *record = instance->tried ? instance->scratch : instance->record;
    return (void *)(record + v->offset + element * (v->kind == REAL ? 8 : 4));
}

/* States and results always start anew; inputs and parameters keep what was set, unless asked. */
void start_values(unsigned char *record, int with_inputs_and_parameters) {
    for (int k = 0; k < component.variables; k++) {
        const Variable *v = &component.variable[k];
        int kept = v->causality == INPUT || v->causality == PARAMETER || v->causality == SLOPE;
        if (kept && !with_inputs_and_parameters) continue;
        if (!v->starts && v->start == 0.0 && !signbit(v->start)) {
            memset(record + v->offset, 0, (size_t)length(v) * (v->kind == REAL ? 8 : 4));
            continue;
        }
        for (int i = 0; i < length(v); i++) {
            double value = v->starts ? v->starts[i] : v->start;
            if (v->kind == REAL)
                ((double *)(record + v->offset))[i] = value;
            else
                ((int *)(record + v->offset))[i] = (int)value;
        }
    }
}

static int is_item(const Variable *v, double value) {
    for (int i = 0; i < v->items; i++)
        if (v->item[i].value == value) return 1;
    return 0;
}

static const char *const CAUSALITIES[] = {"input", "output", "parameter", "calculatedParameter", "local", "state", "state"};

static const char *at_time(char *text, size_t size, const double *t) {
    *text = 0;
    if (t) snprintf(text, size, " at t = %.15g s", *t);
    return text;
}

static Status out_of_bound(Instance *instance, const Variable *v, const char *label, double value, const char *relation,
                           double bound, const double *t) {
    const char *space = *v->unit ? " " : "";
    char when[64];
    return refuse(instance, ERROR, "%s: %s %s = %.15g%s%s must be %s %g%s%s%s", component.name, CAUSALITIES[v->causality], label,
                  value, space, v->unit, relation, bound, space, v->unit, at_time(when, sizeof when, t));
}

/* Whether a number is within its variable's bounds. */
int in_domain(const Variable *v, double value) {
    int low = !v->lower || (v->lower == EXCLUSIVE ? value > v->min : value >= v->min);
    int high = !v->upper || (v->upper == EXCLUSIVE ? value < v->max : value <= v->max);
    return isfinite(value) && low && high;
}

/* Whether a value is in its variable's domain; if not, says so. */
int check_element(Instance *instance, const Variable *v, int element, double value, const double *t) {
    char label[128], when[64];
    if (v->kind == ENUMERATION ? is_item(v, value) : in_domain(v, value)) return 1;
    put_label(label, sizeof label, v, element);
    if (v->kind == ENUMERATION) {
        char options[512] = "";
        for (int i = 0, used = 0; i < v->items && used < (int)sizeof options; i++)
            used += snprintf(options + used, sizeof options - used, "%s%s (%d)", i ? ", " : "", v->item[i].text, v->item[i].value);
        refuse(instance, ERROR, "%s: %s %s = %.0f is not one of %s%s", component.name, CAUSALITIES[v->causality], label, value,
               options, at_time(when, sizeof when, t));
        return 0;
    }
    if (!isfinite(value)) {
        refuse(instance, ERROR, "%s: %s %s is %s; it must be a finite number%s", component.name, CAUSALITIES[v->causality], label,
               isnan(value) ? "nan" : value > 0 ? "inf" : "-inf", at_time(when, sizeof when, t));
        return 0;
    }
    if (v->lower == EXCLUSIVE && !(value > v->min)) return out_of_bound(instance, v, label, value, "greater than", v->min, t), 0;
    if (v->lower && !(value >= v->min)) return out_of_bound(instance, v, label, value, "at least", v->min, t), 0;
    if (v->upper == EXCLUSIVE) return out_of_bound(instance, v, label, value, "less than", v->max, t), 0;
    return out_of_bound(instance, v, label, value, "at most", v->max, t), 0;
}

/* Whether all of these are finite; 0 * x is 0 for such x alone, and a sum needs no branches. */
static int are_finite(const unsigned char *record, const Scalar *scalar, int scalars) {
    double sum = 0.0;
    for (int k = 0; k < scalars; k++) sum += 0.0 * *(const double *)(record + scalar[k].offset);
    return sum == 0.0;
}

static Status check_variable(Instance *instance, const Variable *v, const double *t) {
    for (int i = 0; i < length(v); i++)
        if (!check_element(instance, v, i, number(instance->record, v, i), t)) return ERROR;
    return OK;
}

/* Check parameters and inputs, in the order of their declaration. */
Status check_domains(Instance *instance) {
    for (int k = 0; k < component.variables; k++) {
        const Variable *v = &component.variable[k];
        if ((v->causality == PARAMETER || v->causality == INPUT) && check_variable(instance, v, 0)) return ERROR;
    }
    return OK;
}

/* Check the parameters alone. */
Status check_parameters(Instance *instance) {
    for (int k = 0; k < component.variables; k++) {
        const Variable *v = &component.variable[k];
        if (v->causality == PARAMETER && check_variable(instance, v, 0)) return ERROR;
    }
    return OK;
}

static OUT_OF_LINE Status check_each_input(Instance *instance, double t) {
    for (int k = 0; k < component.inputs; k++) {
        const Variable *v = &component.variable[component.input[k].variable];
        int element = component.input[k].element;
        if (!check_element(instance, v, element, number(instance->record, v, element), &t)) return ERROR;
    }
    return OK;
}

/* Check the inputs that act from t on. */
Status check_inputs(Instance *instance, double t) {
    int right = component.free_inputs == component.inputs && are_finite(instance->record, component.input, component.inputs);
    return right ? OK : check_each_input(instance, t);
}

static COLD void refuse_results(Instance *instance, const unsigned char *record, double t, int results) {
    for (int k = 0; k < results; k++) {
        const Scalar *s = &component.result[k];
        double value = *(const double *)(record + s->offset);
        if (isfinite(value)) continue;
        char label[128];
        put_label(label, sizeof label, &component.variable[s->variable], s->element);
        refuse(instance, ERROR, "%s: %s became %s at t = %.15g s", component.name, label,
               isnan(value) ? "nan" : value > 0 ? "inf" : "-inf", t);
        return;
    }
}

/* Results must be finite: those of a step, or with the calculated parameters after them in the list. */
Status check_results(Instance *instance, const unsigned char *record, double t, int with_calculated) {
    int results = component.results + (with_calculated ? component.calculated : 0);
    if (are_finite(record, component.result, results)) return OK;
    refuse_results(instance, record, t, results);
    return ERROR;
}

static OUT_OF_LINE Status check_settable(Instance *instance, const Variable *v, int element, double value) {
    char label[128];
    if (v->causality == INPUT) return check_element(instance, v, element, value, 0) ? OK : ERROR;
    if (v->causality == PARAMETER) {
        if (v->kind != REAL && fabs(value) > INT_MAX) return check_element(instance, v, element, value, 0) ? OK : ERROR;
        if (instance->phase & (INSTANTIATED | INITIALIZING)) return OK;
        if (v->tunable && instance->phase != CONTINUOUS) return check_element(instance, v, element, value, 0) ? OK : ERROR;
        put_label(label, sizeof label, v, element);
        return refuse(instance, ERROR, "%s: %s is %s", component.name, label,
                      v->tunable ? "a parameter: in model exchange it can be set in event mode only"
                                 : "fixed: it can be set only before and during initialization");
    }
    put_label(label, sizeof label, v, element);
    return refuse(instance, ERROR, "%s: %s is %s %s and cannot be set", component.name, label, v->causality == OUTPUT ? "an" : "a",
                  CAUSALITIES[v->causality]);
}

/* Whether an element may be set to a value now; most inputs are checked when they are used. */
Status settable(Instance *instance, const Variable *v, int element, double value) {
    if (v->causality == INPUT && (v->kind == BOOLEAN || v->kind == REAL)) return OK;
    return check_settable(instance, v, element, value);
}

/* Time derivative of a variable, of this order, by the declared chain of derivatives. */
Status derivative_of(Instance *instance, const Variable *v, int element, int order, double *value) {
    const Variable *found = v;
    for (int left = order; left > 0 && found; left--) found = found->derivative < 0 ? 0 : &component.variable[found->derivative];
    if (order < 1 || !found)
        return refuse(instance, ERROR, "%s: the derivative of %s of order %d is not known", component.name, v->name, order);
    *value = *(const double *)field(instance, found, element);
    return OK;
}

/* Whether n values are really given; if not, says so. */
int check_null(Instance *instance, const void *pointer, size_t n, const char *function) {
    if (pointer || !n) return 1;
    refuse(instance, ERROR, "%s: %s was given a null pointer for %d values", component.name, function, (int)n);
    return 0;
}
