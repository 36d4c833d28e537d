/* A mass on a spring with friction for FMI 1.0, exact for a held force: slave and model in one library. It is strict: every call that
   FMI 1.0 does not allow in its state is an error, reading between set and step, too. A model takes no input between the end of a step,
   or its initialization, and an event, as those of AMESim do not.

   `fault`: 1 steps fail, 2 steps are discarded, 3 steps end in the background, 4 initialization returns a warning, 5 no instance is
   made, 6 reset fails, 7 initialization fails, 8 a model asks to end the simulation at initialization; from `fault_time` on. With
   `held` set the mass is held still. A model stands still until an event finds a force beyond `stiction`, if that is not 0; it
   has a time event every 0.35 s, each of which is one of its steps. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi1Functions.h"

#define EXPORT __attribute__((visibility("default")))
#define NAME(function) spring_##function

enum { FORCE, POSITION, SPEED, MASS, STIFFNESS, DAMPING, FAULT_TIME, SEEN, SUM, STICTION, REALS }; /* references of real numbers */
enum { FAULT, COUNT_IN, COUNT_OUT, STEPS, UPDATES, INTEGERS };
enum { HELD, MOVING, BOOLEANS };
enum { MADE, INITIALIZED, ENDED };
#define PERIOD 0.35

typedef struct {
    double real[REALS];
    int integer[INTEGERS];
    char boolean[BOOLEANS];
    int state, set, model;
    int sticking, stepping; /* a model's step is not completed */
    double time, slope, next_event;
    char name[64];
    fmi1CallbackFunctions callbacks;
} Spring;

static fmi1Status say(Spring *self, fmi1Status status, const char *text) {
    self->callbacks.logger(self, self->name, status, "log", "100%% of %s: %s at %g s", "the load", text, self->time);
    return status;
}

static void begin(Spring *self) {
    double *r = self->real;
    memset(r, 0, sizeof self->real);
    memset(self->integer, 0, sizeof self->integer);
    memset(self->boolean, 0, sizeof self->boolean);
    r[MASS] = 2.0, r[STIFFNESS] = 50.0, r[DAMPING] = 1.0;
    self->state = MADE, self->set = self->stepping = 0, self->slope = 0.0, self->next_event = PERIOD;
}

static void evaluate(Spring *self) {
    double *r = self->real;
    r[SUM] = r[POSITION] + r[FORCE];
    self->integer[COUNT_OUT] = self->integer[COUNT_IN] + self->integer[STEPS];
    self->boolean[MOVING] = r[SPEED] != 0.0 && !self->boolean[HELD];
}

static Spring *make(fmi1String name, fmi1String guid, fmi1CallbackFunctions functions, int model) {
    Spring *self = functions.allocateMemory(1, sizeof(Spring));
    self->callbacks = functions, self->model = model;
    strncpy(self->name, name, sizeof self->name - 1);
    if (strcmp(guid, "spring") != 0) {
        say(self, fmi1Error, "another guid");
        functions.freeMemory(self);
        return NULL;
    }
    begin(self);
    return self;
}

static void scrap(Spring *self) {
    void (*const free_memory)(void *) = self->callbacks.freeMemory;
    if (self->state == INITIALIZED) say(self, fmi1Error, "freed without an end");
    free_memory(self);
}

/* The state at the end of [0, h], where the force is held, or goes on with a slope (whose part is taken by its mean). */
static void move(Spring *self, double h) {
    double *r = self->real;
    if (self->boolean[HELD]) return;
    const double rest = (r[FORCE] + 0.5 * h * self->slope) / r[STIFFNESS], decay = 0.5 * r[DAMPING] / r[MASS];
    const double w = sqrt(r[STIFFNESS] / r[MASS] - decay * decay), x = r[POSITION] - rest, v = r[SPEED];
    const double c = exp(-decay * h) * cos(w * h), s = exp(-decay * h) * sin(w * h) / w;
    r[POSITION] = rest + c * x + s * (v + decay * x);
    r[SPEED] = c * v - s * (decay * v + (w * w + decay * decay) * x);
}

EXPORT fmi1Status NAME(fmiSetDebugLogging)(fmi1Component c, fmi1Boolean on) { return fmi1OK; }
EXPORT const char *NAME(fmiGetVersion)(void) { return "1.0"; }
EXPORT const char *NAME(fmiGetTypesPlatform)(void) { return "standard32"; }
EXPORT const char *NAME(fmiGetModelTypesPlatform)(void) { return "standard32"; }

