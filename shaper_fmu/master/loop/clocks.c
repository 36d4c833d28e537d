/* The next tick of an instance's clocks is part of its `next_event`, so that steps end there. Of the super-dense instants of an
   event the timed clocks get one of their own, after all else has settled: they sample values from the right of jumps. */

#include "clocks.h"

#include "arithmetic.h"
#include "execution.h"
#include "faults.h"
#include "fmi.h"

#define MOST_TICKS 50 /* of one clock at one time */

enum { UNKNOWN, UNCHANGED, CHANGED }; /* fmi3IntervalQualifier */

static int is_timed(const Clock *clock) {
    return clock->kind == CLOCK_PERIODIC || clock->kind == CLOCK_CHANGING || clock->kind == CLOCK_COUNTDOWN;
}

/* When a periodic clock ticks next; by multiplication, so that no rounding adds up. */
static double tick_time(const Clock *clock) {
    return clock->origin + (clock->shift + (double)clock->count * clock->interval) / clock->resolution;
}

/* Ask for an interval [s / resolution], and what the FMU says of it. */
static int call_for_interval(const Instance *instance, Control *control, const Clock *clock, double t, double *interval,
                             double *resolution, int *qualifier) {
    const int where = -1 - clock->instance;
    if (clock->fraction) {
        Fmi3GetIntervalFraction *const function = (Fmi3GetIntervalFraction *)clock->get_interval;
        uint64_t counter = 0, ticks = 0;
        const int status = function(instance->handle, clock->reference, 1, &counter, &ticks, qualifier);
        keep_arithmetic();
        *interval = (double)counter;
        *resolution = (double)ticks;
        return judge(control, status, where, CALLED_GetIntervalFraction, t);
    }
    Fmi3GetIntervalDecimal *const function = (Fmi3GetIntervalDecimal *)clock->get_interval;
    const int status = function(instance->handle, clock->reference, 1, interval, qualifier);
    keep_arithmetic();
    *resolution = 1.0;
    return judge(control, status, where, CALLED_GetIntervalDecimal, t);
}

/* The same, for the clock; returns UNKNOWN, UNCHANGED, CHANGED, or FAILED. */
static int ask_interval(const System *system, Control *control, Clock *clock, int number, double t) {
    const int where = -1 - clock->instance;
    double interval = 0.0, resolution = 1.0;
    int qualifier = -1;
    if (!call_for_interval(&system->instances.at[clock->instance], control, clock, t, &interval, &resolution, &qualifier))
        return FAILED;
    if (qualifier == UNKNOWN && clock->kind == CLOCK_COUNTDOWN) return UNKNOWN;
    if (qualifier != UNCHANGED && qualifier != CHANGED) {
        fail(control, FAULT_NO_INTERVAL, qualifier, where, number, t);
        return FAILED;
    }
    const double known = clock->interval / clock->resolution;
    if (qualifier == UNCHANGED && isfinite(known)) return UNCHANGED;
    clock->interval = interval;
    clock->resolution = resolution;
    const double told = interval / resolution;
    if (!(isfinite(told) && (clock->kind != CLOCK_PERIODIC ? told >= 0.0 : told > 0.0))) {
        fail(control, FAULT_BAD_INTERVAL, 0, where, number, t);
        return FAILED;
    }
    return clock->kind == CLOCK_PERIODIC && told == known ? UNCHANGED : CHANGED;
}

