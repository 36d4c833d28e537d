/* The life of an instance: from its start values through initialization, steps and events. */

#include "component.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A fresh instance, or null if there is not enough memory. */
Instance *new_instance(const char *name, int model_exchange) {
    Instance *instance = (Instance *)calloc(1, sizeof *instance);
    if (!instance) return 0;
    size_t size = (size_t)component.record_size;
    instance->name = (char *)malloc(strlen(name) + 1);
    instance->record = (unsigned char *)calloc(model_exchange ? 4 : 2, size);
    if (!instance->name || !instance->record) return free_instance(instance), (Instance *)0;
    strcpy(instance->name, name);
    instance->trial = instance->record + size;
    instance->scratch = model_exchange ? instance->record + 2 * size : 0;
    instance->held = model_exchange ? instance->record + 3 * size : 0;
    instance->model_exchange = model_exchange;
    instance->log_mask = LOG_ALL & ~LOG_EVENTS;
    reset_instance(instance);
    return instance;
}

void free_instance(Instance *instance) {
    free(instance->name);
    free(instance->record);
    free(instance);
}

void reset_instance(Instance *instance) {
    start_values(instance->record, 1);
    instance->untouched = 1;
    instance->phase = INSTANTIATED;
    instance->step_status = OK;
    instance->stale = instance->tried = instance->stop_defined = 0;
    instance->time = instance->record_time = 0.0;
    instance->event_time = NO_EVENT;
}

/* Whether name, token and type are right; if not, says so. */
int check_identity(Instance *instance, const char *name, const char *token, int known_type) {
    if (!name || !*name)
        refuse(instance, ERROR, "%s: an instance needs a name", component.name);
    else if (!token || strcmp(token, component.token))
        refuse(instance, ERROR, "%s: the token %s is not that of this library, %s: description and library do not belong together",
               component.name, token ? token : "(null)", component.token);
    else if (!known_type || (instance->model_exchange && !component.model_exchange))
        refuse(instance, ERROR, "%s: this kind of simulation is not supported", component.name);
    else
        return 1;
    return 0;
}

static const char *phase_name(Phase phase) {
    switch (phase) {
        case INSTANTIATED: return "before initialization";
        case INITIALIZING: return "during initialization";
        case STEPPING: return "between steps";
        case EVENT: return "in event mode";
        case CONTINUOUS: return "in continuous-time mode";
        case INTERMEDIATE: return "during an intermediate update";
        case TERMINATED: return "after termination";
        default: return "after an error";
    }
}

static int is_for_other_kind(const Instance *instance, int phases) {
    return phases & (instance->model_exchange ? STEPS_ONLY : EXCHANGE_ONLY);
}

static COLD void refuse_call(Instance *instance, const char *function, int phases) {
    if (is_for_other_kind(instance, phases))
        refuse(instance, ERROR, "%s: %s is not for %s", component.name, function,
               instance->model_exchange ? "model exchange" : "co-simulation");
    else
        refuse(instance, ERROR, "%s: %s cannot be called %s", component.name, function, phase_name(instance->phase));
}

/* Whether the function may be called now; if not, says so. */
int allowed(Instance *instance, const char *function, int phases) {
    if (!instance) return 0;
    if (instance->phase & phases && !is_for_other_kind(instance, phases)) return 1;
    refuse_call(instance, function, phases);
    return 0;
}

Status set_start(Instance *instance, double start, int stop_defined, double stop) {
    if (!isfinite(start)) return refuse(instance, ERROR, "%s: the start time %g is not a finite number", component.name, start);
    if (stop_defined && !(stop >= start))
        return refuse(instance, ERROR, "%s: the stop time %.15g s is before the start time %.15g s", component.name, stop, start);
    instance->time = instance->record_time = start;
    instance->stop_defined = stop_defined;
    instance->stop_time = stop;
    return OK;
}

Status enter_initialization(Instance *instance) {
    instance->phase = INITIALIZING;
    instance->stale = 1;
    return OK;
}

