/* What the operations of a program do. */

#include "execution.h"

#include "parts.h"
#include "solver.h"
#include "transfers.h"

/* The length of an instance's step: it does not go beyond the stop time by rounding, which 20-sim's FMUs refuse; but those that
   take steps of one length alone may compare them. */
static inline double length_for(const Instance *instance, const Control *control, double t, double h) {
    return t + h <= control->stop || instance->rigid ? h : control->stop - t;
}

static int step1(const System *system, Control *control, int number, double t, double h) {
    const Instance *const instance = &system->instances.at[number];
    const int status = ((Fmi1DoStep *)instance->do_step)(instance->handle, t, length_for(instance, control, t, h), 1);
    keep_arithmetic();
    return judge(control, status, -1 - number, CALLED_DoStep, t);
}

static inline int step2(const System *system, Control *control, int number, double t, double h) {
    const Instance *const instance = &system->instances.at[number];
    const double length = length_for(instance, control, t, h);
    const int status = ((Fmi2DoStep *)instance->do_step)(instance->handle, t, length, !control->returning);
    keep_arithmetic();
    return judge(control, status, -1 - number, CALLED_DoStep, t);
}

/* `stepped`: how many instances have taken this step before. */
static int step3(const System *system, Control *control, int number, double t, double h, int stepped) {
    const Instance *const instance = &system->instances.at[number];
    Answers answers = {{0}, {0}};
    Fmi3Boolean *const event_needed = &answers.flag[0], *const terminate = &answers.flag[1], *const early_return = &answers.flag[2];
    const double length = length_for(instance, control, t, h);
    double reached = t + h;
    const int status = ((Fmi3DoStep *)instance->do_step)(instance->handle, t, length, !control->returning, event_needed,
                                                         terminate, early_return, &reached);
    keep_arithmetic();
    if (!judge(control, status, -1 - number, CALLED_DoStep, t)) return 0;
    if (*terminate) return fail(control, FAULT_TERMINATED, 0, -1 - number, CALLED_DoStep, reached);
    if (instance->event_mode && *event_needed) control->at_event = 1;
    if (*early_return && reached < t + h - time_rounding(t, h)) {
        if (!control->cut || stepped > 0 || !(reached > t + time_rounding(t, h)))
            return fail(control, FAULT_EARLY_RETURN, 0, -1 - number, CALLED_DoStep, reached);
        control->target = reached;
        control->at_grid = 0;
        control->at_event = SHORTENED;
    }
    return 1;
}

/* Values of the tables at t, from the right where they jump; rows count as reached in spite of rounding. */
static void look_up_tables(const System *system, double t) {
    const double *const times = system->table_times.at, *const values = system->table_values.at;
    for (size_t i = 0; i < system->tables.count; i++) {
        Table *const table = &system->tables.at[i];
        const int last = table->first + table->count - 1;
        while (table->cursor < last && times[table->cursor + 1] <= t + time_rounding(t, 0.0)) table->cursor++;
        const int k = table->cursor;
        double value = values[k];
        if (table->linear && k < last && t > times[k]) {
            const double part = (t - times[k]) / (times[k + 1] - times[k]);
            value += (part < 1.0 ? part : 1.0) * (values[k + 1] - value);
        }
        system->bus.at[table->place] = value;
    }
}

/* Keep the values of the sources of linear inputs at the beginning of a step, and at that of the step before. */
static void hold(const System *system, double t) {
    double *const bus = system->bus.at;
    for (size_t i = 0; i < system->slopes.count; i++) {
        Slope *const slope = &system->slopes.at[i];
        slope->previous = bus[slope->held];
        slope->previous_time = slope->held_time;
        bus[slope->held] = bus[slope->source];
        slope->held_time = t;
    }
}

/* The slope of an input over [t, t + h]: that of the line to its source's value at t + h where this is known already and
   continuous there; else the slope over the step before, unless an event was in between; else none. */
static double slope_of(const Slope *slope, const double *bus, const Control *control, double t, double h) {
    if (slope->known && h > 0.0 && !control->ends_at_event) return (bus[slope->source] - bus[slope->held]) / h;
    if (slope->previous_time >= control->smooth_from && t > slope->previous_time)
        return (bus[slope->held] - slope->previous) / (t - slope->previous_time);
    return 0.0;
}

static int set_slopes(const System *system, Control *control, int number, double t, double h) {
    const SlopeCall *const call = &system->slopes_of.at[number];
    for (int i = 0; i < call->count; i++) {
        const Slope *const slope = &system->slopes.at[call->first + i];
        call->values[i] = slope->gain * slope_of(slope, system->bus.at, control, t, h);
    }
    if (!call->function) return note_inputs(system, control, number, t);
    Fmi2SetRealInputDerivatives *const function = (Fmi2SetRealInputDerivatives *)call->function;
    const int status = function(call->handle, call->references, (size_t)call->count, call->orders, call->values);
    keep_arithmetic();
    return judge(control, status, -1 - call->instance, CALLED_SetRealInputDerivatives, t);
}

/* Whether one of a guard's clocks ticks; has begun to, where its operations are done once. */
static int ticks(const System *system, const ClockGuard *guard) {
    for (int i = guard->first; i < guard->first + guard->count; i++) {
        const int active = system->clocks.at[system->clock_numbers.at[i]].active;
        if (active == 1 || (active && !guard->once)) return 1;
    }
    return 0;
}

int execute(const System *system, Control *control, Operations program, double t, double h) {
    int stepped = 0;
    for (size_t i = 0; i < program.count; i++) {
        const int number = program.at[i].number;
        int going = 1;
        switch (program.at[i].code) {
        case OP_SET2: going = set_reals(system, control, number, control->exchange ? t + h : t); break;
        case OP_GET2: going = get_reals(system, control, number, t + h); break;
        case OP_STEP2:
            going = step2(system, control, number, t, h);
            stepped++;
            break;
        case OP_STEP1:
            going = step1(system, control, number, t, h);
            stepped++;
            break;
        case OP_SET: going = set_values(system, control, number, control->exchange ? t + h : t); break;
        case OP_GET: going = get_values(system, control, number, t + h); break;
        case OP_STEP3:
            going = step3(system, control, number, t, h, stepped);
            stepped++;
            if (control->at_event == SHORTENED) {
                control->at_event = 1;
                h = control->target - t;
            }
            break;
        case OP_SOLVE:
            going = solve(system, control, t, h, control->cut && stepped == 0);
            stepped++;
            if (control->at_event == SHORTENED) {
                control->at_event = 1;
                h = control->target - t;
            }
            break;
        case OP_TABLES_BEFORE: look_up_tables(system, t); break;
        case OP_TABLES_NOW: look_up_tables(system, t + h); break;
        case OP_HOLD: hold(system, t); break;
        case OP_SLOPES: going = set_slopes(system, control, number, t, h); break;
        case OP_GUARDED:
            if (!control->all_open && !system->guards.at[number].open) i += (size_t)system->guards.at[number].skip;
            break;
        case OP_KEEP: keep_values(&system->transfers.at[number]); break;
        case OP_AGAIN: going = !control->resuming || call_again(system, control, number, t); break;
        case OP_CLOCKED:
            if (!ticks(system, &system->clock_guards.at[number])) i += (size_t)system->clock_guards.at[number].skip;
            break;
        default: break;
        }
        if (!going) return 0;
    }
    return 1;
}
