/* Calls of the functions for model exchange. */

#include "parts.h"

#include "algebraic.h"
#include "execution.h"
#include "transfers.h"

#include <string.h>

static int number_of(const Part *part) { return -1 - part->instance; }

int refuse(Control *control, int fault, int status, int where, int element) {
    control->refused = fault;
    control->refused_status = status;
    control->refused_where = where;
    control->refused_element = element;
    return REFUSED;
}

/* How the evaluation goes on after a call: where it was discarded, another state may do. */
static int judged(Control *control, const Part *part, int status, int called, double t) {
    if (status == 2) return refuse(control, FAULT_CALL_FAILED, status, number_of(part), called);
    return judge(control, status, number_of(part), called, t) ? EVALUATED : BROKEN;
}

/* The first value that is not finite makes the evaluation refused. */
static int all_finite(Control *control, const Part *part, const double *values, int count, int called) {
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i])) return refuse(control, FAULT_NOT_A_NUMBER, i, number_of(part), called);
    return EVALUATED;
}

static int set_time(Control *control, const Part *part, double t) {
    const int status = ((FmiSetTime *)part->set_time)(part->handle, t);
    keep_arithmetic();
    return judged(control, part, status, CALLED_SetTime, t);
}

/* The first call of a function, to memory with room behind its values: whether it writes there, since the description tells of
   fewer than there are. */
static int get_first(const System *system, Control *control, Part *part, Function function, int called, double t, double *values,
                     int count) {
    const Solver *const solver = &system->solvers.at[0];
    double mark, *const spare = solver->spare;
    memset(&mark, 0xff, sizeof mark); /* no number */
    for (size_t i = 0; i < solver->spare_count; i++) spare[i] = mark;
    if (called == CALLED_GetNominals) memcpy(spare, values, (size_t)count * sizeof *values); /* some leave them out */
    const int status = ((FmiGetArray *)function)(part->handle, spare, (size_t)count);
    keep_arithmetic();
    memcpy(values, spare, (size_t)count * sizeof *values);
    for (size_t i = (size_t)count; i < solver->spare_count; i++) {
        if (memcmp(&spare[i], &mark, sizeof mark) == 0) continue;
        fail(control, FAULT_OTHER_COUNT, count, number_of(part), called, t);
        return BROKEN;
    }
    part->checked |= 1u << called;
    return judged(control, part, status, called, t);
}

static int get_array(const System *system, Control *control, Part *part, Function function, int called, double t, double *values,
                     int count) {
    if (!count) return EVALUATED;
    int judgement;
    if (part->checked & 1u << called) {
        const int status = ((FmiGetArray *)function)(part->handle, values, (size_t)count);
        keep_arithmetic();
        judgement = judged(control, part, status, called, t);
    } else {
        judgement = get_first(system, control, part, function, called, t, values, count);
    }
    return judgement ? judgement : all_finite(control, part, values, count, called);
}

static int set_states(Control *control, const Part *part, double t, const double *state) {
    if (!part->states) return EVALUATED;
    const int status = ((FmiSetArray *)part->set_states)(part->handle, state + part->first, (size_t)part->states);
    keep_arithmetic();
    return judged(control, part, status, CALLED_SetContinuousStates, t);
}

static int transfer_inputs(const SlopeCall *call, Function function, double *values) {
    const size_t count = (size_t)call->count;
    const int status = call->version == 3
                           ? ((Fmi3Transfer *)function)(call->handle, call->references, count, values, count)
                           : ((Fmi2Transfer *)function)(call->handle, call->references, count, values);
    keep_arithmetic();
    return status;
}

int note_inputs(const System *system, Control *control, int number, double t) {
    SlopeCall *const call = &system->slopes_of.at[number];
    call->from = t;
    return judge(control, transfer_inputs(call, call->get, call->base), -1 - call->instance, CALLED_GetInputs, t);
}

/* Bring linear inputs to where they are at t. */
static int move_inputs(const System *system, Control *control, double t) {
    for (size_t k = 0; k < system->slopes_of.count; k++) {
        const SlopeCall *const call = &system->slopes_of.at[k];
        if (call->function || !(t >= call->from)) continue;
        for (int i = 0; i < call->count; i++) call->moved[i] = call->base[i] + call->values[i] * (t - call->from);
        const int status = transfer_inputs(call, call->set, call->moved);
        if (status == 2) return refuse(control, FAULT_CALL_FAILED, status, -1 - call->instance, CALLED_SetInputs);
        if (!judge(control, status, -1 - call->instance, CALLED_SetInputs, t)) return BROKEN;
    }
    return EVALUATED;
}

int place_parts(const System *system, Control *control, double t, const double *state) {
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        part->placed = 1;
        int judgement = set_time(control, part, t);
        if (!judgement) judgement = set_states(control, part, t, state);
        if (judgement) return judgement;
    }
    const int moved = move_inputs(system, control, t);
    if (moved || !system->coupled_program.count) return moved;
    return exchange_in_loops(system, control, system->coupled_program, t);
}

int open_after_event(const System *system, Control *control, double t, int initializing) {
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        if (part->version > 1 || (initializing && system->instances.at[part->instance].informed)) continue;
        part->placed = 1;
        if (set_time(control, part, t))
            return control->fault ? 0 : fail(control, FAULT_CALL_FAILED, 2, number_of(part), CALLED_SetTime, t);
    }
    return 1;
}