static Status run_start(Instance *instance, unsigned char *record) {
    Fault fault = {0, 0, 0, 0.0, 0.0};
    int status = kernel_start(record, &fault);
    if (fault.what) return kernel_fault(instance, &fault, instance->time);
    return status ? kernel_failure(instance, record, status, instance->time) : OK;
}

static IN_LINE Status run_step(Instance *instance, unsigned char *record, double t, double h, int left_limits) {
    Fault fault = {0, 0, 0, 0.0, 0.0};
    int status;
    *(int *)(record + component.left_limits) = left_limits;
    status = kernel_step(record, t, h, &fault);
    *(int *)(record + component.left_limits) = 0;
    if (!fault.what && !status) return check_results(instance, record, t, 0);
    return fault.what ? kernel_fault(instance, &fault, t) : kernel_failure(instance, record, status, t), ERROR;
}

/* Parameters and inputs are checked; then states and outputs come from scratch. */
static Status initialize(Instance *instance) {
    if (check_domains(instance)) return ERROR;
    if (!instance->untouched) start_values(instance->record, 0);
    instance->untouched = 0;
    if (run_start(instance, instance->record) || check_results(instance, instance->record, instance->time, 1)) return ERROR;
    if (run_step(instance, instance->record, instance->time, 0.0, 0)) return ERROR;
    instance->stale = 0;
    return OK;
}

static void hold(Instance *instance) {
    if (component.sampled && instance->model_exchange) memcpy(instance->held, instance->record, (size_t)component.record_size);
}

Status exit_initialization(Instance *instance, Phase next) {
    if (instance->stale && initialize(instance)) return ERROR;
    instance->phase = next;
    hold(instance);
    return OK;
}

static size_t scalar_size(const Scalar *s) { return s->kind == REAL ? 8 : 4; }

static void copy_inputs(unsigned char *to, const unsigned char *from) {
    for (int k = 0; k < component.inputs; k++) {
        const Scalar *s = &component.input[k];
        memcpy(to + s->offset, from + s->offset, scalar_size(s));
    }
}

/* Model exchange between events: values at the trial time, beside the record. They are those from the left where the next
   event waits, and nowhere else: after an event those from the right. Sampled inputs act as they were at the last event. */
static Status try_out(Instance *instance) {
    double t = instance->time;
    int waits = next_event(instance) <= t + 64.0 * 2.220446049250313e-16 * fabs(t);
    if (check_inputs(instance, t)) return ERROR;
    memcpy(instance->scratch, instance->record, (size_t)component.record_size);
    if (component.sampled) copy_inputs(instance->scratch, instance->held);
    if (run_step(instance, instance->scratch, t, 0.0, waits)) return ERROR;
    if (component.sampled) copy_inputs(instance->scratch, instance->record);
    instance->stale = 0;
    instance->tried = 1;
    return OK;
}

/* Results at t from the values in the trial record: what they would be if these were the instance's. */
Status run_trial(Instance *instance, double t) {
    int waits = instance->phase == CONTINUOUS && next_event(instance) <= t + 64.0 * 2.220446049250313e-16 * fabs(t);
    if (instance->phase == CONTINUOUS && component.sampled) copy_inputs(instance->trial, instance->held);
    if (instance->phase == INITIALIZING) {
        start_values(instance->trial, 0);
        if (run_start(instance, instance->trial) || check_results(instance, instance->trial, t, 1)) return ERROR;
    }
    return run_step(instance, instance->trial, t, 0.0, waits);
}

/* A value was set. At a communication point outputs stay as they are when it is the one that was there already. */
void note_set(Instance *instance, int changed) {
    if (changed || !(instance->phase & (STEPPING | EVENT))) instance->stale = 1;
}

static Status bring_up_to_date(Instance *instance) {
    if (instance->phase == INITIALIZING) return initialize(instance);
    if (instance->phase == CONTINUOUS) return try_out(instance);
    if (!(instance->phase & (STEPPING | EVENT))) return OK;
    double now = instance->event_time < NO_EVENT && instance->event_time > instance->time ? instance->event_time : instance->time;
    if (advance(instance, now, 0.0, 0)) return ERROR;
    instance->event_time = NO_EVENT;
    hold(instance);
    return OK;
}

