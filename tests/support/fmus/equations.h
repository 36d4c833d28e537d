/* Systems of differential equations with events, for model exchange of FMI 2.0 and 3.0: what both share. The parameter `model`
   says which. They have two states (the last model none), two event indicators, an input u, and an output y. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

/* Value references; the states' and their derivatives' are one after the other. */
enum { U, Y, X, DX = X + 2, MODEL = DX + 2, P, Q, COUNT, EVENTS, COMPLETED, D, REALS };

enum model {
    DECAY,      /* x1' = -p (x1 - u), x2' = 1 */
    BALL,       /* x1 falls from 1 with 9.81 m/s2; where it meets 0 its speed x2 becomes -p x2; below the speed q it lies */
    SINGULAR,   /* x1' = sqrt(p - t): no number after p */
    EXPLODING,  /* x1' = x1 x1 from p on: infinite at 1 / p */
    RELAY,      /* x1' = -sign(x1) with x1 = p at first: slides, without an end of events */
    CLOCKED,    /* x1' = count; every p seconds a time event, which counts */
    COMPLETING, /* x1' = 1; asks for an event in the first completed step after x1 > p, which counts and sets x1 to 0 */
    REFUSING,   /* as DECAY with p = 1, but discards the derivatives where x1 > q */
    FAILING,    /* as DECAY, but fails in the derivatives from t = p on, with a message */
    ENDING,     /* as DECAY, but asks to end in the update at the time event at p */
    TWO_SIDED,  /* x1' = u; event indicator x1 - p, whose event counts; y follows u at once, too: y = x1 + q u */
    ENDLESS,    /* as DECAY, but asks for another update again and again at the time event at p */
    TIMER,      /* no states: the event indicator t - p, whose event counts */
    SWITCHING,  /* x1' = 1; event indicator x1 - p, whose event makes y and the count 1 */
    SWITCHED,   /* x1' = 1 where u > p; event indicator u - p, whose event makes y and the count 1 or 0 */
    FOLLOWING,  /* x1' = count; an event makes the count d, and is counted if that is another */
    SECRET,     /* as DECAY, but does not tell its input */
    LATE,       /* as DECAY, but computes derivatives only where they are asked for as such, and y where a step is completed */
    SOON,       /* x1' = count; a time event at p, which tells the next one to be at once, at t (1 + q), until three are counted */
    CUBIC,      /* x1' = u - x1 with x1 = p at first; y = x1 - u u u */
    UNREADABLE, /* as DECAY; no value can be read where x1 > q */
    WIDE,       /* as DECAY, but writes six event indicators, however many it is asked for */
    MODELS
};

typedef struct {
    double r[REALS];
    double time, next_event;
    int resting, side, wants;
    double known_side; /* of the first event indicator's */
    void *callbacks, *environment, *logger;
    char name[64];
    int in_events, in_continuous_time;
} Equations;

static int is(const Equations *self, enum model model) { return self->r[MODEL] == (double)model; }

static void start(Equations *self) {
    memset(self->r, 0, sizeof self->r);
    self->r[P] = 1.0;
    self->time = 0.0;
    self->next_event = INFINITY;
    self->resting = self->side = self->wants = self->in_events = self->in_continuous_time = 0;
}

static Equations *make(const char *name) {
    Equations *self = calloc(1, sizeof *self);
    snprintf(self->name, sizeof self->name, "%s", name);
    start(self);
    return self;
}

/* At the end of initialization. */
static void begin(Equations *self) {
    double *const r = self->r, *const x = r + X;
    if (is(self, BALL)) x[0] = 1.0;
    if (is(self, EXPLODING) || is(self, RELAY) || is(self, CUBIC)) x[0] = r[P];
    if (is(self, CLOCKED) || is(self, SOON) || is(self, ENDING) || is(self, ENDLESS)) self->next_event = r[P];
    self->side = is(self, RELAY) ? x[0] > 0.0 : 0;
    self->in_events = 1;
}

static int states(const Equations *self) { return is(self, TIMER) ? 0 : 2; }