int get_derivatives(const System *system, Control *control, double t, double *rates) {
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        const int judgement =
            get_array(system, control, part, part->get_derivatives, CALLED_GetDerivatives, t, rates + part->first, part->states);
        if (judgement) return judgement;
    }
    return EVALUATED;
}

int get_indicators(const System *system, Control *control, double t, double *indicators) {
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        const int judgement = get_array(system, control, part, part->get_indicators, CALLED_GetEventIndicators, t,
                                        indicators + part->first_indicator, part->indicators);
        if (judgement) return judgement;
    }
    return EVALUATED;
}

static int derive(const Part *part, uint32_t known, double *rates) {
    const double seed = 1.0;
    const size_t count = (size_t)part->states;
    const int status =
        part->version == 3
            ? ((Fmi3Directional *)part->directional)(part->handle, part->rates, count, &known, 1, &seed, 1, rates, count)
            : ((Fmi2Directional *)part->directional)(part->handle, part->rates, count, &known, 1, &seed, rates);
    keep_arithmetic();
    return status;
}

int get_jacobian(const System *system, Control *control, double t, double **columns) {
    for (size_t i = 0; i < system->parts.count; i++) {
        const Part *const part = &system->parts.at[i];
        for (int k = 0; k < part->states; k++) {
            double *const rates = columns[part->first + k] + part->first;
            int judgement = judged(control, part, derive(part, part->references[k], rates), CALLED_GetDirectionalDerivative, t);
            if (!judgement) judgement = all_finite(control, part, rates, part->states, CALLED_GetDirectionalDerivative);
            if (judgement) return judgement;
        }
    }
    return EVALUATED;
}

int get_states(const System *system, Control *control, double t, double *state, double *nominals) {
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        double *const own = state + part->first, *const nominal = nominals + part->first;
        int judgement = get_array(system, control, part, part->get_states, CALLED_GetContinuousStates, t, own, part->states);
        if (judgement) return judgement;
        for (int k = 0; k < part->states; k++) nominal[k] = 1.0;
        if (part->get_nominals)
            judgement = get_array(system, control, part, part->get_nominals, CALLED_GetNominals, t, nominal, part->states);
        if (judgement) return judgement;
        for (int k = 0; k < part->states; k++) nominal[k] = nominal[k] != 0.0 ? fabs(nominal[k]) : 1.0;
    }
    return EVALUATED;
}

static int tell_completed(Control *control, const Part *part, double t, int *event) {
    if (!part->completed) return EVALUATED;
    Answers answers = {{0}, {0}};
    int32_t wants[2] = {0, 0};
    int status;
    if (part->version == 3)
        status = ((Fmi3Completed *)part->completed)(part->handle, !control->returning, &answers.flag[0], &answers.flag[1]);
    else if (part->version == 2)
        status = ((Fmi2Completed *)part->completed)(part->handle, !control->returning, &wants[0], &wants[1]);
    else
        status = ((Fmi1Completed *)part->completed)(part->handle, (char *)&answers.flag[0]);
    keep_arithmetic();
    const int judgement = judged(control, part, status, CALLED_CompletedIntegratorStep, t);
    if (judgement) return judgement;
    if (answers.flag[1] || wants[1]) {
        fail(control, FAULT_TERMINATED, 0, number_of(part), CALLED_CompletedIntegratorStep, t);
        return BROKEN;
    }
    if (answers.flag[0] || wants[0]) *event = 1;
    return EVALUATED;
}

int complete_step(const System *system, Control *control, double t, int *event) {
    for (size_t i = 0; i < system->parts.count; i++) {
        system->parts.at[i].placed = 0;
        const int judgement = tell_completed(control, &system->parts.at[i], t, event);
        if (judgement) return judgement;
    }
    return EVALUATED;
}

int complete_before_event(const System *system, Control *control, int instance, double t) {
    int event = 0;
    for (size_t i = 0; i < system->parts.count; i++) {
        Part *const part = &system->parts.at[i];
        if (part->instance != instance || !part->placed) continue;
        part->placed = 0;
        if (tell_completed(control, part, t, &event))
            return control->fault ? 0 : fail(control, FAULT_CALL_FAILED, 2, number_of(part), CALLED_CompletedIntegratorStep, t);
    }
    return 1;
}

/* An FMU that does not tell its inputs counts as one whose inputs have changed. */
int inputs_have_changed(const System *system, Control *control, double t, int *changed) {
    for (size_t i = 0; i < system->input_queries.count; i++) {
        InputQuery *const query = &system->input_queries.at[i];
        const Transfer *const transfer = &system->transfers.at[query->transfer];
        const int status = query->refused ? 0 : ask_leniently(system, query->transfer);
        if (status > 3 && !judge(control, status, query->transfer, -1, t)) return 0;
        if (status > 1) query->refused = 1;
        if (query->refused) *changed = 1;
        if (query->refused || memcmp(query->known, transfer->values, query->bytes) == 0) continue;
        memcpy(query->known, transfer->values, query->bytes);
        *changed = 1;
    }
    return 1;
}
