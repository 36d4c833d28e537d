/* An FMU of FMI 3.0 with clocks, which keeps to the letter of the standard: every call that is not allowed fails in words.

   Its clock `c` (of any kind) samples `u`: at its k-th tick y = x + u, then x := y, and it is an error to step over a tick, or to
   leave event mode without one that is due. Its output clock `out` ticks with every `every`-th tick of `c`. Its clock `trig` is
   triggered from outside: z = w + 1000. At its own events, every `period`, a countdown is started again and a tunable clock's interval
   is halved; a changing one's interval grows by `interval` with each tick. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"

#define EXPORT __attribute__((visibility("default")))
#define RESOLUTION 3000

enum { C = 1, TRIG, OUT, U = 10, Y, LAST, V, W, Z, INTERVAL, SHIFT, PERIOD, HELD, REALS, COUNT = 40, EVERY, HEARD, KIND, FAULT, INTEGERS };
enum kind { CONSTANT, FIXED, TUNABLE, CHANGING, COUNTDOWN };
enum fault { NONE, NOT_KNOWN, NOT_A_NUMBER, ZERO, NEGATIVE, SET_FAILS, GET_FAILS, INTERVAL_FAILS, SHIFT_FAILS, ODD_QUALIFIER };
enum mode { INSTANTIATED, INITIALIZATION, EVENT, STEP };

typedef struct {
    double r[REALS];
    int n[INTEGERS - COUNT];
    double x, time, due, interval;
    int mode, active[4], changed, arm;
    long events; /* of its own */
} State;

typedef struct {
    State now;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} Clocked;

#define R(name) (self->now.r[name])
#define N(name) (self->now.n[name - COUNT])

static fmi3Status failed(Clocked *self, const char *format, double a) {
    char text[160];
    snprintf(text, sizeof text, format, a);
    self->log(self->environment, fmi3Error, "logStatus", text);
    return fmi3Error;
}

static void start(Clocked *self) {
    memset(&self->now, 0, sizeof self->now);
    R(INTERVAL) = 0.1, R(PERIOD) = 1e300, N(EVERY) = 1;
    self->now.due = 1e300;
}

static int near(const Clocked *self, double t) { return fabs(t - self->now.time) <= 1e-12 * (1.0 + fabs(t)); }

static void evaluate(Clocked *self) { /* what the active clocks' partitions give, from the states before */
    if (self->now.active[C])
        R(Y) = self->now.x + R(U);
    if (self->now.active[OUT])
        R(V) = 100.0 * (N(COUNT) + 1);
    if (self->now.active[TRIG])
        R(Z) = R(W) + 1000.0;
}

static int may(const Clocked *self, unsigned vr) {
    int clock = vr == U || vr == Y ? C : vr == V ? OUT : vr == W || vr == Z ? TRIG : 0;
    return clock == 0 || self->now.mode == INITIALIZATION || (self->now.mode == EVENT && self->now.active[clock]);
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
    fmi3Boolean early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Clocked *self = calloc(1, sizeof *self);
    self->log = log, self->environment = environment;
    if (!event_mode) {
        failed(self, "clocks need event mode", 0.0);
        return free(self), NULL;
    }
    return start(self), self;
}

EXPORT void fmi3FreeInstance(fmi3Instance self) { free(self); }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { return start(c), fmi3OK; }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
    Clocked *self = c;
    self->now.mode = INITIALIZATION, self->now.time = start_time;
    self->now.interval = R(INTERVAL), self->now.changed = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Clocked *self = c;
    if (self->now.changed && N(KIND) != CONSTANT && N(KIND) != COUNTDOWN)
        return failed(self, "nobody has asked for the interval", 0.0);
    if (N(KIND) == CONSTANT)
        self->now.due = self->now.time + R(SHIFT);
    return self->now.mode = EVENT, fmi3OK;
}

