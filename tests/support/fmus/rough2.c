/* A plant as users have them, for FMI 2.0: one or two modes behind or beside a drive's lag, beside integrators and a drift, with
   noise in its output, a solver that is exact or Euler's method, a stiffness that is not linear, and a mass that is an input. Its input
   may be rounded to multiples of `count`, as a converter does, or have no effect up to `dead`, as a valve's overlap.

       m load q'' = -2 z w q' - w^2 (q + cubic q^3, or sin q) - friction tanh(q' / slip) + f + e1 u2
       q2'' = -2 z2 w2 q2' - w2^2 q2 + b2 f + e2 u2
       lag l' = u - l,   f = u, or l if it is in series;   i' = u,   j' = i
       y = c1 q + c2 q2 + cl l + ci i + cj j + d u + drift t + noise,   y2 = q2

   If the input is a velocity, q is relative to what moves with it: q' = s - u, and m load s' is the force above without f. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

#define EXPORT __attribute__((visibility("default")))
#define HUGEST 1e150
#define STATES 7
#define TURN 6.283185307179586

enum { U, U2, LOAD, Y, Y2, MASS, W, Z, W2, Z2, B2, E1, E2, LAG, SERIES, CUBIC, PENDULUM, FRICTION, SLIP, VELOCITY, C1, C2, CL, CI, CJ, D,
       DRIFT, NOISE, SEED, EULER, INNER, Q0, S0, L0, COUNT, DEAD, REALS };
enum { Q, S, Q2, S2, L, I, J };
enum { EXACT, COMMUNICATION, INNER_STEPS };

static const double STARTS[REALS] = {[LOAD] = 1.0, [MASS] = 1.0, [W] = 10.0, [W2] = 30.0, [LAG] = 1.0, [SLIP] = 1e-3, [C1] = 1.0};

typedef struct {
    double r[REALS], x[STATES], time, noise;
    unsigned long long random;
    const fmi2CallbackFunctions *callbacks;
    char name[64];
} Rough;

static unsigned long long runs; /* noise without a seed is another one in each run */

static double uniform(Rough *self) {
    self->random = self->random * 6364136223846793005ULL + 1442695040888963407ULL;
    return ((double)(self->random >> 11) + 0.5) / 9007199254740992.0;
}

static void draw(Rough *self) {
    self->noise = self->r[NOISE] * sqrt(-2.0 * log(uniform(self))) * cos(TURN * uniform(self));
}

static double taken(const double *r) {
    double u = r[COUNT] > 0.0 ? round(r[U] / r[COUNT]) * r[COUNT] : r[U];
    return fabs(u) > r[DEAD] ? u - copysign(r[DEAD], u) : 0.0;
}

static void derive(const double *r, const double *x, double *dx) {
    double u = taken(r), f = r[SERIES] ? x[L] : u, v = x[S] - (r[VELOCITY] ? f : 0.0);
    double spring = r[PENDULUM] ? sin(x[Q]) : x[Q] + r[CUBIC] * x[Q] * x[Q] * x[Q];
    double force = -2.0 * r[Z] * r[W] * v - r[W] * r[W] * spring - r[FRICTION] * tanh(v / r[SLIP]) + r[E1] * r[U2];
    dx[Q] = v;
    dx[S] = (force + (r[VELOCITY] ? 0.0 : f)) / (r[MASS] * r[LOAD]);
    dx[Q2] = x[S2];
    dx[S2] = -2.0 * r[Z2] * r[W2] * x[S2] - r[W2] * r[W2] * x[Q2] + r[B2] * f + r[E2] * r[U2];
    dx[L] = (u - x[L]) / r[LAG];
    dx[I] = u;
    dx[J] = x[I];
}

static void runge_kutta(Rough *self, double h) {
    static const double share[4] = {0.0, 0.5, 0.5, 1.0};
    double k[4][STATES], between[STATES], *x = self->x;
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < STATES; i++)
            between[i] = x[i] + (stage ? share[stage] * h * k[stage - 1][i] : 0.0);
        derive(self->r, between, k[stage]);
    }
    for (int i = 0; i < STATES; i++)
        x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
}

static void euler(Rough *self, double h) {
    double dx[STATES];
    derive(self->r, self->x, dx);
    for (int i = 0; i < STATES; i++)
        self->x[i] += h * dx[i];
}

static void begin(Rough *self) {
    memset(self->x, 0, sizeof self->x);
    memcpy(self->r, STARTS, sizeof STARTS);
    self->time = self->noise = 0.0;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Rough *self = calloc(1, sizeof *self);
    self->callbacks = callbacks;
    snprintf(self->name, sizeof self->name, "%s", name);
    begin(self);
    return self;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                                      fmi2Boolean stop_defined, fmi2Real stop_time) {
    return fmi2OK;
}

EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }

EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Rough *self = c;
    self->x[Q] = self->r[Q0], self->x[S] = self->r[S0], self->x[L] = self->r[L0];
    self->random = self->r[SEED] ? (unsigned long long)self->r[SEED] : 7919ULL * ++runs;
    for (int i = 0; i < 8; i++)
        draw(self);
    return fmi2OK;
}

EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

EXPORT fmi2Status fmi2Reset(fmi2Component c) { return begin(c), fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    Rough *self = c;
    double *r = self->r, *x = self->x;
    r[Y] = r[C1] * x[Q] + r[C2] * x[Q2] + r[CL] * x[L] + r[CI] * x[I] + r[CJ] * x[J] + r[D] * r[U] + r[DRIFT] * self->time + self->noise;
    r[Y2] = x[Q2];
    if (!(fabs(r[Y]) < HUGEST)) {
        self->callbacks->logger(self->callbacks->componentEnvironment, self->name, fmi2Error, "logStatus", "%s", "overflow");
        return fmi2Error;
    }
    for (size_t i = 0; i < n; i++)
        values[i] = r[vr[i]];
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        ((Rough *)c)->r[vr[i]] = values[i];
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    Rough *self = c;
    const double *r = self->r;
    double longest = r[EULER] == INNER_STEPS ? r[INNER] : r[EULER] == COMMUNICATION ? h : 0.02 / fmax(fmax(r[W], r[W2]), 1.0 / r[LAG]);
    int steps = (int)ceil(h / longest * (1.0 - 1e-12));
    for (int k = 0; k < steps; k++)
        (r[EULER] ? euler : runge_kutta)(self, h / steps);
    self->time += h;
    draw(self);
    return fmi2OK;
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Status fmi2SetDebugLogging(void) { return fmi2OK; }

#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(GetInteger) ABSENT(SetInteger) ABSENT(GetBoolean) ABSENT(SetBoolean) ABSENT(GetString) ABSENT(SetString)
ABSENT(GetFMUstate) ABSENT(SetFMUstate) ABSENT(FreeFMUstate) ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate)
ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative) ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives)
ABSENT(CancelStep) ABSENT(GetStatus) ABSENT(GetRealStatus) ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
