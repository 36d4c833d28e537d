/* FMI 2.0, co-simulation and model exchange, over any component. */

#include "component.h"
#include "fmi2Functions.h"

#include <math.h>
#include <string.h>

#define READABLE (INITIALIZING | STEPPING | EVENT | CONTINUOUS | TERMINATED | FAILED)
#define WRITABLE (INSTANTIATED | INITIALIZING | STEPPING | EVENT | CONTINUOUS)
#define ANY (READABLE | WRITABLE)
#define REQUIRE(phases) \
    Instance *instance = (Instance *)c; \
    if (!allowed(instance, __func__, phases)) return fmi2Error

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return fmi2Version; }

static void log_fmi2(Instance *instance, Status status, const char *category, const char *text) {
    ((fmi2CallbackLogger)instance->callback)(instance->environment, instance->name, (fmi2Status)status, category, "%s", text);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[]) {
    REQUIRE(ANY);
    return (fmi2Status)set_logging(instance, loggingOn, nCategories, categories);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)fmuResourceLocation, (void)visible;
    Instance *instance = new_instance(instanceName ? instanceName : "", fmuType == fmi2ModelExchange);
    if (!instance) return 0;
    if (functions && functions->logger) {
        instance->callback = (void (*)(void))functions->logger;
        instance->environment = functions->componentEnvironment;
        instance->log = log_fmi2;
    }
    if (loggingOn) instance->log_mask = LOG_ALL;
    if (check_identity(instance, instanceName, fmuGUID, fmuType == fmi2ModelExchange || fmuType == fmi2CoSimulation)) return instance;
    free_instance(instance);
    return 0;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c) free_instance((Instance *)c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance;
    REQUIRE(INSTANTIATED);
    return (fmi2Status)set_start(instance, startTime, stopTimeDefined, stopTime);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    REQUIRE(INSTANTIATED);
    return (fmi2Status)enter_initialization(instance);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    REQUIRE(INITIALIZING);
    return (fmi2Status)exit_initialization(instance, instance->model_exchange ? EVENT : STEPPING);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    REQUIRE(STEPPING | EVENT | CONTINUOUS);
    terminate(instance);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    REQUIRE(ANY);
    reset_instance(instance);
    return fmi2OK;
}

static int is_known(fmi2ValueReference vr, int kinds) {
    return vr < (unsigned)component.scalars && kinds & 1 << component.scalar[vr].kind;
}

/* The variable of a value reference, if it is of one of these kinds; else null, and says so. */
static const Variable *find(Instance *instance, fmi2ValueReference vr, int kinds, const char *type) {
    if (vr >= (unsigned)component.scalars) {
        refuse(instance, ERROR, "%s: there is no variable with the value reference %u", component.name, (unsigned)vr);
        return 0;
    }
    const Variable *v = &component.variable[component.scalar[vr].variable];
    if (kinds & 1 << v->kind) return v;
    char label[128];
    put_label(label, sizeof label, v, component.scalar[vr].element);
    refuse(instance, ERROR, "%s: %s is not of type %s", component.name, label, type);
    return 0;
}

/* One value of an instance that is up to date needs none of the checks' calls: most reads are such. */
#define GETTER(Name, Type, kinds, Stored) \
    static OUT_OF_LINE fmi2Status get_##Name(const char *function, fmi2Component c, const fmi2ValueReference vr[], size_t nvr, \
                                             Type value[]) { \
        Instance *instance = (Instance *)c; \
        if (!allowed(instance, function, READABLE)) return fmi2Error; \
        if (!check_null(instance, vr, nvr, function) || !check_null(instance, value, nvr, function)) return fmi2Error; \
        if (refresh(instance)) return fmi2Error; \
        const unsigned char *values = instance->tried ? instance->scratch : instance->record; \
        for (size_t i = 0; i < nvr; i++) { \
            if (!is_known(vr[i], kinds)) return find(instance, vr[i], kinds, #Name), fmi2Error; \
            value[i] = *(const Stored *)(values + component.scalar[vr[i]].offset); \
        } \
        return fmi2OK; \
    } \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, Type value[]) { \
        const Instance *instance = (const Instance *)c; \
        int ready = instance && instance->phase & READABLE && !instance->stale && !instance->tried; \
        if (!(ready && nvr == 1 && vr && value && is_known(*vr, kinds))) return get_##Name(__func__, c, vr, nvr, value); \
        *value = *(const Stored *)(instance->record + component.scalar[*vr].offset); \
        return fmi2OK; \
    }