#define VALUES(Name, field, first) \
    EXPORT fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##Name values[], size_t m) { \
        Clocked *self = c; \
        evaluate(self); \
        for (size_t i = 0; i < n; i++) { \
            if (!may(self, vr[i])) \
                return failed(self, "variable %g was read while its clock does not tick", vr[i]); \
            values[i] = self->now.field[vr[i] - first]; \
        } \
        return fmi3OK; \
    } \
    EXPORT fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##Name values[], size_t m) { \
        Clocked *self = c; \
        for (size_t i = 0; i < n; i++) { \
            if (!may(self, vr[i])) \
                return failed(self, "variable %g was set while its clock does not tick", vr[i]); \
            self->now.field[vr[i] - first] = values[i]; \
        } \
        return fmi3OK; \
    }

VALUES(Float64, r, 0)
VALUES(Int32, n, COUNT)

EXPORT fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
    Clocked *self = c;
    for (size_t i = 0; i < n; i++) {
        if (self->now.mode != EVENT || vr[i] == OUT || !values[i] || N(FAULT) == SET_FAILS)
            return failed(self, "clock %g cannot be set", vr[i]);
        if (vr[i] == C && (N(KIND) < COUNTDOWN || self->now.interval > 0.0) && !near(self, self->now.due))
            return failed(self, "a tick was not due before %.17g", self->now.due);
        self->now.active[vr[i]] = 1;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[]) {
    Clocked *self = c;
    for (size_t i = 0; i < n; i++) {
        if (self->now.mode != EVENT || vr[i] != OUT || !self->now.active[C] || N(FAULT) == GET_FAILS)
            return failed(self, "clock %g cannot be read", vr[i]);
        values[i] = self->now.active[OUT] = (N(COUNT) + 1) % N(EVERY) == 0;
    }
    return fmi3OK;
}

/* The interval in units of 1 / resolution, and what is said of it. */
static fmi3Status tell(Clocked *self, unsigned vr, double resolution, double *interval, fmi3IntervalQualifier *qualifier) {
    State *s = &self->now;
    if (vr != C || (s->mode != INITIALIZATION && s->mode != EVENT) || N(FAULT) == INTERVAL_FAILS)
        return failed(self, "clock %g has no interval now", vr);
    *interval = s->interval * resolution;
    *qualifier = s->changed ? fmi3IntervalChanged : fmi3IntervalUnchanged;
    if (N(KIND) == COUNTDOWN && s->due == 1e300 && !s->arm)
        return *qualifier = fmi3IntervalNotYetKnown, fmi3OK;
    if (s->changed || s->arm) {
        *qualifier = fmi3IntervalChanged;
        s->due = s->time + s->interval + (s->mode == INITIALIZATION && N(KIND) <= TUNABLE ? R(SHIFT) - s->interval : 0.0);
        s->changed = s->arm = 0;
    }
    if (N(FAULT) == NOT_KNOWN)
        *qualifier = fmi3IntervalNotYetKnown;
    if (N(FAULT) == ODD_QUALIFIER)
        *qualifier = (fmi3IntervalQualifier)7;
    if (N(FAULT) == NOT_A_NUMBER || N(FAULT) == NEGATIVE || N(FAULT) == ZERO)
        *interval = N(FAULT) == NOT_A_NUMBER ? NAN : N(FAULT) == ZERO ? 0.0 : -1.0;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                         fmi3IntervalQualifier qualifiers[]) {
    return tell(c, vr[0], 1.0, intervals, qualifiers);
}

EXPORT fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                          fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    double counter = 0.0;
    fmi3Status status = tell(c, vr[0], RESOLUTION, &counter, qualifiers);
    counters[0] = (fmi3UInt64)(counter + 0.5), resolutions[0] = RESOLUTION;
    return status;
}

static fmi3Status tell_shift(Clocked *self, unsigned vr, double *shift) {
    if (vr != C || self->now.mode != INITIALIZATION || N(KIND) > TUNABLE || N(FAULT) == SHIFT_FAILS)
        return failed(self, "clock %g has no shift now", vr);
    return *shift = R(SHIFT), fmi3OK;
}