#define GET(Type, type, array, limit)                                                                               \
    EXPORT fmi1Status NAME(fmiGet##Type)(fmi1Component c, const fmi1ValueReference vr[], size_t n, type values[]) { \
        Spring *self = c;                                                                                           \
        if (self->state != INITIALIZED || (self->set && !self->model)) return say(self, fmi1Error, "read too early"); \
        evaluate(self);                                                                                             \
        for (size_t i = 0; i < n; i++) {                                                                            \
            if (vr[i] >= limit) return say(self, fmi1Error, "another reference");                                   \
            values[i] = self->array[vr[i]];                                                                         \
        }                                                                                                           \
        return fmi1OK;                                                                                              \
    }
GET(Real, fmi1Real, real, REALS)
GET(Integer, fmi1Integer, integer, INTEGERS)
GET(Boolean, fmi1Boolean, boolean, BOOLEANS)

#define SET(Type, type, array, limit)                                                                                     \
    EXPORT fmi1Status NAME(fmiSet##Type)(fmi1Component c, const fmi1ValueReference vr[], size_t n, const type values[]) { \
        Spring *self = c;                                                                                                 \
        if (self->state == ENDED) return say(self, fmi1Error, "set at the end");                                          \
        if (self->model && self->state == INITIALIZED && !self->stepping) return say(self, fmi1Error, "set before an event"); \
        for (size_t i = 0; i < n; i++) {                                                                                  \
            if (vr[i] >= limit) return say(self, fmi1Error, "another reference");                                         \
            self->array[vr[i]] = values[i];                                                                               \
        }                                                                                                                 \
        self->set = self->state == INITIALIZED;                                                                           \
        return fmi1OK;                                                                                                    \
    }
SET(Real, fmi1Real, real, REALS)
SET(Integer, fmi1Integer, integer, INTEGERS)
SET(Boolean, fmi1Boolean, boolean, BOOLEANS)

/* By how much the force is beyond the stiction. */
static double lead(const Spring *self) {
    return self->real[STICTION] > 0.0 ? fabs(self->real[FORCE]) - self->real[STICTION] : 1.0;
}

static fmi1Status initialize(Spring *self, double start) {
    if (self->state != MADE) return say(self, fmi1Error, "initialized twice");
    self->state = INITIALIZED, self->time = start;
    self->real[SEEN] = self->real[FORCE]; /* what the force was at initialization */
    self->sticking = self->model && lead(self) <= 0.0;
    evaluate(self);
    if (self->integer[FAULT] == 7) return say(self, fmi1Error, "no equilibrium");
    return self->integer[FAULT] == 4 ? say(self, fmi1Warning, "nearly") : fmi1OK;
}

/* Slave */

EXPORT fmi1Component NAME(fmiInstantiateSlave)(fmi1String name, fmi1String guid, fmi1String location, fmi1String mime,
                                               fmi1Real timeout, fmi1Boolean visible, fmi1Boolean interactive,
                                               fmi1CallbackFunctions functions, fmi1Boolean logging) {
    return make(name, guid, functions, 0);
}
EXPORT void NAME(fmiFreeSlaveInstance)(fmi1Component c) { scrap(c); }
EXPORT fmi1Status NAME(fmiInitializeSlave)(fmi1Component c, fmi1Real start, fmi1Boolean stop_defined, fmi1Real stop) {
    return initialize(c, start);
}
EXPORT fmi1Status NAME(fmiTerminateSlave)(fmi1Component c) {
    Spring *self = c;
    if (self->state != INITIALIZED) return say(self, fmi1Error, "ended too early");
    return self->state = ENDED, fmi1OK;
}
EXPORT fmi1Status NAME(fmiResetSlave)(fmi1Component c) {
    Spring *self = c;
    if (self->state == MADE) return say(self, fmi1Error, "reset too early");
    if (self->integer[FAULT] == 6) return say(self, fmi1Error, "no reset");
    return begin(self), fmi1OK;
}

EXPORT fmi1Status NAME(fmiSetRealInputDerivatives)(fmi1Component c, const fmi1ValueReference vr[], size_t n,
                                                   const fmi1Integer order[], const fmi1Real values[]) {
    Spring *self = c;
    if (n != 1 || vr[0] != FORCE || order[0] != 1) return say(self, fmi1Error, "another derivative");
    return self->slope = values[0], fmi1OK;
}