/* All values are checked before the first is set: a refused call changes nothing. Most calls set one input. */
#define SETTER(Name, Type, kinds, Stored, converted) \
    static OUT_OF_LINE Status check_##Name(const char *function, Instance *instance, const fmi2ValueReference vr[], size_t nvr, \
                                           const Type value[]) { \
        if (!check_null(instance, vr, nvr, function) || !check_null(instance, value, nvr, function)) return ERROR; \
        for (size_t i = 0; i < nvr; i++) { \
            const Variable *v = find(instance, vr[i], kinds, #Name); \
            if (!v || settable(instance, v, component.scalar[vr[i]].element, (double)value[i])) return ERROR; \
        } \
        return OK; \
    } \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const Type value[]) { \
        REQUIRE(WRITABLE); \
        int unchecked = nvr == 1 && vr && value && is_known(*vr, kinds) && component.scalar[*vr].unchecked; \
        if (!unchecked && check_##Name(__func__, instance, vr, nvr, value)) return fmi2Error; \
        instance->tried = 0; \
        for (size_t i = 0; i < nvr; i++) { \
            Stored *at = (Stored *)(instance->record + component.scalar[vr[i]].offset), given = converted; \
            note_set(instance, *at != given); \
            *at = given; \
        } \
        return fmi2OK; \
    }

GETTER(Real, fmi2Real, 1 << REAL, double)
GETTER(Integer, fmi2Integer, 1 << INTEGER | 1 << ENUMERATION, int)
GETTER(Boolean, fmi2Boolean, 1 << BOOLEAN, int)
SETTER(Real, fmi2Real, 1 << REAL, double, value[i])
SETTER(Integer, fmi2Integer, 1 << INTEGER | 1 << ENUMERATION, int, value[i])
SETTER(Boolean, fmi2Boolean, 1 << BOOLEAN, int, value[i] != 0)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)value;
    REQUIRE(READABLE);
    return !nvr || (check_null(instance, vr, nvr, __func__) && find(instance, vr[0], 0, "String")) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)value;
    REQUIRE(WRITABLE);
    return !nvr || (check_null(instance, vr, nvr, __func__) && find(instance, vr[0], 0, "String")) ? fmi2OK : fmi2Error;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    return (fmi2Status)save_state(instance, FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    REQUIRE(ANY);
    return (fmi2Status)restore_state(instance, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    free_state(FMUstate);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    (void)FMUstate;
    REQUIRE(ANY);
    if (!check_null(instance, size, 1, __func__)) return fmi2Error;
    *size = serialized_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    REQUIRE(ANY);
    return (fmi2Status)serialize_state(instance, FMUstate, serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate) {
    REQUIRE(ANY);
    return (fmi2Status)deserialize_state(instance, serializedState, size, FMUstate);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    REQUIRE(READABLE & ~FAILED);
    if (!check_null(instance, vUnknown_ref, nUnknown, __func__) || !check_null(instance, dvUnknown, nUnknown, __func__) ||
        !check_null(instance, vKnown_ref, nKnown, __func__) || !check_null(instance, dvKnown, nKnown, __func__))
        return fmi2Error;
    for (size_t first = 0; first < nUnknown; first += UNKNOWNS_AT_ONCE) {
        int unknown[UNKNOWNS_AT_ONCE], n = 0;
        for (; n < UNKNOWNS_AT_ONCE && first + (size_t)n < nUnknown; n++) {
            const Variable *v = find(instance, vUnknown_ref[first + (size_t)n], 1 << REAL, "Real");
            if (!v || !is_unknown(instance, v)) return fmi2Error;
            unknown[n] = component.scalar[vUnknown_ref[first + (size_t)n]].offset;
            dvUnknown[first + (size_t)n] = 0.0;
        }
        for (size_t i = 0; i < nKnown; i++) {
            const Variable *v = find(instance, vKnown_ref[i], 1 << REAL, "Real");
            int element = v ? component.scalar[vKnown_ref[i]].element : 0;
            if (!v || add_derivatives(instance, v, element, dvKnown[i], unknown, n, dvUnknown + first)) return fmi2Error;
        }
    }
    return fmi2OK;
}

/* Model exchange */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    REQUIRE(EXCHANGE_ONLY | CONTINUOUS);
    return (fmi2Status)enter_event_mode(instance);
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo) {
    REQUIRE(EXCHANGE_ONLY | EVENT);
    if (!check_null(instance, eventInfo, 1, __func__) || refresh(instance)) return fmi2Error;
    double due = next_solver_event(instance);
    eventInfo->newDiscreteStatesNeeded = eventInfo->terminateSimulation = fmi2False;
    eventInfo->nominalsOfContinuousStatesChanged = eventInfo->valuesOfContinuousStatesChanged = fmi2False;
    eventInfo->nextEventTimeDefined = due < NO_EVENT ? fmi2True : fmi2False;
    eventInfo->nextEventTime = due;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    REQUIRE(EXCHANGE_ONLY | EVENT);
    return (fmi2Status)enter_continuous_time(instance);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint, fmi2Boolean *enterEventMode,
                                       fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(EXCHANGE_ONLY | CONTINUOUS);
    if (!check_null(instance, enterEventMode, 1, __func__) || !check_null(instance, terminateSimulation, 1, __func__))
        return fmi2Error;
    *enterEventMode = samples_changed(instance);
    *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    REQUIRE(EXCHANGE_ONLY | EVENT | CONTINUOUS);
    return (fmi2Status)set_time(instance, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    REQUIRE(EXCHANGE_ONLY | CONTINUOUS);
    return (fmi2Status)set_states(instance, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi2Status)get_derivatives(instance, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    (void)eventIndicators;
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi2Status)no_indicators(instance, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi2Status)get_states(instance, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi2Status)get_nominals(instance, x_nominal, nx);
}

/* Co-simulation */

/* Set the time derivative of an input over the coming steps, or only tell whether it can be set. */
static Status set_slope(Instance *instance, const Variable *v, int element, int order, double value, int only_check) {
    if (v->slope < 0 || order != 1)
        return refuse(instance, ERROR, "%s: the derivative of %s of order %d is not taken%s", component.name, v->name, order,
                      v->slope < 0 ? ": it is held over a step" : ", only the first");
    if (!isfinite(value))
        return refuse(instance, ERROR, "%s: the derivative of %s must be a finite number", component.name, v->name);
    if (!only_check) *(double *)field(instance, &component.variable[v->slope], element) = value;
    return OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[]) {
    REQUIRE(STEPS_ONLY | WRITABLE);
    if (!check_null(instance, vr, nvr, __func__) || !check_null(instance, order, nvr, __func__) ||
        !check_null(instance, value, nvr, __func__))
        return fmi2Error;
    for (int only_check = 1; only_check >= 0; only_check--)
        for (size_t i = 0; i < nvr; i++) {
            const Variable *v = find(instance, vr[i], 1 << REAL, "Real");
            if (!v || set_slope(instance, v, component.scalar[vr[i]].element, order[i], value[i], only_check)) return fmi2Error;
        }
    return fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[]) {
    REQUIRE(STEPS_ONLY | READABLE);
    if (!check_null(instance, vr, nvr, __func__) || !check_null(instance, order, nvr, __func__) ||
        !check_null(instance, value, nvr, __func__) || refresh(instance))
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        const Variable *v = find(instance, vr[i], 1 << REAL, "Real");
        if (!v || derivative_of(instance, v, component.scalar[vr[i]].element, order[i], &value[i])) return fmi2Error;
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(STEPS_ONLY | STEPPING);
    if (check_step(instance, currentCommunicationPoint, communicationStepSize)) return fmi2Error;
    instance->step_status = advance(instance, currentCommunicationPoint, communicationStepSize, 0);
    if (!instance->step_status) instance->time = currentCommunicationPoint + communicationStepSize;
    return (fmi2Status)instance->step_status;
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    REQUIRE(STEPS_ONLY | STEPPING);
    return (fmi2Status)refuse(instance, ERROR, "%s: there is no step to cancel: steps are not asynchronous", component.name);
}

static fmi2Status no_status(Instance *instance, const char *function) {
    return (fmi2Status)refuse(instance, DISCARD, "%s: %s knows nothing of this kind", component.name, function);
}

#define STATUS_GETTER(Name, Type, known, answer) \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind s, Type *value) { \
        REQUIRE(STEPS_ONLY | STEPPING | TERMINATED | FAILED); \
        if (!check_null(instance, value, 1, __func__)) return fmi2Error; \
        if (!(known)) return no_status(instance, __func__); \
        *value = answer; \
        return fmi2OK; \
    }

STATUS_GETTER(Status, fmi2Status, s == fmi2DoStepStatus, (fmi2Status)instance->step_status)
STATUS_GETTER(RealStatus, fmi2Real, s == fmi2LastSuccessfulTime, instance->time)
STATUS_GETTER(BooleanStatus, fmi2Boolean, s == fmi2Terminated, fmi2False)
STATUS_GETTER(StringStatus, fmi2String, s == fmi2PendingStatus, "")

/* No kind of status is an integer. */
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    REQUIRE(STEPS_ONLY | STEPPING | TERMINATED | FAILED);
    return check_null(instance, value, 1, __func__) ? no_status(instance, __func__) : fmi2Error;
}
