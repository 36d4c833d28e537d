/* The faulty FMU for FMI 3.0. */

#include "faulty.h"

#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"

static void say(Faulty *self, int status, const char *text) {
    ((fmi3LogMessageCallback)self->logger)(self->environment, (fmi3Status)status, "logStatus", text);
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
    fmi3Boolean early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Faulty *self = calloc(1, sizeof *self);
    self->environment = environment, self->logger = (void *)log, self->event_mode = event_mode;
    snprintf(self->name, sizeof self->name, "%s", name);
    if (strcmp(token, TOKEN) != 0 || is_called(name, "null")) {
        say(self, fmi3Error, strcmp(token, TOKEN) ? "the token is of another FMU" : "there is no instance today");
        free(self);
        return NULL;
    }
    if (event_mode && strcmp(name, "plain") == 0) {
        say(self, fmi3Error, "Event Mode is not supported.");
        free(self);
        return NULL;
    }
    start(self);
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance self) { let_go(self); }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
    ((Faulty *)c)->time = start_time;
    return judged(c, ENTER_INITIALIZATION, "initialization");
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return judged(c, EXIT_INITIALIZATION, "initialization"); }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }

EXPORT fmi3Status fmi3Reset(fmi3Instance c) {
    int status = judged(c, RESET, "reset");
    if (status == 0)
        start(c);
    return status;
}

#define VALUES(Name, field, first, get_fault, set_fault) \
    EXPORT fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##Name values[], size_t m) { \
        Faulty *self = c; \
        for (size_t i = 0; i < n; i++) \
            values[i] = (&self->field)[vr[i] - first]; \
        return judged(self, get_fault, "reading"); \
    } \
    EXPORT fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##Name values[], size_t m) { \
        Faulty *self = c; \
        for (size_t i = 0; i < n; i++) \
            (&self->field)[vr[i] - first] = values[i]; \
        return judged(self, set_fault, "writing"); \
    }

VALUES(Float64, reals[0], INPUT, GET_REAL, SET_REAL)
VALUES(Int32, integers[0], COUNT_IN, GET_INTEGER, SET_INTEGER)
VALUES(Boolean, flags[0], FLAG_IN, GET_BOOLEAN, SET_BOOLEAN)
VALUES(UInt8, small, SMALL, NEVER, NEVER)
VALUES(Float32, single, SINGLE, NEVER, NEVER)

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_going_back, fmi3Boolean *event_needed,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    Faulty *self = c;
    int status = judged(self, STEP, "a step");
    *event_needed = 0, *terminate = is_now(self, TERMINATE_IN_STEP), *early = 0, *last = t;
    if (status >= fmi3Discard)
        return status;
    if (self->integers[2] == EARLY && fabs(self->time - self->reals[2]) < 1e-9) /* once, and not announced */
        h *= 0.25, *early = 1, *event_needed = self->event_mode;
    advance(self, h);
    *last = t + h;
    return status;
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) { return judged(c, ENTER_EVENT, "event mode"); }
EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { return judged(c, ENTER_STEP, "step mode"); }

/* Events are announced every 0.25 s. */
EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    Faulty *self = c;
    *again = is_now(self, ENDLESS), *terminate = is_now(self, TERMINATE_IN_UPDATE), *nominals = *values = 0;
    *next_defined = 1, *next = 0.25 * (floor(self->time / 0.25 + 1e-9) + 1.0);
    return judged(self, UPDATE, "the update");
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) { return fmi3OK; }
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }

#define ABSENT(Name) EXPORT fmi3Status fmi3##Name(void) { return fmi3Error; }
#define BOTH(Name) ABSENT(Get##Name) ABSENT(Set##Name)
BOTH(Int8) BOTH(Int16) BOTH(UInt16) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(String) BOTH(Binary) BOTH(Clock)
BOTH(FMUState) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal) BOTH(ShiftFraction) BOTH(ContinuousStates)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetVariableDependencies) ABSENT(FreeFMUState) ABSENT(SerializedFMUStateSize)
ABSENT(SerializeFMUState) ABSENT(DeserializeFMUState) ABSENT(GetDirectionalDerivative) ABSENT(GetAdjointDerivative)
ABSENT(EnterConfigurationMode) ABSENT(ExitConfigurationMode) ABSENT(EvaluateDiscreteStates) ABSENT(EnterContinuousTimeMode)
ABSENT(CompletedIntegratorStep) ABSENT(SetTime) ABSENT(GetContinuousStateDerivatives) ABSENT(GetEventIndicators)
ABSENT(GetNominalsOfContinuousStates) ABSENT(GetNumberOfEventIndicators) ABSENT(GetNumberOfContinuousStates)
ABSENT(GetOutputDerivatives) ABSENT(ActivateModelPartition)
