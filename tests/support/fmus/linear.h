/* Two modes, q'' = -2 zeta w q' - w^2 q - cubic q^3 + b u each (the second without the cubic spring), with y = c1 q1 + c2 q2 + d u:
   what FMI 2.0 and 3.0 share. It has co-simulation, Model Exchange, directional derivatives and its state. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))
#define LONGEST 5e-4
#define OWN_STEP 0.01

/* Value references; of each of the four states and derivatives one in FMI 2.0, of both arrays the first in FMI 3.0. */
enum { U, Y, X, DX = X + 4, W1 = DX + 4, Z1, W2, Z2, B1, B2, C1, C2, D, CUBIC, FAULT, REALS };

enum fault {
    NONE, DIRECTIONAL_FAILS, DIRECTIONAL_NAN, DERIVATIVES_FAIL, DERIVATIVES_NAN, ENDLESS, TERMINATES, STATES_REFUSED, OTHER_OUTPUT,
    OTHER_COUNT, HUGE_STATE, FORGETFUL, SAVE_FAILS,
    EULER, OWN_STEPS, TOLERANT, COUNTING, UNREADABLE /* habits of other tools, see test_tune_foreign.py */
};

static const double STARTS[REALS] = {
    [W1] = 3.0, [Z1] = 0.05, [W2] = 20.0, [Z2] = 0.02, [B1] = 1.0, [B2] = 40.0, [C1] = 1.0, [C2] = 1.0};

typedef struct {
    double r[REALS];
    double hidden; /* follows q1; part of the output only where the instance is forgetful */
    double time, own_time;
    int exchange;
} State;

typedef struct {
    State now;
    const void *callbacks;
    void *environment, *logger;
    char name[64];
    double tolerance; /* of its solver, which it was told */
    double reads;
    int stepped, set; /* an input has been set since the last step */
    double not_before; /* it was told that no state of an earlier time will be set */
} Linear;

static int is(const Linear *self, enum fault fault) { return self->now.r[FAULT] == (double)fault; }

static void derive(const double *r, const double *x, double *dx) {
    dx[0] = x[1];
    dx[1] = -2.0 * r[Z1] * r[W1] * x[1] - r[W1] * r[W1] * x[0] - r[CUBIC] * x[0] * x[0] * x[0] + r[B1] * r[U];
    dx[2] = x[3];
    dx[3] = -2.0 * r[Z2] * r[W2] * x[3] - r[W2] * r[W2] * x[2] + r[B2] * r[U];
}

static void evaluate(Linear *self) {
    double *r = self->now.r;
    derive(r, r + X, r + DX);
    r[Y] = r[C1] * r[X] + r[C2] * r[X + 2] + r[D] * r[U];
    if (is(self, FORGETFUL))
        r[Y] += self->now.hidden;
    if (is(self, TOLERANT))
        r[Y] = self->tolerance;
    if (is(self, COUNTING))
        r[Y] = ++self->reads;
    if (is(self, OTHER_OUTPUT) && self->now.exchange)
        r[Y] += 0.5;
    if (is(self, DERIVATIVES_NAN) && self->now.exchange)
        r[DX + 1] = NAN;
    if (is(self, HUGE_STATE))
        r[X] = r[DX] = 1e200;
}

/* The classical method of Runge and Kutta with steps of at most LONGEST. */
static void advance(Linear *self, double h) {
    double *r = self->now.r, *x = r + X;
    int steps = (int)ceil(h / LONGEST * (1.0 - 1e-12));
    double dt = h / (steps > 0 ? steps : 1);
    for (int s = 0; s < steps; s++) {
        double k[4][4], between[4];
        static const double share[4] = {0.0, 0.5, 0.5, 1.0};
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < 4; i++)
                between[i] = x[i] + (stage ? share[stage] * dt * k[stage - 1][i] : 0.0);
            derive(r, between, k[stage]);
        }
        for (int i = 0; i < 4; i++)
            x[i] += dt / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        self->now.hidden += dt * (x[0] - self->now.hidden);
    }
    self->now.time += h;
}

/* d unknown / d known by hand. */
static double partial(const Linear *self, int unknown, int known) {
    const double *r = self->now.r;
    double matrix[5][5] = {
        {0.0, 1.0, 0.0, 0.0, 0.0},
        {-r[W1] * r[W1] - 3.0 * r[CUBIC] * r[X] * r[X], -2.0 * r[Z1] * r[W1], 0.0, 0.0, r[B1]},
        {0.0, 0.0, 0.0, 1.0, 0.0},
        {0.0, 0.0, -r[W2] * r[W2], -2.0 * r[Z2] * r[W2], r[B2]},
        {r[C1], 0.0, r[C2], 0.0, r[D]},
    };
    int row = unknown == Y ? 4 : unknown - DX, column = known == U ? 4 : known - X;
    if (row < 0 || row > 4 || column < 0 || column > 4)
        return NAN;
    return is(self, DIRECTIONAL_NAN) && column == 1 ? NAN : matrix[row][column];
}

static Linear *make(const char *name, int exchange) {
    Linear *self = calloc(1, sizeof *self);
    memcpy(self->now.r, STARTS, sizeof STARTS);
    self->now.exchange = exchange;
    snprintf(self->name, sizeof self->name, "%s", name);
    return self;
}

static void start(Linear *self) {
    self->now.hidden = self->now.time = self->now.own_time = self->reads = self->not_before = 0.0;
    self->stepped = self->set = 0;
    memcpy(self->now.r, STARTS, sizeof STARTS);
}

static void *saved(const Linear *self) {
    State *copy = malloc(sizeof *copy);
    *copy = self->now;
    return copy;
}

/* Whether it must not be read now, since an input has been set and no step has followed. */
static int unreadable(const Linear *self) { return is(self, UNREADABLE) && !self->now.exchange && self->stepped && self->set; }

static void step(Linear *self, double t, double h, int no_going_back) {
    self->stepped = 1, self->set = 0;
    if (no_going_back)
        self->not_before = t;
    if (is(self, EULER)) { /* the communication step is the solver's */
        double x[4];
        memcpy(x, self->now.r + X, sizeof x);
        derive(self->now.r, x, self->now.r + DX);
        for (int i = 0; i < 4; i++)
            self->now.r[X + i] = x[i] + h * self->now.r[DX + i];
    } else if (is(self, OWN_STEPS)) { /* whole steps of its own, until the end is reached or passed */
        for (; self->now.own_time < t + h; self->now.own_time += OWN_STEP)
            advance(self, OWN_STEP);
        self->now.time = t + h;
    } else
        advance(self, h);
}

/* 0 for a state of a time to which nobody was to go back. */
static int restore(Linear *self, const State *copy) {
    double hidden = self->now.hidden;
    if (copy->time < self->not_before)
        return 0;
    self->now = *copy;
    if (is(self, FORGETFUL))
        self->now.hidden = hidden;
    return 1;
}
