/* FMI 3.0 over any component: life, values and states of an instance. */

#include "fmi3.h"

#include <string.h>

const char *fmi3GetVersion(void) { return fmi3Version; }

static void log_fmi3(Instance *self, Status status, const char *category, const char *text) {
    ((fmi3LogMessageCallback)self->callback)(self->environment, (fmi3Status)status, category, text);
}

static Instance *instantiate(fmi3String name, fmi3String token, int model_exchange, fmi3Boolean loggingOn,
                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage, int known_type) {
    Instance *self = new_instance(name ? name : "", model_exchange);
    if (!self) return 0;
    if (logMessage) {
        self->callback = (void (*)(void))logMessage;
        self->environment = environment;
        self->log = log_fmi3;
    }
    if (loggingOn) self->log_mask = LOG_ALL;
    if (check_identity(self, name, token, known_type)) return self;
    free_instance(self);
    return 0;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)resourcePath, (void)visible;
    return instantiate(instanceName, instantiationToken, 1, loggingOn, instanceEnvironment, logMessage, 1);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)resourcePath, (void)visible;
    Instance *self = instantiate(instanceName, instantiationToken, 0, loggingOn, instanceEnvironment, logMessage, 1);
    if (!self) return 0;
    self->event_mode = eventModeUsed;
    self->early_return = earlyReturnAllowed;
    self->second_callback = (void (*)(void))intermediateUpdate;
    int known = check_null(self, requiredIntermediateVariables, nRequiredIntermediateVariables, __func__);
    for (size_t i = 0; known && i < nRequiredIntermediateVariables; i++)
        known = requiredIntermediateVariables[i] == (unsigned)component.visible ||
                find_variable(self, requiredIntermediateVariables[i], ~0, "any kind");
    if (known) return self;
    free_instance(self);
    return 0;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                               fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                               fmi3ClockUpdateCallback clockUpdate, fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)resourcePath, (void)visible, (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return instantiate(instanceName, instantiationToken, 0, loggingOn, instanceEnvironment, logMessage, 0);
}

/* Not inside an intermediate update: the step that asked for it goes on. */
void fmi3FreeInstance(fmi3Instance instance) {
    if (allowed((Instance *)instance, __func__, BETWEEN_CALLS)) free_instance((Instance *)instance);
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[]) {
    REQUIRE(BETWEEN_CALLS);
    return (fmi3Status)set_logging(self, loggingOn, nCategories, categories);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance;
    REQUIRE(INSTANTIATED);
    if (set_start(self, startTime, stopTimeDefined, stopTime)) return fmi3Error;
    return (fmi3Status)enter_initialization(self);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(INITIALIZING);
    return (fmi3Status)exit_initialization(self, self->model_exchange || self->event_mode ? EVENT : STEPPING);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    REQUIRE(STEPPING | EVENT | CONTINUOUS);
    terminate(self);
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    REQUIRE(BETWEEN_CALLS);
    reset_instance(self);
    return fmi3OK;
}

/* The variable of a value reference, if it is of one of these kinds; else null, and says so. */
const Variable *find_variable(Instance *self, fmi3ValueReference vr, int kinds, const char *type) {
    if (!vr || vr >= (unsigned)component.visible) {
        refuse(self, ERROR, "%s: there is no variable of type %s with the value reference %u", component.name, type, (unsigned)vr);
        return 0;
    }
    const Variable *v = &component.variable[component.visible_variable[vr]];
    if (kinds & 1 << v->kind) return v;
    refuse(self, ERROR, "%s: %s is not of type %s", component.name, v->name, type);
    return 0;
}

/* Whether the values fill the variables exactly; if not, says so. The time can be read, but not set. */
static Status count(Instance *self, const fmi3ValueReference vr[], size_t n, int kinds, const char *type, size_t values,
                    int with_time) {
    size_t needed = 0;
    for (size_t i = 0; i < n; i++) {
        if (with_time && kinds == 1 << REAL && vr[i] == (unsigned)component.visible)
            needed++; /* the time */
        else {
            const Variable *v = find_variable(self, vr[i], kinds, type);
            if (!v) return ERROR;
            needed += (size_t)length(v);
        }
    }
    if (needed == values) return OK;
    return refuse(self, ERROR, "%s: the variables have %d elements of type %s, but there are %d values", component.name, (int)needed,
                  type, (int)values);
}

