/* The equations for FMI 2.0. */

#include "equations.h"

#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

static fmi2Status failed(Equations *self, const char *text) {
    const fmi2CallbackFunctions *callbacks = self->callbacks;
    callbacks->logger(callbacks->componentEnvironment, self->name, fmi2Error, "logStatus", "%s", text);
    return fmi2Error;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2ModelExchange) return NULL;
    Equations *self = make(name);
    self->callbacks = (void *)callbacks;
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean d, fmi2Real tolerance, fmi2Real start_time, fmi2Boolean s,
                                      fmi2Real stop_time) {
    ((Equations *)c)->time = start_time;
    return fmi2OK;
}
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return begin(c), fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { return start(c), fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        if (is(c, SECRET) && vr[i] == U) return failed(c, "unknown reference");
    bring_up_to_date(c);
    for (size_t i = 0; i < n; i++) values[i] = ((Equations *)c)->r[vr[i]];
    return is_unreadable(c) ? fmi2Discard : fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++) ((Equations *)c)->r[vr[i]] = values[i];
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterEventMode(fmi2Component c) {
    Equations *const self = c;
    if (!self->in_continuous_time) return failed(self, "event mode from another one");
    self->in_continuous_time = 0;
    self->in_events = 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    Equations *const self = c;
    if (!self->in_events) return failed(self, "update outside of event mode");
    const int found = update(self);
    info->newDiscreteStatesNeeded = found == 1;
    info->terminateSimulation = found == 2;
    info->nominalsOfContinuousStatesChanged = info->valuesOfContinuousStatesChanged = fmi2False;
    info->nextEventTimeDefined = isfinite(self->next_event);
    info->nextEventTime = self->next_event;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    Equations *const self = c;
    if (!self->in_events) return failed(self, "continuous-time mode from another one");
    self->in_events = 0;
    self->in_continuous_time = 1;
    return fmi2OK;
}

EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_going_back, fmi2Boolean *event, fmi2Boolean *end) {
    *event = complete(c);
    *end = fmi2False;
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { return ((Equations *)c)->time = t, fmi2OK; }

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    if ((int)n != states(c) && n != 2) return failed(c, "another number of states");
    memcpy(((Equations *)c)->r + X, x, n * sizeof *x);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    memcpy(x, ((Equations *)c)->r + X, n * sizeof *x);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    const int status = derive(c);
    if (status == 3) return failed(c, "100% wrong");
    memcpy(dx, ((Equations *)c)->r + DX, n * sizeof *dx);
    return status == 2 ? fmi2Discard : fmi2OK;
}

EXPORT fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    return give_indicators(c, z, n), fmi2OK;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *kept) {
    if (!*kept) *kept = malloc(sizeof(Equations));
    memcpy(*kept, c, sizeof(Equations));
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate kept) { return memcpy(c, kept, sizeof(Equations)), fmi2OK; }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *kept) { return free(*kept), *kept = NULL, fmi2OK; }