EXPORT fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]) {
    return tell_shift(c, vr[0], shifts);
}

EXPORT fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                       fmi3UInt64 resolutions[]) {
    double shift = 0.0;
    fmi3Status status = tell_shift(c, vr[0], &shift);
    counters[0] = (fmi3UInt64)(shift * RESOLUTION + 0.5), resolutions[0] = RESOLUTION;
    return status;
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) { return ((Clocked *)c)->now.mode = EVENT, fmi3OK; }

EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    Clocked *self = c;
    if (near(self, self->now.due))
        return failed(self, "the tick at %.17g was forgotten", self->now.due);
    return self->now.mode = STEP, fmi3OK;
}

EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    Clocked *self = c;
    State *s = &self->now;
    evaluate(self);
    if (s->active[C]) {
        s->x = R(HELD) = R(Y), R(LAST) = s->time, N(COUNT)++;
        if (N(KIND) == CHANGING)
            s->interval += R(INTERVAL), s->changed = 1;
        s->due = N(KIND) >= CHANGING ? 1e300 : s->due + s->interval;
    }
    if (s->active[TRIG])
        N(HEARD)++;
    memset(s->active, 0, sizeof s->active);
    if (near(self, (s->events + 1) * R(PERIOD))) {
        s->events++;
        if (N(KIND) == COUNTDOWN)
            s->arm = 1;
        if (N(KIND) == TUNABLE)
            s->interval *= 0.5, s->changed = 1;
    }
    *again = *terminate = *nominals = *values = 0;
    *next_defined = 1, *next = (s->events + 1) * R(PERIOD);
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_going_back, fmi3Boolean *event_needed,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    Clocked *self = c;
    *event_needed = *terminate = *early = 0, *last = t + h;
    if (self->now.mode != STEP)
        return failed(self, "a step at %g outside of step mode", t);
    if (self->now.due < t + h - 1e-10)
        return failed(self, "a step over the tick at %.17g", self->now.due);
    self->now.time = t + h;
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    *state = malloc(sizeof(State));
    memcpy(*state, &((Clocked *)c)->now, sizeof(State));
    return fmi3OK;
}
EXPORT fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(&((Clocked *)c)->now, state, sizeof(State));
    return fmi3OK;
}
EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { return free(*state), *state = NULL, fmi3OK; }

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) { return fmi3OK; }
EXPORT fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }

#define ABSENT(Name) EXPORT fmi3Status fmi3##Name(void) { return fmi3Error; }
#define BOTH(Name) ABSENT(Get##Name) ABSENT(Set##Name)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(UInt32) BOTH(Int64) BOTH(UInt64) BOTH(Boolean) BOTH(String)
BOTH(Binary) BOTH(ContinuousStates)
ABSENT(SetIntervalDecimal) ABSENT(SetIntervalFraction) ABSENT(SetShiftDecimal) ABSENT(SetShiftFraction)
ABSENT(GetNumberOfVariableDependencies) ABSENT(GetVariableDependencies) ABSENT(SerializedFMUStateSize)
ABSENT(SerializeFMUState) ABSENT(DeserializeFMUState) ABSENT(GetDirectionalDerivative) ABSENT(GetAdjointDerivative)
ABSENT(EnterConfigurationMode) ABSENT(ExitConfigurationMode) ABSENT(EvaluateDiscreteStates) ABSENT(EnterContinuousTimeMode)
ABSENT(CompletedIntegratorStep) ABSENT(SetTime) ABSENT(GetContinuousStateDerivatives) ABSENT(GetEventIndicators)
ABSENT(GetNominalsOfContinuousStates) ABSENT(GetNumberOfEventIndicators) ABSENT(GetNumberOfContinuousStates)
ABSENT(GetOutputDerivatives) ABSENT(ActivateModelPartition)