EXPORT fmi1Status NAME(fmiDoStep)(fmi1Component c, fmi1Real t, fmi1Real h, fmi1Boolean new_step) {
    Spring *self = c;
    if (self->state != INITIALIZED || fabs(t - self->time) > 1e-9 || new_step != 1) return say(self, fmi1Error, "another time");
    const int fault = t + h >= self->real[FAULT_TIME] ? self->integer[FAULT] : 0;
    if (fault == 1) return say(self, fmi1Error, "broken");
    if (fault == 2) return say(self, fmi1Discard, "too far");
    if (fault == 3) return (fmi1Status)5; /* fmi1Pending */
    move(self, h);
    self->time = t + h, self->set = 0, self->integer[STEPS]++;
    return fmi1OK;
}

/* Model */

EXPORT fmi1Component NAME(fmiInstantiateModel)(fmi1String name, fmi1String guid, fmi1CallbackFunctions functions,
                                               fmi1Boolean logging) {
    return make(name, guid, functions, 1);
}
EXPORT void NAME(fmiFreeModelInstance)(fmi1Component c) { scrap(c); }
EXPORT fmi1Status NAME(fmiSetTime)(fmi1Component c, fmi1Real t) {
    Spring *self = c;
    return self->time = t, self->stepping = self->state == INITIALIZED, fmi1OK;
}

static void tell(const Spring *self, fmi1EventInfo *info) {
    memset(info, 0, sizeof *info);
    info->iterationConverged = info->upcomingTimeEvent = 1, info->nextEventTime = self->next_event;
    info->terminateSimulation = self->integer[FAULT] == 8;
}

EXPORT fmi1Status NAME(fmiInitialize)(fmi1Component c, fmi1Boolean controlled, fmi1Real tolerance, fmi1EventInfo *info) {
    tell(c, info);
    return initialize(c, ((Spring *)c)->time);
}
EXPORT fmi1Status NAME(fmiEventUpdate)(fmi1Component c, fmi1Boolean intermediate, fmi1EventInfo *info) {
    Spring *self = c;
    if (self->stepping) return say(self, fmi1Error, "an event within a step");
    if (self->time >= self->next_event - 1e-9) self->next_event += PERIOD, self->integer[STEPS]++;
    self->integer[UPDATES]++, self->sticking = self->sticking && lead(self) <= 0.0;
    return tell(self, info), fmi1OK;
}
EXPORT fmi1Status NAME(fmiCompletedIntegratorStep)(fmi1Component c, fmi1Boolean *event) {
    return ((Spring *)c)->stepping = 0, *event = 0, fmi1OK;
}
EXPORT fmi1Status NAME(fmiTerminate)(fmi1Component c) { return ((Spring *)c)->state = ENDED, fmi1OK; }
EXPORT fmi1Status NAME(fmiGetContinuousStates)(fmi1Component c, fmi1Real x[], size_t n) {
    return memcpy(x, &((Spring *)c)->real[POSITION], n * sizeof *x), fmi1OK;
}
EXPORT fmi1Status NAME(fmiSetContinuousStates)(fmi1Component c, const fmi1Real x[], size_t n) {
    return ((Spring *)c)->stepping = 1, memcpy(&((Spring *)c)->real[POSITION], x, n * sizeof *x), fmi1OK;
}
EXPORT fmi1Status NAME(fmiGetDerivatives)(fmi1Component c, fmi1Real rates[], size_t n) {
    const Spring *self = c;
    const double *r = self->real;
    const int still = self->boolean[HELD] || self->sticking;
    rates[0] = still ? 0.0 : r[SPEED];
    rates[1] = still ? 0.0 : (r[FORCE] - r[STIFFNESS] * r[POSITION] - r[DAMPING] * r[SPEED]) / r[MASS];
    return fmi1OK;
}
EXPORT fmi1Status NAME(fmiGetEventIndicators)(fmi1Component c, fmi1Real z[], size_t n) { return z[0] = lead(c), fmi1OK; }
EXPORT fmi1Status NAME(fmiGetNominalContinuousStates)(fmi1Component c, fmi1Real x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi1OK;
}
EXPORT fmi1Status NAME(fmiGetStateValueReferences)(fmi1Component c, fmi1ValueReference vr[], size_t n) {
    for (size_t i = 0; i < n; i++) vr[i] = POSITION + (fmi1ValueReference)i;
    return fmi1OK;
}

#define ABSENT(Name) EXPORT fmi1Status NAME(fmi##Name)(void) { return fmi1Error; }
ABSENT(GetString) ABSENT(SetString) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus) ABSENT(GetRealStatus)
ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
