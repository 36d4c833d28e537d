/* FMI 2.0 of a container: co-simulation. */

#include "container.h"
#include "fmi2Functions.h"

#include <stdlib.h>
#include <string.h>

#define READABLE (INITIALIZING | STEPPING | TERMINATED | FAILED)
#define WRITABLE (INSTANTIATED | INITIALIZING | STEPPING)
#define ANY (READABLE | WRITABLE)
#define REQUIRE(phases) \
    Container *const container = (Container *)c; \
    if (!allowed(container, __func__, phases)) return fmi2Error

/* A call that reaches the FMUs inside. */
#define DO(call) \
    enter(container); \
    return (fmi2Status)leave(container, call)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

/* A text may hold a %, which must not be taken for a format. */
static void log_fmi2(Container *container, Status status, const char *category, const char *text) {
    const fmi2CallbackLogger logger = (fmi2CallbackLogger)container->callback;
    logger(container->environment, container->instance_name, (fmi2Status)status, category, "%s", text);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)visible;
    char *const resources = resource_folder(fmuResourceLocation, 1, (const void *)(uintptr_t)&fmi2GetVersion);
    Container *const container = new_container(instanceName, fmuGUID, resources);
    if (!container) return 0;
    if (functions && functions->logger) {
        container->callback = (void (*)(void))functions->logger;
        container->environment = functions->componentEnvironment;
        container->log = log_fmi2;
    }
    container->logging = loggingOn != 0;
    enter(container);
    const int done = begin_container(container, fmuType == fmi2CoSimulation);
    container->given_token = 0;
    leave(container, OK);
    if (done) return container;
    free_container(container);
    return 0;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c) free_container((Container *)c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[]) {
    REQUIRE(ANY);
    return (fmi2Status)set_logging(container, loggingOn, nCategories, categories);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    REQUIRE(INSTANTIATED);
    return (fmi2Status)set_start(container, startTime, stopTimeDefined, stopTime, toleranceDefined, tolerance);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    REQUIRE(INSTANTIATED);
    DO(enter_initialization(container));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    REQUIRE(INITIALIZING);
    DO(exit_initialization(container));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    REQUIRE(STEPPING);
    DO(terminate(container));
}

fmi2Status fmi2Reset(fmi2Component c) {
    REQUIRE(ANY);
    DO(reset(container));
}

#define VALUES(Name, Type, type) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) { \
        REQUIRE(READABLE); \
        DO(get_variables(container, __func__, FOR_FMI2, type, vr, nvr, value, 0, nvr)); \
    } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const Type value[]) { \
        REQUIRE(WRITABLE); \
        DO(set_variables(container, __func__, FOR_FMI2, type, vr, nvr, value, 0, nvr)); \
    }

VALUES(Real, fmi2Real, TYPE_F8)
VALUES(Integer, fmi2Integer, TYPE_I4)
VALUES(Boolean, fmi2Boolean, TYPE_BOOLEAN2)
VALUES(String, fmi2String, TYPE_STRING)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    DO(save_state(container, FMUstate));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    REQUIRE(ANY);
    DO(restore_state(container, FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    DO(free_state(container, FMUstate));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    REQUIRE(ANY);
    DO(state_size(container, FMUstate, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    REQUIRE(ANY);
    DO(serialize_state(container, FMUstate, serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    DO(deserialize_state(container, serializedState, size, FMUstate));
}

static fmi2Status absent(Container *container, const char *function) {
    return (fmi2Status)complain(container, ERROR, "%s: %s is not supported", container->name, function);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown, (void)dvKnown, (void)dvUnknown;
    REQUIRE(READABLE);
    return absent(container, __func__);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[]) {
    REQUIRE(WRITABLE);
    DO(set_slopes(container, vr, nvr, order, value));
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    REQUIRE(READABLE);
    return absent(container, __func__);
}

static Status step(Container *container, double t, double h, int no_going_back) {
    const Status status = advance(container, t, h, no_going_back);
    container->step_status = status;
    return status;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    REQUIRE(STEPPING);
    DO(step(container, currentCommunicationPoint, communicationStepSize, noSetFMUStatePriorToCurrentPoint));
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    REQUIRE(STEPPING);
    return (fmi2Status)complain(container, ERROR, "%s: there is no step to cancel: steps are not asynchronous", container->name);
}

static fmi2Status no_status(Container *container, const char *function) {
    return (fmi2Status)complain(container, DISCARD, "%s: %s knows nothing of this kind", container->name, function);
}

#define STATUS_GETTER(Name, Type, known, answer) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind s, Type *value) { \
        REQUIRE(STEPPING | TERMINATED | FAILED); \
        if (!value) return (fmi2Status)complain(container, ERROR, "%s: %s: a pointer is null", container->name, __func__); \
        if (!(known)) return no_status(container, __func__); \
        *value = answer; \
        return fmi2OK; \
    }

STATUS_GETTER(Status, fmi2Status, s == fmi2DoStepStatus, (fmi2Status)container->step_status)
STATUS_GETTER(RealStatus, fmi2Real, s == fmi2LastSuccessfulTime, container->control.t)
STATUS_GETTER(BooleanStatus, fmi2Boolean, s == fmi2Terminated, container->terminated ? fmi2True : fmi2False)
STATUS_GETTER(StringStatus, fmi2String, s == fmi2PendingStatus, "")

/* No kind of status is an integer. */
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    REQUIRE(STEPPING | TERMINATED | FAILED);
    if (value) return no_status(container, __func__);
    return (fmi2Status)complain(container, ERROR, "%s: %s: a pointer is null", container->name, __func__);
}

/* Model exchange: there is none. */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    REQUIRE(ANY);
    return absent(container, __func__);
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    (void)eventInfo;
    REQUIRE(ANY);
    return absent(container, __func__);
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    REQUIRE(ANY);
    return absent(container, __func__);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint, fmi2Boolean *enterEventMode,
                                       fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    REQUIRE(ANY);
    return absent(container, __func__);
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    (void)time;
    REQUIRE(ANY);
    return absent(container, __func__);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    (void)x, (void)nx;
    REQUIRE(ANY);
    return absent(container, __func__);
}

#define ARRAY_GETTER(Name) \
    fmi2Status fmi2Get##Name(fmi2Component c, fmi2Real values[], size_t n) { \
        (void)values, (void)n; \
        REQUIRE(ANY); \
        return absent(container, __func__); \
    }

ARRAY_GETTER(Derivatives)
ARRAY_GETTER(EventIndicators)
ARRAY_GETTER(ContinuousStates)
ARRAY_GETTER(NominalsOfContinuousStates)
