/* The lag for FMI 2.0. */

#include "reading.h"

#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

static const fmi2CallbackFunctions *callbacks;

static fmi2Status refused(void) {
    callbacks->logger(callbacks->componentEnvironment, "lag", fmi2Error, "logStatus", "read between set and step, or out of bounds");
    return fmi2Error;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *given, fmi2Boolean visible, fmi2Boolean logging) {
    callbacks = given;
    return make();
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                                      fmi2Boolean stop_defined, fmi2Real stop_time) {
    ((Lag *)c)->stop = stop_time;
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return initialized(c), fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { return reset(c), fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    if (!readable(c))
        return refused();
    for (size_t i = 0; i < n; i++)
        values[i] = ((Lag *)c)->value[vr[i]];
    return fmi2OK;
}

EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer values[]) {
    if (!readable(c))
        return refused();
    for (size_t i = 0; i < n; i++)
        values[i] = (fmi2Integer)((Lag *)c)->value[vr[i]];
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        if (!set(c, vr[i], values[i]))
            return refused();
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer values[]) {
    for (size_t i = 0; i < n; i++)
        if (!set(c, vr[i], values[i]))
            return refused();
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    return step(c, t, h) ? fmi2OK : fmi2Error;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return *state = saved(c), fmi2OK; }
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return *(Lag *)c = *(Lag *)state, fmi2OK; }
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return free(*state), *state = NULL, fmi2OK; }

EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(SetDebugLogging) ABSENT(GetBoolean) ABSENT(GetString) ABSENT(SetBoolean) ABSENT(SetString) ABSENT(SerializedFMUstateSize)
ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative) ABSENT(SetRealInputDerivatives)
ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus) ABSENT(GetRealStatus) ABSENT(GetIntegerStatus)
ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
