/* The linear FMU for FMI 2.0. */

#include "linear.h"

#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

static fmi2Status failed(Linear *self, const char *text) {
    const fmi2CallbackFunctions *callbacks = self->callbacks;
    callbacks->logger(callbacks->componentEnvironment, self->name, fmi2Error, "logStatus", "%s", text);
    return fmi2Error;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Linear *self = make(name, type == fmi2ModelExchange);
    self->callbacks = callbacks;
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                                      fmi2Boolean stop_defined, fmi2Real stop_time) {
    ((Linear *)c)->tolerance = tolerance_defined ? tolerance : 0.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2Reset(fmi2Component c) { return start(c), fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    if (unreadable(c))
        return failed(c, "read between set and step");
    evaluate(c);
    for (size_t i = 0; i < n; i++)
        values[i] = ((Linear *)c)->now.r[vr[i]];
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    ((Linear *)c)->set = 1;
    for (size_t i = 0; i < n; i++)
        ((Linear *)c)->now.r[vr[i]] = values[i];
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    step(c, t, h, no_going_back);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                               const fmi2ValueReference known[], size_t m, const fmi2Real seed[], fmi2Real found[]) {
    if (is(c, DIRECTIONAL_FAILS))
        return failed(c, "no derivatives today");
    for (size_t i = 0; i < n; i++) {
        found[i] = 0.0;
        for (size_t j = 0; j < m; j++)
            found[i] += partial(c, (int)unknown[i], (int)known[j]) * seed[j];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    info->newDiscreteStatesNeeded = is(c, ENDLESS);
    info->terminateSimulation = is(c, TERMINATES);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    evaluate(c);
    memcpy(x, ((Linear *)c)->now.r + X, n * sizeof *x);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    if (is(c, STATES_REFUSED))
        return failed(c, "no such states");
    memcpy(((Linear *)c)->now.r + X, x, n * sizeof *x);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    if (is(c, DERIVATIVES_FAIL))
        return failed(c, "no right-hand side");
    evaluate(c);
    memcpy(dx, ((Linear *)c)->now.r + DX, n * sizeof *dx);
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n) {
    for (size_t i = 0; i < n; i++)
        nominal[i] = 1.0;
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (is(c, SAVE_FAILS))
        return failed(c, "nothing is saved");
    *state = saved(c);
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    return restore(c, state) ? fmi2OK : failed(c, "set back, after it was told that this would not be");
}
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return free(*state), *state = NULL, fmi2OK; }

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_going_back, fmi2Boolean *event, fmi2Boolean *end) {
    *event = *end = fmi2False;
    return fmi2OK;
}

#define FINE(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2OK; }
FINE(EnterInitializationMode) FINE(ExitInitializationMode) FINE(Terminate) FINE(SetDebugLogging) FINE(EnterEventMode)
FINE(EnterContinuousTimeMode) FINE(SetTime)

#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(GetInteger) ABSENT(SetInteger) ABSENT(GetBoolean) ABSENT(SetBoolean) ABSENT(GetString) ABSENT(SetString)
ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate)
ABSENT(GetEventIndicators) ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus)
ABSENT(GetRealStatus) ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
