/* An FMU that fails in the call that its parameter `fault` names, from `fault_time` on, with `status`: what FMI 2.0 and 3.0
   share. Its instance "null" cannot be instantiated and its instance "setup" fails in the first call; in FMI 2.0
   its instance "stranger" logs with an environment that is not its host's. */

#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define EXPORT __attribute__((visibility("default")))
#define TOKEN "{faulty}"

enum fault {
    NONE, SETUP, ENTER_INITIALIZATION, EXIT_INITIALIZATION, SET_REAL, SET_INTEGER, SET_BOOLEAN, GET_REAL, GET_INTEGER,
    GET_BOOLEAN, STEP, RESET, ENTER_EVENT, ENTER_STEP, UPDATE, ENDLESS, TERMINATE_IN_UPDATE, TERMINATE_IN_STEP, EARLY, NOT_A_NUMBER,
    INFINITE, HUGE_VALUE, PERCENT, SILENT, SLOW, NEVER
};

/* Value references; those after SCALARS are of FMI 3.0 alone. */
enum { INPUT, OUTPUT, FAULT_TIME, COUNT_IN, COUNT_OUT, FAULT, STATUS, FLAG_IN, FLAG_OUT, SCALARS, SMALL, SINGLE, TIME };

typedef struct {
    double reals[3];   /* input, output, fault_time */
    int integers[4];   /* count_in, count_out, fault, status */
    int flags[2];      /* flag_in, flag_out */
    unsigned char small;
    float single;
    double time;
    int event_mode;
    void *environment, *logger;
    const void *callbacks;
    char name[64];
} Faulty;

/* Whether an instance is called so, whatever is before a dot. */
static int is_called(const char *name, const char *wanted) {
    const char *dot = strrchr(name, '.');
    return strcmp(dot ? dot + 1 : name, wanted) == 0;
}

static void say(Faulty *self, int status, const char *text);

static void start(Faulty *self) {
    memset(self->reals, 0, sizeof self->reals);
    memset(self->integers, 0, sizeof self->integers);
    memset(self->flags, 0, sizeof self->flags);
    self->small = 0, self->single = 0.0f, self->time = 0.0;
}

/* The status of a call, with a message if it is not OK. */
static int judged(Faulty *self, enum fault here, const char *function) {
    char text[128];
    enum fault fault = (enum fault)self->integers[2];
    int aimed = fault == here || (here == STEP && (fault == PERCENT || fault == SILENT));
    if (!aimed || self->time < self->reals[2] - 1e-9)
        return 0;
    if (fault == PERCENT)
        say(self, self->integers[3], "a load of 100%s%n is too much");
    else if (fault != SILENT) {
        snprintf(text, sizeof text, "%s goes wrong as told", function);
        say(self, self->integers[3], text);
    }
    return self->integers[3];
}

/* The output counts the steps and adds up the input; the integer counts, too; the boolean is turned round. */
static void advance(Faulty *self, double h) {
    enum fault fault = (enum fault)self->integers[2];
    int now;
    if (fault == SLOW) {
        struct timespec pause = {0, 20000000};
        nanosleep(&pause, NULL);
    }
    self->time += h;
    now = self->time >= self->reals[2] - 1e-9;
    self->reals[1] += 1.0 + self->reals[0];
    if (fault == NOT_A_NUMBER && now)
        self->reals[1] = NAN;
    if (fault == INFINITE && now)
        self->reals[1] = INFINITY;
    if (fault == HUGE_VALUE && now)
        self->reals[1] = 1e300;
    self->integers[1] += 100;
    self->flags[1] = !self->flags[0];
}

static int is_now(Faulty *self, enum fault fault) {
    return self->integers[2] == (int)fault && self->time >= self->reals[2] - 1e-9;
}

static void let_go(Faulty *self) {
    if (self->integers[2] == SLOW) {
        fputs("freed\n", stderr);
        fflush(stderr);
    }
    free(self);
}