/* Ask for a periodic clock's shift, in the resolution of its interval if it is told in that one, too. */
static int ask_shift(const System *system, Control *control, Clock *clock, int number) {
    const Instance *const instance = &system->instances.at[clock->instance];
    const int where = -1 - clock->instance;
    const double t = control->start;
    if (clock->fraction) {
        Fmi3GetShiftFraction *const function = (Fmi3GetShiftFraction *)clock->get_shift;
        uint64_t counter = 0, ticks = 0;
        const int status = function(instance->handle, clock->reference, 1, &counter, &ticks);
        keep_arithmetic();
        if (!judge(control, status, where, CALLED_GetShiftFraction, t)) return 0;
        const double resolution = (double)ticks;
        clock->shift = (double)counter;
        if (resolution != clock->resolution) {
            clock->interval = clock->interval / clock->resolution;
            clock->shift = clock->shift / resolution;
            clock->resolution = 1.0;
        }
    } else {
        Fmi3GetShiftDecimal *const function = (Fmi3GetShiftDecimal *)clock->get_shift;
        const int status = function(instance->handle, clock->reference, 1, &clock->shift);
        keep_arithmetic();
        if (!judge(control, status, where, CALLED_GetShiftDecimal, t)) return 0;
    }
    if (!(isfinite(clock->shift) && clock->shift >= 0.0)) return fail(control, FAULT_BAD_INTERVAL, 1, where, number, t);
    return 1;
}

/* The nearest point of the grid. */
static double grid_point(const Control *control, double t) {
    return control->start + floor((t - control->start) / control->step + 0.5) * control->step;
}

/* Whether the next tick can be kept: where steps do not end at events, it has to be at a point of the grid. */
static int is_kept(Control *control, const Clock *clock, int number, double t) {
    if (!control->on_grid || clock->next > control->stop + control->step) return 1;
    const double away = fabs(clock->next - grid_point(control, clock->next));
    return away <= time_rounding(clock->next, control->step) ||
           fail(control, FAULT_OFF_GRID, 0, -1 - clock->instance, number, t);
}

static int start_clock(const System *system, Control *control, Clock *clock, int number) {
    int qualifier = CHANGED;
    if (clock->asked) {
        clock->interval = NAN;
        clock->resolution = 1.0;
        qualifier = ask_interval(system, control, clock, number, control->start);
        if (qualifier == FAILED) return 0;
        if (clock->kind == CLOCK_PERIODIC && !ask_shift(system, control, clock, number)) return 0;
    }
    if (clock->kind == CLOCK_PERIODIC)
        clock->next = tick_time(clock);
    else if (qualifier != UNKNOWN)
        clock->next = control->start + clock->interval / clock->resolution;
    return is_kept(control, clock, number, control->start);
}

int loop_start_clocks(const System *system, Control *control) {
    for (size_t i = 0; i < system->clocks.count; i++) {
        Clock *const clock = &system->clocks.at[i];
        clock->active = clock->ticks = 0;
        clock->count = 0;
        clock->next = NO_EVENT;
        clock->ticked = NAN;
        clock->origin = control->start;
        if (is_timed(clock) && !start_clock(system, control, clock, (int)i)) return 0;
    }
    return 1;
}

/* Have an input clock tick. */
static int activate(const System *system, Control *control, int number, double t) {
    Clock *const clock = &system->clocks.at[number];
    const int where = -1 - clock->instance;
    if (clock->ticked != t) clock->ticks = 0;
    clock->active = 1;
    clock->ticked = t;
    clock->ticks++;
    if (clock->ticks > MOST_TICKS) return fail(control, FAULT_ENDLESS_TICKS, 0, where, number, t);
    Fmi3Boolean is_active = 1;
    const int status =
        ((Fmi2Transfer *)clock->set)(system->instances.at[clock->instance].handle, clock->reference, 1, &is_active);
    keep_arithmetic();
    return judge(control, status, where, CALLED_SetClock, t);
}

/* Have the timed clocks tick that are due. */
static int activate_timed(const System *system, Control *control, double t) {
    const double near = time_rounding(t, control->step);
    for (size_t i = 0; i < system->clocks.count; i++) {
        Clock *const clock = &system->clocks.at[i];
        if (!is_timed(clock) || clock->next > t + near) continue;
        if (!activate(system, control, (int)i, t)) return 0;
        if (clock->kind != CLOCK_PERIODIC) {
            clock->next = NO_EVENT;
            continue;
        }
        clock->count++;
        clock->next = tick_time(clock);
        if (clock->next <= t + near) return fail(control, FAULT_BAD_INTERVAL, 0, -1 - clock->instance, (int)i, t);
        if (!is_kept(control, clock, (int)i, t)) return 0;
    }
    return 1;
}

