/* The equations for FMI 3.0. */

#include "equations.h"

#include "fmi3FunctionTypes.h"

static fmi3Status failed(Equations *self, const char *text) {
    ((fmi3LogMessageCallback)self->logger)(self->environment, fmi3Error, "logStatus", text);
    return fmi3Error;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                 fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                                 fmi3LogMessageCallback logger) {
    Equations *self = make(name);
    self->environment = environment;
    self->logger = (void *)logger;
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }
EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean d, fmi3Float64 tolerance, fmi3Float64 start_time,
                                              fmi3Boolean s, fmi3Float64 stop_time) {
    ((Equations *)c)->time = start_time;
    return fmi3OK;
}
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return begin(c), fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { return start(c), fmi3OK; }

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m) {
    for (size_t i = 0; i < n; i++)
        if (is(c, SECRET) && vr[i] == U) return failed(c, "unknown reference");
    bring_up_to_date(c);
    for (size_t i = 0; i < n; i++) values[i] = ((Equations *)c)->r[vr[i]];
    return is_unreadable(c) ? fmi3Discard : fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m) {
    for (size_t i = 0; i < n; i++) ((Equations *)c)->r[vr[i]] = values[i];
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Equations *const self = c;
    if (!self->in_continuous_time) return failed(self, "event mode from another one");
    self->in_continuous_time = 0;
    self->in_events = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *when) {
    Equations *const self = c;
    if (!self->in_events) return failed(self, "update outside of event mode");
    const int found = update(self);
    *again = found == 1;
    *end = found == 2;
    *nominals = *values = fmi3False;
    *defined = isfinite(self->next_event);
    *when = self->next_event;
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
    Equations *const self = c;
    if (!self->in_events) return failed(self, "continuous-time mode from another one");
    self->in_events = 0;
    self->in_continuous_time = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_going_back, fmi3Boolean *event, fmi3Boolean *end) {
    *event = complete(c);
    *end = fmi3False;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { return ((Equations *)c)->time = t, fmi3OK; }

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    memcpy(((Equations *)c)->r + X, x, n * sizeof *x);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    memcpy(x, ((Equations *)c)->r + X, n * sizeof *x);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    const int status = derive(c);
    if (status == 3) return failed(c, "100% wrong");
    memcpy(dx, ((Equations *)c)->r + DX, n * sizeof *dx);
    return status == 2 ? fmi3Discard : fmi3OK;
}

EXPORT fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
    return give_indicators(c, z, n), fmi3OK;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *kept) {
    if (!*kept) *kept = malloc(sizeof(Equations));
    memcpy(*kept, c, sizeof(Equations));
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState kept) { return memcpy(c, kept, sizeof(Equations)), fmi3OK; }
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *kept) { return free(*kept), *kept = NULL, fmi3OK; }

EXPORT fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { return *n = is(c, WIDE) ? 6 : 2, fmi3OK; }