#define GETTER(Name, kinds, Stored) \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             fmi3##Name values[], size_t nValues) { \
        REQUIRE(READABLE); \
        if (!check_null(self, valueReferences, nValueReferences, __func__) || !check_null(self, values, nValues, __func__)) \
            return fmi3Error; \
        if (count(self, valueReferences, nValueReferences, kinds, #Name, nValues, 1) || refresh(self)) return fmi3Error; \
        for (size_t i = 0, k = 0; i < nValueReferences; i++) { \
            if (valueReferences[i] == (unsigned)component.visible) { \
                values[k++] = (fmi3##Name)self->time; \
                continue; \
            } \
            const Variable *v = &component.variable[component.visible_variable[valueReferences[i]]]; \
            const Stored *first = (const Stored *)field(self, v, 0); \
            for (int j = 0; j < length(v); j++) values[k++] = (fmi3##Name)first[j]; \
        } \
        return fmi3OK; \
    }

/* All values are checked before the first is set: a refused call changes nothing. */
#define SETTER(Name, kinds, Stored) \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             const fmi3##Name values[], size_t nValues) { \
        REQUIRE(WRITABLE); \
        if (!check_null(self, valueReferences, nValueReferences, __func__) || !check_null(self, values, nValues, __func__)) \
            return fmi3Error; \
        if (count(self, valueReferences, nValueReferences, kinds, #Name, nValues, 0)) return fmi3Error; \
        for (size_t i = 0, k = 0; i < nValueReferences; i++) { \
            const Variable *v = &component.variable[component.visible_variable[valueReferences[i]]]; \
            for (int j = 0; j < length(v); j++) \
                if (settable(self, v, j, (double)values[k++])) return fmi3Error; \
        } \
        self->tried = 0; \
        for (size_t i = 0, k = 0; i < nValueReferences; i++) { \
            const Variable *v = &component.variable[component.visible_variable[valueReferences[i]]]; \
            Stored *first = (Stored *)field(self, v, 0); \
            for (int j = 0; j < length(v); j++) { \
                Stored given = (Stored)values[k++]; \
                note_set(self, first[j] != given); \
                first[j] = given; \
            } \
        } \
        return fmi3OK; \
    }

GETTER(Float64, 1 << REAL, double)
GETTER(Int32, 1 << INTEGER, int)
GETTER(Int64, 1 << ENUMERATION, int)
GETTER(Boolean, 1 << BOOLEAN, int)
SETTER(Float64, 1 << REAL, double)
SETTER(Int32, 1 << INTEGER, int)
SETTER(Int64, 1 << ENUMERATION, int)
SETTER(Boolean, 1 << BOOLEAN, int)

/* The derivatives of at most UNKNOWNS_AT_ONCE unknowns along all knowns. */
static Status derivatives_along(Instance *self, const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                const int *unknown, int n, fmi3Float64 sensitivity[]) {
    size_t k = 0;
    for (int i = 0; i < n; i++) sensitivity[i] = 0.0;
    for (size_t i = 0; i < nKnowns; i++) {
        int is_time = knowns[i] == (unsigned)component.visible;
        const Variable *v = is_time ? 0 : &component.variable[component.visible_variable[knowns[i]]];
        for (int j = 0; j < (is_time ? 1 : length(v)); j++)
            if (add_derivatives(self, v, j, seed[k++], unknown, n, sensitivity)) return ERROR;
    }
    return OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                        fmi3Float64 sensitivity[], size_t nSensitivity) {
    REQUIRE(READABLE & ~FAILED);
    if (!check_null(self, unknowns, nUnknowns, __func__) || !check_null(self, knowns, nKnowns, __func__) ||
        !check_null(self, seed, nSeed, __func__) || !check_null(self, sensitivity, nSensitivity, __func__) ||
        count(self, unknowns, nUnknowns, 1 << REAL, "Float64", nSensitivity, 0) ||
        count(self, knowns, nKnowns, 1 << REAL, "Float64", nSeed, 1))
        return fmi3Error;
    int unknown[UNKNOWNS_AT_ONCE], n = 0;
    for (size_t i = 0, done = 0; i < nUnknowns; i++) {
        const Variable *v = &component.variable[component.visible_variable[unknowns[i]]];
        if (!is_unknown(self, v)) return fmi3Error;
        for (int j = 0; j < length(v); j++) {
            unknown[n++] = v->offset + 8 * j;
            if (n < UNKNOWNS_AT_ONCE && done + (size_t)n < nSensitivity) continue;
            if (derivatives_along(self, knowns, nKnowns, seed, unknown, n, sensitivity + done)) return fmi3Error;
            done += (size_t)n;
            n = 0;
        }
    }
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(BETWEEN_CALLS);
    return (fmi3Status)save_state(self, FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    REQUIRE(BETWEEN_CALLS);
    return (fmi3Status)restore_state(self, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(BETWEEN_CALLS);
    free_state(FMUState);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    (void)FMUState;
    REQUIRE(BETWEEN_CALLS);
    if (!check_null(self, size, 1, __func__)) return fmi3Error;
    *size = serialized_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size) {
    REQUIRE(BETWEEN_CALLS);
    return (fmi3Status)serialize_state(self, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState) {
    REQUIRE(BETWEEN_CALLS);
    return (fmi3Status)deserialize_state(self, serializedState, size, FMUState);
}
