/* The faulty FMU for FMI 2.0. */

#include "faulty.h"

#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

static void say(Faulty *self, int status, const char *text) {
    const fmi2CallbackFunctions *callbacks = self->callbacks;
    callbacks->logger(is_called(self->name, "stranger") ? self : callbacks->componentEnvironment, self->name, (fmi2Status)status, "logStatus", "%s", text);
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Faulty *self = calloc(1, sizeof *self);
    self->callbacks = callbacks;
    snprintf(self->name, sizeof self->name, "%s", name);
    if (strcmp(guid, TOKEN) != 0 || is_called(name, "null")) {
        say(self, fmi2Error, strcmp(guid, TOKEN) ? "the GUID is of another FMU" : "there is no instance today");
        free(self);
        return NULL;
    }
    start(self);
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component self) { let_go(self); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                                      fmi2Boolean stop_defined, fmi2Real stop_time) {
    Faulty *self = c;
    self->time = start_time;
    if (is_called(self->name, "setup"))
        self->integers[2] = SETUP, self->integers[3] = fmi2Error;
    return judged(self, SETUP, "set-up");
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return judged(c, ENTER_INITIALIZATION, "initialization"); }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return judged(c, EXIT_INITIALIZATION, "initialization"); }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    int status = judged(c, RESET, "reset");
    if (status == 0)
        start(c);
    return status;
}

#define VALUES(Name, type, field, first, get_fault, set_fault) \
    EXPORT fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type values[]) { \
        Faulty *self = c; \
        for (size_t i = 0; i < n; i++) \
            values[i] = self->field[vr[i] - first]; \
        return judged(self, get_fault, "reading"); \
    } \
    EXPORT fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const type values[]) { \
        Faulty *self = c; \
        for (size_t i = 0; i < n; i++) \
            self->field[vr[i] - first] = values[i]; \
        return judged(self, set_fault, "writing"); \
    }

VALUES(Real, fmi2Real, reals, INPUT, GET_REAL, SET_REAL)
VALUES(Integer, fmi2Integer, integers, COUNT_IN, GET_INTEGER, SET_INTEGER)
VALUES(Boolean, fmi2Boolean, flags, FLAG_IN, GET_BOOLEAN, SET_BOOLEAN)

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    int status = judged(c, STEP, "a step");
    if (status < fmi2Discard && is_now(c, TERMINATE_IN_STEP))
        return fmi2Discard;
    if (status < fmi2Discard)
        advance(c, h);
    return status;
}

EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    *value = is_now(c, TERMINATE_IN_STEP) && kind == fmi2Terminated;
    return fmi2OK;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) { return fmi2OK; }

#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(GetString) ABSENT(SetString) ABSENT(GetFMUstate) ABSENT(SetFMUstate) ABSENT(FreeFMUstate)
ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative)
ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus)
ABSENT(GetRealStatus) ABSENT(GetIntegerStatus)
ABSENT(GetStringStatus)
