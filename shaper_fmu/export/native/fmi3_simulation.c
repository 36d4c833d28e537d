/* FMI 3.0 over any component: co-simulation with event mode and early return, and model exchange. */

#include "fmi3.h"

#include <math.h>

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    REQUIRE(STEPPING | CONTINUOUS);
    if (self->phase == STEPPING && !self->event_mode)
        return (fmi3Status)refuse(self, ERROR, "%s: event mode was not asked for at the instantiation", component.name);
    return (fmi3Status)enter_event_mode(self);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(STEPS_ONLY | EVENT);
    if (refresh(self)) return fmi3Error;
    self->phase = STEPPING;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    REQUIRE(EVENT);
    fmi3Boolean *never[] = {discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                            valuesOfContinuousStatesChanged};
    for (int i = 0; i < 4; i++)
        if (!check_null(self, never[i], 1, __func__)) return fmi3Error;
    if (!check_null(self, nextEventTimeDefined, 1, __func__) || !check_null(self, nextEventTime, 1, __func__) || refresh(self))
        return fmi3Error;
    for (int i = 0; i < 4; i++) *never[i] = fmi3False;
    *nextEventTime = next_solver_event(self);
    *nextEventTimeDefined = *nextEventTime < NO_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    REQUIRE(INITIALIZING | EVENT);
    return (fmi3Status)refresh(self);
}

/* Co-simulation */

/* Let the importer look at an event within the step; returns the time at which it wants to return, or the step's end. */
static double intermediate_update(Instance *self, double t, double end) {
    fmi3Boolean requested = fmi3False;
    fmi3Float64 wanted = end;
    self->phase = INTERMEDIATE;
    ((fmi3IntermediateUpdateCallback)self->second_callback)(self->environment, t, fmi3False, fmi3True, fmi3True, self->early_return != 0,
                                                            &requested, &wanted);
    if (self->phase == INTERMEDIATE) self->phase = STEPPING;
    if (!requested || !self->early_return || !(wanted < end)) return end;
    return wanted > t ? wanted : t;
}

static Status advance_to(Instance *self, double target, int left_limits) {
    if (advance(self, self->time, target - self->time, left_limits)) return ERROR;
    self->time = target;
    return OK;
}

/* Step to `end`, or stop before it at an event or where the importer wants to; *event tells whether one waits there. */
static Status step_towards(Instance *self, double end, int *event) {
    if (!(self->time < end)) return advance(self, self->time, 0.0, 0);
    while (self->time < end) {
        if (refresh(self)) return ERROR; /* inputs that were set may bring an event about */
        double due = next_event(self), tolerance = 1e-9 * (end - self->time) + 64.0 * 2.220446049250313e-16 * fabs(self->time);
        int at_end = fabs(due - end) <= tolerance, before = due < end - tolerance && due > self->time;
        if (self->event_mode && (at_end || (before && self->early_return))) {
            if (advance_to(self, at_end ? end : due, 1)) return ERROR;
            self->event_time = due;
            *event = 1;
            return OK;
        }
        if (!before || !self->second_callback) return advance_to(self, end, 0);
        if (advance_to(self, due, 0)) return ERROR;
        end = intermediate_update(self, due, end);
    }
    return OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(STEPS_ONLY | STEPPING);
    if (!check_null(self, eventHandlingNeeded, 1, __func__) || !check_null(self, terminateSimulation, 1, __func__) ||
        !check_null(self, earlyReturn, 1, __func__) || !check_null(self, lastSuccessfulTime, 1, __func__) ||
        check_step(self, currentCommunicationPoint, communicationStepSize))
        return fmi3Error;
    double end = currentCommunicationPoint + communicationStepSize;
    int event = 0;
    Status status;
    if (self->event_mode || self->second_callback) {
        self->time = currentCommunicationPoint;
        status = step_towards(self, end, &event);
    } else {
        status = advance(self, currentCommunicationPoint, communicationStepSize, 0);
        if (!status) self->time = end;
    }
    *eventHandlingNeeded = event;
    *terminateSimulation = fmi3False;
    *earlyReturn = !status && self->time < end;
    *lastSuccessfulTime = self->time;
    return (fmi3Status)status;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues) {
    REQUIRE(STEPS_ONLY | READABLE);
    if (!check_null(self, valueReferences, nValueReferences, __func__) || !check_null(self, orders, nValueReferences, __func__) ||
        !check_null(self, values, nValues, __func__) || refresh(self))
        return fmi3Error;
    size_t k = 0;
    for (size_t i = 0; i < nValueReferences; i++) {
        const Variable *v = find_variable(self, valueReferences[i], 1 << REAL, "Float64");
        if (!v) return fmi3Error;
        int elements = length(v);
        if (k + (size_t)elements > nValues)
            return (fmi3Status)refuse(self, ERROR, "%s: there is no room for the derivatives of %s: %d values", component.name, v->name,
                                      (int)nValues);
        for (int j = 0; j < elements; j++)
            if (derivative_of(self, v, j, orders[i], &values[k++])) return fmi3Error;
    }
    if (k != nValues)
        return (fmi3Status)refuse(self, ERROR, "%s: there are %d derivatives, but %d values", component.name, (int)k, (int)nValues);
    return fmi3OK;
}

/* Model exchange */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    REQUIRE(EXCHANGE_ONLY | EVENT);
    return (fmi3Status)enter_continuous_time(self);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(EXCHANGE_ONLY | CONTINUOUS);
    if (!check_null(self, enterEventMode, 1, __func__) || !check_null(self, terminateSimulation, 1, __func__)) return fmi3Error;
    *enterEventMode = samples_changed(self) != 0;
    *terminateSimulation = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    REQUIRE(EXCHANGE_ONLY | EVENT | CONTINUOUS);
    return (fmi3Status)set_time(self, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates) {
    REQUIRE(EXCHANGE_ONLY | CONTINUOUS);
    return (fmi3Status)set_states(self, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi3Status)get_derivatives(self, derivatives, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    (void)eventIndicators;
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi3Status)no_indicators(self, nEventIndicators);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi3Status)get_states(self, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates) {
    REQUIRE(EXCHANGE_ONLY | READABLE);
    return (fmi3Status)get_nominals(self, nominals, nContinuousStates);
}

static fmi3Status put_number(Instance *self, size_t *place, int number, const char *function) {
    if (!check_null(self, place, 1, function)) return fmi3Error;
    *place = (size_t)number;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    REQUIRE(EXCHANGE_ONLY | BETWEEN_CALLS);
    return put_number(self, nEventIndicators, 0, __func__);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    REQUIRE(EXCHANGE_ONLY | BETWEEN_CALLS);
    return put_number(self, nContinuousStates, component.states, __func__);
}