/* 0, or 2 (discarded) or 3 (failed). */
static int derive(Equations *self) {
    double *const r = self->r, *const x = r + X, *const dx = r + DX;
    dx[0] = -r[P] * (x[0] - r[U]);
    dx[1] = 1.0;
    if (is(self, BALL)) dx[0] = self->resting ? 0.0 : x[1], dx[1] = self->resting ? 0.0 : -9.81;
    if (is(self, SINGULAR)) dx[0] = sqrt(r[P] - self->time);
    if (is(self, EXPLODING)) dx[0] = x[0] * x[0];
    if (is(self, RELAY)) dx[0] = self->side ? -1.0 : 1.0;
    if (is(self, CLOCKED)) dx[0] = r[COUNT];
    if (is(self, COMPLETING)) dx[0] = 1.0;
    if (is(self, REFUSING)) {
        dx[0] = -(x[0] - r[U]);
        if (x[0] > r[Q]) return 2;
    }
    if (is(self, FAILING) && self->time >= r[P]) return 3;
    if (is(self, TWO_SIDED)) dx[0] = r[U];
    if (is(self, CUBIC)) dx[0] = r[U] - x[0];
    if (is(self, SWITCHING)) dx[0] = 1.0;
    if (is(self, SWITCHED) || is(self, FOLLOWING) || is(self, SOON)) dx[0] = r[COUNT];
    return 0;
}

static int is_unreadable(const Equations *self) { return is(self, UNREADABLE) && self->r[X] > self->r[Q]; }

static void evaluate(Equations *self) {
    self->r[Y] = self->r[X] + (is(self, TWO_SIDED) ? self->r[Q] * self->r[U] : 0.0);
    if (is(self, CUBIC)) self->r[Y] -= pow(self->r[U], 3.0);
    if (is(self, SWITCHING) || is(self, SWITCHED)) self->r[Y] = self->r[COUNT];
}

/* What is read is up to date. */
static void bring_up_to_date(Equations *self) {
    if (is(self, LATE)) return;
    derive(self);
    evaluate(self);
}

static void indicate(const Equations *self, double z[2]) {
    const double *const r = self->r;
    z[0] = z[1] = 1.0;
    if (is(self, BALL) && !self->resting) z[0] = r[X];
    if (is(self, RELAY)) z[0] = r[X];
    if (is(self, TWO_SIDED)) z[1] = r[X] - r[P];
    if (is(self, TIMER)) z[0] = self->time - r[P];
    if (is(self, SWITCHING)) z[0] = r[X] - r[P];
    if (is(self, SWITCHED)) z[0] = r[U] - r[P];
}

/* Writes event indicators, of which n are wanted. */
static void give_indicators(const Equations *self, double *z, size_t n) {
    double found[6] = {0.0, 0.0, 1.0, 1.0, 1.0, 1.0};
    indicate(self, found);
    memcpy(z, found, (is(self, WIDE) ? 6 : n) * sizeof *z);
}

/* An event: 0, or 1 if another update is wanted, or 2 to end. */
static int update(Equations *self) {
    double *const r = self->r, *const x = r + X;
    const int timed = self->time >= self->next_event - 1e-12;
    if (is(self, BALL) && !self->resting && x[0] <= 0.0 && x[1] < 0.0) {
        r[EVENTS] += 1.0;
        x[0] = 0.0;
        x[1] = -r[P] * x[1];
        if (x[1] < r[Q]) self->resting = 1, x[1] = 0.0;
    }
    if (is(self, RELAY) && (x[0] > 0.0) != self->side) {
        self->side = x[0] > 0.0;
        r[EVENTS] += 1.0;
    }
    if (is(self, TWO_SIDED) && (x[0] >= r[P]) != self->side) {
        self->side = x[0] >= r[P];
        r[EVENTS] += 1.0;
        r[COUNT] = self->time;
    }
    if (is(self, TIMER) && (self->time >= r[P]) != self->side) {
        self->side = self->time >= r[P];
        r[EVENTS] += 1.0;
        r[COUNT] = self->time;
    }
    const double followed = is(self, SWITCHING)  ? (double)(x[0] >= r[P])
                            : is(self, SWITCHED) ? (double)(r[U] > r[P])
                            : is(self, FOLLOWING) ? r[D]
                                                  : r[COUNT];
    if (followed != r[COUNT]) {
        r[COUNT] = followed;
        r[EVENTS] += 1.0;
    }
    if (is(self, SOON) && self->time >= self->next_event) {
        r[COUNT] += 1.0;
        self->next_event = r[COUNT] < 3.0 ? self->time * (1.0 + r[Q]) : INFINITY;
    }
    if (is(self, CLOCKED) && timed) {
        r[COUNT] += 1.0;
        self->next_event = r[P] * (r[COUNT] + 1.0);
    }
    if (is(self, COMPLETING) && self->wants) {
        self->wants = 0;
        r[COUNT] += 1.0;
        r[Q] = self->time;
        x[0] = 0.0;
    }
    if (is(self, ENDING) && timed) return 2;
    return is(self, ENDLESS) && timed;
}

static int complete(Equations *self) {
    self->r[COMPLETED] += 1.0;
    evaluate(self);
    if (is(self, COMPLETING) && self->r[X] > self->r[P]) self->wants = 1;
    return self->wants;
}
