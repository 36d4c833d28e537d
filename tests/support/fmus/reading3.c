/* The lag for FMI 3.0, with event mode where it is wanted: in it values may be read, and in it alone its discrete input be set. */

#include "reading.h"

#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"

static fmi3LogMessageCallback log_message;

static fmi3Status refused(void) { return log_message(NULL, fmi3Error, "logStatus", "read between set and step"), fmi3Error; }

EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                                const fmi3ValueReference required[], size_t count,
                                                fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                                fmi3IntermediateUpdateCallback update) {
    Lag *self = make();
    log_message = logger;
    self->event_mode = event_mode;
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
    ((Lag *)c)->stop = stop_time;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return initialized(c), fmi3OK; }
EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) { return ((Lag *)c)->stepping = 0, fmi3OK; }
EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) { return ((Lag *)c)->stepping = 1, fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { return reset(c), fmi3OK; }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    return *again = *terminate = *nominals = *values = *next_defined = 0, fmi3OK;
}

#define TRANSFER(Type)                                                                                                            \
    EXPORT fmi3Status fmi3Get##Type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##Type values[], size_t m) {     \
        if (!readable(c))                                                                                                         \
            return refused();                                                                                                     \
        for (size_t i = 0; i < n; i++)                                                                                            \
            values[i] = (fmi3##Type)((Lag *)c)->value[vr[i]];                                                                     \
        return fmi3OK;                                                                                                            \
    }                                                                                                                             \
    EXPORT fmi3Status fmi3Set##Type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##Type values[],           \
                                    size_t m) {                                                                                   \
        for (size_t i = 0; i < n; i++)                                                                                            \
            if (vr[i] == COUNT_IN && ((Lag *)c)->event_mode && ((Lag *)c)->stepping)                                              \
                return log_message(NULL, fmi3Error, "logStatus", "discrete input set in Step Mode"), fmi3Error;                   \
            else if (!set(c, vr[i], values[i]))                                                                                   \
                return log_message(NULL, fmi3Error, "logStatus", "u is out of its bounds"), fmi3Error;                            \
        return fmi3OK;                                                                                                            \
    }
TRANSFER(Float64)
TRANSFER(Int32)

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_going_back, fmi3Boolean *event,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    *event = *terminate = *early = 0, *reached = t + h;
    return step(c, t, h) ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { return *state = saved(c), fmi3OK; }
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return *(Lag *)c = *(Lag *)state, fmi3OK; }
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { return free(*state), *state = NULL, fmi3OK; }

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }

#define ABSENT(Name) EXPORT fmi3Status fmi3##Name(void) { return fmi3Error; }
#define BOTH(Name) ABSENT(Get##Name) ABSENT(Set##Name)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(Boolean) BOTH(String)
BOTH(Binary) BOTH(Clock) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal) BOTH(ShiftFraction) BOTH(ContinuousStates)
ABSENT(SetDebugLogging) ABSENT(EnterContinuousTimeMode) ABSENT(SetTime) ABSENT(GetDirectionalDerivative)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetVariableDependencies) ABSENT(SerializedFMUStateSize) ABSENT(SerializeFMUState)
ABSENT(DeserializeFMUState) ABSENT(GetAdjointDerivative) ABSENT(EnterConfigurationMode) ABSENT(ExitConfigurationMode)
ABSENT(EvaluateDiscreteStates) ABSENT(CompletedIntegratorStep) ABSENT(GetEventIndicators) ABSENT(GetNumberOfEventIndicators)
ABSENT(GetOutputDerivatives) ABSENT(ActivateModelPartition) ABSENT(GetContinuousStateDerivatives)
ABSENT(GetNominalsOfContinuousStates) ABSENT(GetNumberOfContinuousStates)