static int can_be_read(const System *system, const Clock *clock) {
    for (int i = clock->within; i < clock->within + clock->within_count; i++)
        if (system->clocks.at[system->clock_numbers.at[i]].active) return 1;
    return clock->within_count == 0;
}

/* Ask the output clocks, and have those tick that are connected to them; 1 if there are new ones, 0 if not, or FAILED. */
static int activate_triggered(const System *system, Control *control, double t) {
    int found = 0;
    for (size_t i = 0; i < system->clocks.count; i++) {
        Clock *const clock = &system->clocks.at[i];
        if (clock->kind != CLOCK_TRIGGERING || clock->active || !can_be_read(system, clock)) continue;
        Answers answers = {{0}, {0}};
        const int status =
            ((Fmi2Transfer *)clock->get)(system->instances.at[clock->instance].handle, clock->reference, 1, answers.flag);
        keep_arithmetic();
        if (!judge(control, status, -1 - clock->instance, CALLED_GetClock, t)) return FAILED;
        if (!answers.flag[0]) continue;
        clock->active = found = 1;
        for (int k = clock->targets; k < clock->targets + clock->target_count; k++)
            if (!activate(system, control, system->clock_numbers.at[k], t)) return FAILED;
    }
    return found;
}

/* Exchange what belongs to the clocks that tick; after it they have sampled (`active` is 2). */
static int exchange_ticking(const System *system, Control *control, double t) {
    if (!execute(system, control, system->tick_program, t, 0.0)) return 0;
    for (size_t i = 0; i < system->clocks.count; i++)
        if (system->clocks.at[i].active) system->clocks.at[i].active = 2;
    return 1;
}

int tick(const System *system, Control *control, double t, int settled) {
    if (settled && !(activate_timed(system, control, t) && exchange_ticking(system, control, t))) return 0;
    for (size_t i = 0; i < system->clocks.count; i++) {
        const int found = activate_triggered(system, control, t);
        if (found <= 0) return found == 0;
        if (!exchange_ticking(system, control, t)) return 0;
    }
    return 1;
}

/* What an instance tells of a clock's next tick in event mode. */
static int ask_again(const System *system, Control *control, Clock *clock, int number, double t) {
    const int qualifier = ask_interval(system, control, clock, number, t);
    if (qualifier == FAILED) return 0;
    if (clock->kind == CLOCK_PERIODIC) {
        if (qualifier == CHANGED) { /* the new interval counts from now on */
            clock->origin = t;
            clock->shift = 0.0;
            clock->count = 1;
            clock->next = tick_time(clock);
        }
    } else if (qualifier == UNKNOWN) {
        clock->next = NO_EVENT;
    } else if (qualifier == CHANGED || clock->kind == CLOCK_CHANGING) {
        clock->next = t + clock->interval / clock->resolution;
    }
    return is_kept(control, clock, number, t);
}

int end_ticks(const System *system, Control *control, double t) {
    const double near = time_rounding(t, control->step);
    int due = 0;
    if (control->on_grid)
        for (size_t i = 0; i < system->instances.count; i++) {
            Instance *const instance = &system->instances.at[i];
            if (!(instance->next_event <= control->stop)) continue;
            const double point = grid_point(control, instance->next_event);
            instance->next_event = point >= instance->next_event - near ? point : point + control->step;
        }
    for (size_t i = 0; i < system->clocks.count; i++) {
        Clock *const clock = &system->clocks.at[i];
        const int was_active = clock->active;
        clock->active = 0;
        if (!is_timed(clock)) continue;
        /* a tick that is due comes before what is told of the next one */
        const int asked = clock->asked == ASKED_ALWAYS && (clock->kind != CLOCK_CHANGING || was_active) && clock->next > t + near;
        if (asked && !ask_again(system, control, clock, (int)i, t)) return FAILED;
        if (clock->next <= t + near) due = 1;
        Instance *const instance = &system->instances.at[clock->instance];
        if (clock->next < instance->next_event) instance->next_event = clock->next;
    }
    return due;
}
