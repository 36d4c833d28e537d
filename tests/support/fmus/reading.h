/* A lag, x' = (u - x) / T, exact for a held input, with a solver that must not be disturbed: what FMI 2.0 and 3.0 share.
   FMI allows no reading between the setting of an input and the step. Who does it all the same gets an error (`strict` = 1), or
   finds that the next step goes nowhere (`strict` = 0), as solvers of other tools are disturbed by it, without a word.
   With `strict` = 2 it refuses steps that are not as long as its first one, to the bit. With `strict` = 3 the solver gets a value of
   u where it is set in Step Mode and differs from what it was set to before, as Dymola 2023x does it. With `strict` = 4 it also refuses a u
   outside of its bounds, whenever it is set. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))
#define TIME_CONSTANT 0.5
#define LOWEST -1.0
#define HIGHEST 5.0

enum { U, X, THROUGH, LOAD, COUNT_IN, COUNT_OUT, STRICT, CLOCK, SIZE }; /* value references; CLOCK is FMI 3.0's time */

typedef struct {
    double value[SIZE];
    double steps, first_step, solver_u;
    double stop; /* time */
    int event_mode;
    int stepping; /* initialized, and not in event mode */
    int set;      /* an input has been set since the last step */
    int disturbed;
} Lag;

static Lag *make(void) { return calloc(1, sizeof(Lag)); }

static void evaluate(Lag *self) {
    double *v = self->value;
    v[THROUGH] = v[X] + v[U];
    v[LOAD] = v[X] * v[U];
    v[COUNT_OUT] = v[COUNT_IN] + self->steps;
}

/* 0 if the value is refused. */
static int set(Lag *self, unsigned reference, double value) {
    if (reference == U && self->value[STRICT] == 4.0 && !(value >= LOWEST && value <= HIGHEST))
        return 0;
    if (reference == U && self->stepping && value != self->value[U])
        self->solver_u = value;
    self->value[reference] = value;
    return self->set = 1;
}

static void initialized(Lag *self) { self->stepping = !self->event_mode, self->set = 0, self->solver_u = self->value[U]; }

static void reset(Lag *self) {
    int event_mode = self->event_mode;
    memset(self, 0, sizeof *self);
    self->event_mode = event_mode;
}

/* 0 where it may not be read. */
static int readable(Lag *self) {
    if (self->stepping && self->set) {
        self->disturbed = 1;
        if (self->value[STRICT] == 1.0)
            return 0;
    }
    if (!(self->stepping && self->set))
        evaluate(self); /* else the values stay what they were */
    return 1;
}

/* 0 if the step is refused. */
static int step(Lag *self, double t, double h) {
    double *v = self->value;
    if (v[STRICT] == 5.0 && t + h > self->stop)
        return 0;
    if (self->steps == 0.0)
        self->first_step = h;
    if (v[STRICT] == 2.0 && h != self->first_step)
        return 0;
    if (!self->disturbed) {
        double u = v[STRICT] >= 3.0 ? self->solver_u : v[U];
        v[X] = u + (v[X] - u) * exp(-h / TIME_CONSTANT);
        self->steps += 1.0;
    }
    self->set = self->disturbed = 0;
    evaluate(self);
    return 1;
}

static void *saved(const Lag *self) {
    Lag *copy = make();
    *copy = *self;
    return copy;
}
