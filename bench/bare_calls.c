/* The calls of a macro step and nothing else: a library that does them by address, with the arguments that a master found.

   Like the compiled master it sets all inputs, steps all instances, and reads all outputs; every input is read from an
   array instead of from the output that feeds it. */

#include <stddef.h>
#include <time.h>

typedef int Transfer(void *instance, const unsigned *references, size_t count, double *values);
typedef int Step(void *instance, double t, double h, int no_going_back);

typedef struct {
    void *instance;
    Transfer *set, *get; /* set: null without an input */
    Step *step;
    unsigned input, output; /* value references */
    double *in, *out;       /* one value for each step */
} Calls;

/* Of this thread on a processor: both sides have but one thread, and others may take turns with it. */
static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Seconds of a step, or -1 if a call fails. */
double bare_calls(const Calls *calls, int count, int steps, double step) {
    int status = 0;
    double begin = seconds();
    for (int i = 0; i < steps && !status; i++) {
        for (int k = 0; k < count; k++)
            if (calls[k].set) status |= calls[k].set(calls[k].instance, &calls[k].input, 1, &calls[k].in[i]);
        for (int k = 0; k < count; k++) status |= calls[k].step(calls[k].instance, i * step, step, 1);
        for (int k = 0; k < count; k++) status |= calls[k].get(calls[k].instance, &calls[k].output, 1, &calls[k].out[i]);
    }
    double taken = seconds() - begin;
    return status ? -1.0 : taken / steps;
}
