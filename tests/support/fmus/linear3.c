/* The linear FMU for FMI 3.0: its states are an array x, their derivatives an array der(x). */

#include "linear.h"

#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"

static fmi3Status failed(Linear *self, const char *text) {
    ((fmi3LogMessageCallback)self->logger)(self->environment, fmi3Error, "logStatus", text);
    return fmi3Error;
}

static size_t length(fmi3ValueReference vr) { return vr == X || vr == DX ? 4 : 1; }

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
    fmi3Boolean early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Linear *self = make(name, 0);
    self->environment = environment, self->logger = (void *)log;
    return self;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                 fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    Linear *self = make(name, 1);
    self->environment = environment, self->logger = (void *)log;
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { return start(c), fmi3OK; }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
    ((Linear *)c)->tolerance = tolerance_defined ? tolerance : 0.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m) {
    if (unreadable(c))
        return failed(c, "read between set and step");
    evaluate(c);
    for (size_t i = 0; i < n; values += length(vr[i]), i++)
        memcpy(values, ((Linear *)c)->now.r + vr[i], length(vr[i]) * sizeof *values);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m) {
    ((Linear *)c)->set = 1;
    for (size_t i = 0; i < n; values += length(vr[i]), i++)
        memcpy(((Linear *)c)->now.r + vr[i], values, length(vr[i]) * sizeof *values);
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_going_back, fmi3Boolean *event_needed,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    *event_needed = *terminate = *early = 0, *last = t + h;
    step(c, t, h, no_going_back);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n,
                                               const fmi3ValueReference known[], size_t m, const fmi3Float64 seed[], size_t seeds,
                                               fmi3Float64 found[], size_t wanted) {
    size_t i = 0;
    if (is(c, DIRECTIONAL_FAILS))
        return failed(c, "no derivatives today");
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < length(unknown[a]); b++, i++) {
            size_t j = 0;
            found[i] = 0.0;
            for (size_t k = 0; k < m; k++)
                for (size_t l = 0; l < length(known[k]); l++, j++)
                    found[i] += seed[j] == 0.0 ? 0.0 : seed[j] * partial(c, (int)(unknown[a] + b), (int)(known[k] + l));
        }
    return i == wanted ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    *again = is(c, ENDLESS), *terminate = is(c, TERMINATES), *nominals = *values = *next_defined = 0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count) {
    return *count = is(c, OTHER_COUNT) ? 40000 : 4, fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    evaluate(c);
    memcpy(x, ((Linear *)c)->now.r + X, n * sizeof *x);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    if (is(c, STATES_REFUSED))
        return failed(c, "no such states");
    memcpy(((Linear *)c)->now.r + X, x, n * sizeof *x);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    if (is(c, DERIVATIVES_FAIL))
        return failed(c, "no right-hand side");
    evaluate(c);
    memcpy(dx, ((Linear *)c)->now.r + DX, n * sizeof *dx);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominal[], size_t n) {
    for (size_t i = 0; i < n; i++)
        nominal[i] = 1.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (is(c, SAVE_FAILS))
        return failed(c, "nothing is saved");
    *state = saved(c);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    return restore(c, state) ? fmi3OK : failed(c, "set back, after it was told that this would not be");
}
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { return free(*state), *state = NULL, fmi3OK; }

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }

EXPORT fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_going_back, fmi3Boolean *event, fmi3Boolean *end) {
    *event = *end = fmi3False;
    return fmi3OK;
}

#define FINE(Name) EXPORT fmi3Status fmi3##Name(void) { return fmi3OK; }
FINE(ExitInitializationMode) FINE(Terminate) FINE(SetDebugLogging) FINE(EnterEventMode)
FINE(EnterStepMode) FINE(EnterContinuousTimeMode) FINE(SetTime)

#define ABSENT(Name) EXPORT fmi3Status fmi3##Name(void) { return fmi3Error; }
#define BOTH(Name) ABSENT(Get##Name) ABSENT(Set##Name)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(Int32) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(Boolean)
BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(IntervalDecimal) BOTH(IntervalFraction) BOTH(ShiftDecimal) BOTH(ShiftFraction)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetVariableDependencies) ABSENT(SerializedFMUStateSize) ABSENT(SerializeFMUState)
ABSENT(DeserializeFMUState) ABSENT(GetAdjointDerivative) ABSENT(EnterConfigurationMode) ABSENT(ExitConfigurationMode)
ABSENT(EvaluateDiscreteStates) ABSENT(GetEventIndicators) ABSENT(GetNumberOfEventIndicators)
ABSENT(GetOutputDerivatives) ABSENT(ActivateModelPartition)
