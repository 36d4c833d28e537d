/* FMI 3.0 of a container: co-simulation with event mode and early return. */

#include "container.h"
#include "fmi3Functions.h"

#include <stdlib.h>

#define READABLE (INITIALIZING | STEPPING | EVENT | TERMINATED | FAILED)
#define WRITABLE (INSTANTIATED | INITIALIZING | STEPPING | EVENT)
#define ANY (READABLE | WRITABLE)
#define REQUIRE(phases) \
    Container *const container = (Container *)instance; \
    if (!allowed(container, __func__, phases)) return fmi3Error

/* A call that reaches the FMUs inside. */
#define DO(call) \
    enter(container); \
    return (fmi3Status)leave(container, call)

const char *fmi3GetVersion(void) { return fmi3Version; }

static void log_fmi3(Container *container, Status status, const char *category, const char *text) {
    ((fmi3LogMessageCallback)container->callback)(container->environment, (fmi3Status)status, category, text);
}

static Container *instantiate(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean logging, void *environment,
                              fmi3LogMessageCallback log, int known) {
    Container *const container = new_container(name, token, resource_folder(resources, 0, (const void *)(uintptr_t)&fmi3GetVersion));
    if (!container) return 0;
    if (log) {
        container->callback = (void (*)(void))log;
        container->environment = environment;
        container->log = log_fmi3;
    }
    container->logging = logging != 0;
    enter(container);
    const int done = begin_container(container, known);
    container->given_token = 0;
    leave(container, OK);
    if (done) return container;
    free_container(container);
    return 0;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)visible;
    return instantiate(instanceName, instantiationToken, resourcePath, loggingOn, instanceEnvironment, logMessage, 0);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)visible, (void)requiredIntermediateVariables, (void)intermediateUpdate;
    const int known = nRequiredIntermediateVariables == 0;
    Container *const container =
        instantiate(instanceName, instantiationToken, resourcePath, loggingOn, instanceEnvironment, logMessage, known);
    if (!container) return 0;
    container->event_mode = eventModeUsed != 0;
    container->early_return = earlyReturnAllowed != 0;
    return container;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                               fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)visible, (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return instantiate(instanceName, instantiationToken, resourcePath, loggingOn, instanceEnvironment, logMessage, 0);
}

void fmi3FreeInstance(fmi3Instance instance) {
    if (instance) free_container((Container *)instance);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[]) {
    REQUIRE(ANY);
    return (fmi3Status)set_logging(container, loggingOn, nCategories, categories);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    REQUIRE(INSTANTIATED);
    if (set_start(container, startTime, stopTimeDefined, stopTime, toleranceDefined, tolerance)) return fmi3Error;
    DO(enter_initialization(container));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(INITIALIZING);
    DO(exit_initialization(container));
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    REQUIRE(STEPPING | EVENT);
    DO(terminate(container));
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    REQUIRE(ANY);
    DO(reset(container));
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    REQUIRE(STEPPING);
    if (!container->event_mode)
        return (fmi3Status)complain(container, ERROR, "%s: event mode was not asked for at the instantiation", container->name);
    container->phase = EVENT;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    REQUIRE(EVENT);
    if (!discreteStatesNeedUpdate || !terminateSimulation || !nominalsOfContinuousStatesChanged || !valuesOfContinuousStatesChanged ||
        !nextEventTimeDefined || !nextEventTime)
        return (fmi3Status)complain(container, ERROR, "%s: %s: a pointer is null", container->name, __func__);
    enter(container);
    Status status = leave(container, update_events(container, nextEventTime));
    *discreteStatesNeedUpdate = *nominalsOfContinuousStatesChanged = *valuesOfContinuousStatesChanged = fmi3False;
    *terminateSimulation = status != OK && container->control.fault == FAULT_TERMINATED;
    if (*terminateSimulation) status = OK, container->terminated = 1;
    *nextEventTimeDefined = status <= WARNING && !*terminateSimulation && *nextEventTime < NO_EVENT;
    return (fmi3Status)settle_phase(container, status);
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    REQUIRE(INITIALIZING | EVENT);
    DO(look_through(container));
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(EVENT);
    container->phase = STEPPING;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    REQUIRE(STEPPING);
    if (!eventHandlingNeeded || !terminateSimulation || !earlyReturn || !lastSuccessfulTime)
        return (fmi3Status)complain(container, ERROR, "%s: %s: a pointer is null", container->name, __func__);
    enter(container);
    Status status = leave(container, advance(container, currentCommunicationPoint, communicationStepSize, noSetFMUStatePriorToCurrentPoint));
    const Control *const control = &container->control;
    const int ended = control->fault == FAULT_TERMINATED;
    *terminateSimulation = ended;
    *eventHandlingNeeded = status <= WARNING && control->paused;
    *lastSuccessfulTime = control->t;
    *earlyReturn = (status <= WARNING && control->paused && control->done < control->steps) || ended;
    if (ended) status = OK; /* the flag says it */
    return (fmi3Status)status;
}

#define VALUES(Name, type) \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, fmi3##Name values[], size_t nValues) { \
        REQUIRE(READABLE); \
        DO(get_variables(container, __func__, FOR_FMI3, type, vr, n, values, 0, nValues)); \
    } \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const fmi3##Name values[], \
                             size_t nValues) { \
        REQUIRE(WRITABLE); \
        DO(set_variables(container, __func__, FOR_FMI3, type, vr, n, values, 0, nValues)); \
    }

VALUES(Float32, TYPE_F4)
VALUES(Float64, TYPE_F8)
VALUES(Int8, TYPE_I1)
VALUES(UInt8, TYPE_U1)
VALUES(Int16, TYPE_I2)
VALUES(UInt16, TYPE_U2)
VALUES(Int32, TYPE_I4)
VALUES(UInt32, TYPE_U4)
VALUES(Int64, TYPE_I8)
VALUES(UInt64, TYPE_U8)
VALUES(Boolean, TYPE_BOOLEAN3)
VALUES(String, TYPE_STRING)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[],
                         size_t nValues) {
    REQUIRE(READABLE);
    DO(get_variables(container, __func__, FOR_FMI3, TYPE_BINARY, vr, n, values, sizes, nValues));
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t nValues) {
    REQUIRE(WRITABLE);
    DO(set_variables(container, __func__, FOR_FMI3, TYPE_BINARY, vr, n, values, sizes, nValues));
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(ANY);
    DO(save_state(container, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    REQUIRE(ANY);
    DO(restore_state(container, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(ANY);
    DO(free_state(container, FMUState));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    REQUIRE(ANY);
    DO(state_size(container, FMUState, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size) {
    REQUIRE(ANY);
    DO(serialize_state(container, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState) {
    REQUIRE(ANY);
    DO(deserialize_state(container, serializedState, size, FMUState));
}