/* Outputs follow the values set so far: all of them while initializing, inputs without delay at a communication point. */
Status refresh(Instance *instance) { return instance->stale ? bring_up_to_date(instance) : OK; }

double next_event(const Instance *instance) {
    return component.next_event_time < 0 ? NO_EVENT : *(const double *)(instance->record + component.next_event_time);
}

/* Run the kernel over [t, t + h] with the inputs held. Its failure ends the instance's life, but for a reset. */
Status advance(Instance *instance, double t, double h, int left_limits) {
    if (check_inputs(instance, t)) return ERROR;
    double due = next_event(instance);
    if (run_step(instance, instance->record, t, h, left_limits)) {
        instance->phase = FAILED;
        return ERROR;
    }
    instance->stale = 0;
    if (due <= t + h && due < next_event(instance) && instance->log_mask & LOG_EVENTS)
        refuse(instance, OK, "%s: event at t = %.15g s", component.name, due);
    return OK;
}

/* What a clock may differ by that adds steps up. */
static double rounding_of(double t, double h) { return 1e-6 * h + 1e-9 * fabs(t); }

static COLD Status refuse_step(Instance *instance, double t, double h) {
    if (!(isfinite(t) && isfinite(t + h) && h >= 0.0))
        return refuse(instance, ERROR, "%s: a step of %g s at t = %.15g s is not possible; it must be finite and not negative",
                      component.name, h, t);
    if (fabs(t - instance->time) > rounding_of(t, h))
        return refuse(instance, ERROR, "%s: a step cannot begin at t = %.15g s: the last one ended at %.15g s", component.name, t,
                      instance->time);
    return refuse(instance, ERROR, "%s: a step to t = %.15g s ends after the stop time %.15g s", component.name, t + h,
                  instance->stop_time);
}

/* Whether a step from t over h is possible: it must begin where the last one ended. If not, says so. */
Status check_step(Instance *instance, double t, double h) {
    double rounding = rounding_of(t, h), end = t + h;
    int follows = h >= 0.0 && fabs(t - instance->time) <= rounding && fabs(end) < HUGE_VAL;
    if (follows && !(instance->stop_defined && end > instance->stop_time + rounding)) return OK;
    refuse_step(instance, t, h);
    return ERROR;
}

/* Whether an input that acts only when sampled differs from its last sample. */
int samples_changed(const Instance *instance) {
    if (!component.sampled || !instance->held) return 0;
    for (int k = 0; k < component.inputs; k++) {
        const Scalar *s = &component.input[k];
        if (memcmp(instance->held + s->offset, instance->record + s->offset, scalar_size(s))) return 1;
    }
    return 0;
}

/* Advance the record to the time, with its inputs as they were at the last event where they act only when sampled. */
static Status advance_held(Instance *instance) {
    if (component.sampled) {
        memcpy(instance->scratch, instance->record, (size_t)component.record_size);
        copy_inputs(instance->record, instance->held);
    }
    Status status = advance(instance, instance->record_time, instance->time - instance->record_time, 1);
    if (component.sampled) copy_inputs(instance->record, instance->scratch);
    return status;
}

/* In model exchange, a component without continuous states is advanced here. */
Status enter_event_mode(Instance *instance) {
    if (instance->phase == CONTINUOUS && !component.states && instance->time > instance->record_time) {
        Status status = advance_held(instance);
        if (status) return status;
    }
    instance->record_time = instance->time;
    instance->phase = EVENT;
    instance->stale = 1;
    instance->tried = 0;
    return OK;
}

/* The last values stay, also those that were tried out. */
void terminate(Instance *instance) {
    if (instance->tried) memcpy(instance->record, instance->scratch, (size_t)component.record_size);
    instance->tried = 0;
    instance->phase = TERMINATED;
}
