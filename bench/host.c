/* A host for co-simulation FMUs: sets an input, steps and gets an output many times, and tells the seconds per step.

   host STEP STEPS ROUNDS PYTHON {VERSION LIBRARY TOKEN RESOURCES INPUT OUTPUT PASSES} ...

   VERSION is 2 or 3; RESOURCES is a URI for FMI 2, a path for FMI 3; INPUT and OUTPUT are value references of real
   scalars, INPUT -1 for none. The FMUs take turns: in each round every one does PASSES passes of STEPS steps. Each pass
   has an instance of its own, and only its steps are timed; a pass before all others warms up. All outputs of all passes
   of an FMU have to be equal. PYTHON is a library to be made global before, for wrappers that look for Python's symbols
   in their host, or "-"; with KEEP_THREAD_STATE in the environment this thread keeps a thread state. Prints a line for each FMU: seconds per step in the median pass, the last output, and the sum of
   all outputs (both hexadecimal). */

#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

typedef struct {
    int version;
    void *library;
    const char *token, *resources;
    int input, output, passes;
    double step;
    int steps;
    const double *in; /* one value for each step, as all below */
    double *out, *first;
    double *taken; /* seconds of each pass */
    int done;      /* passes */
} Run;

static void fail(const char *what, const char *why) {
    fprintf(stderr, "host: %s: %s\n", what, why);
    exit(1);
}

static void check(int status, const char *call) {
    char text[32];
    snprintf(text, sizeof text, "status %d", status);
    if (status) fail(call, text);
}

static void *open_library(const char *path, int flags) {
    void *library = dlopen(path, RTLD_NOW | flags);
    if (!library) fail("dlopen", dlerror());
    return library;
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (!found) fail("dlsym", dlerror());
    return found;
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void log_fmi2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                     fmi2String message, ...) {
    (void)environment, (void)category;
    if (status == fmi2OK) return;
    va_list values;
    va_start(values, message);
    fprintf(stderr, "%s: ", name);
    vfprintf(stderr, message, values);
    fputc('\n', stderr);
    va_end(values);
}

static void log_fmi3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)category;
    if (status != fmi3OK) fprintf(stderr, "%s\n", message);
}

#define FMI2(Name) fmi2##Name##TYPE *Name = (fmi2##Name##TYPE *)symbol(run->library, "fmi2" #Name)
#define FMI3(Name) fmi3##Name##TYPE *Name = (fmi3##Name##TYPE *)symbol(run->library, "fmi3" #Name)

/* One pass over a new instance of FMI 2.0; returns the seconds that its steps took. */
static double pass_fmi2(const Run *run) {
    FMI2(Instantiate); FMI2(SetupExperiment); FMI2(EnterInitializationMode); FMI2(ExitInitializationMode);
    FMI2(SetReal); FMI2(DoStep); FMI2(GetReal); FMI2(Terminate); FMI2(FreeInstance);
    static const fmi2CallbackFunctions callbacks = {log_fmi2, calloc, free, 0, 0};
    fmi2Component c = Instantiate("bench", fmi2CoSimulation, run->token, run->resources, &callbacks, fmi2False, fmi2False);
    if (!c) fail("fmi2Instantiate", "no instance");
    check(SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0), "fmi2SetupExperiment");
    check(EnterInitializationMode(c), "fmi2EnterInitializationMode");
    check(ExitInitializationMode(c), "fmi2ExitInitializationMode");
    const fmi2ValueReference input = (fmi2ValueReference)run->input, output = (fmi2ValueReference)run->output;
    const size_t inputs = run->input >= 0;
    int status = 0;
    double begin = seconds();
    for (int i = 0; i < run->steps && !status; i++) {
        if (inputs) status |= SetReal(c, &input, inputs, &run->in[i]);
        status |= DoStep(c, i * run->step, run->step, fmi2True);
        status |= GetReal(c, &output, 1, &run->out[i]);
    }
    double taken = seconds() - begin;
    check(status, "set, step and get");
    check(Terminate(c), "fmi2Terminate");
    FreeInstance(c);
    return taken;
}

/* One pass over a new instance of FMI 3.0, without event mode. */
static double pass_fmi3(const Run *run) {
    FMI3(InstantiateCoSimulation); FMI3(EnterInitializationMode); FMI3(ExitInitializationMode);
    FMI3(SetFloat64); FMI3(DoStep); FMI3(GetFloat64); FMI3(Terminate); FMI3(FreeInstance);
    fmi3Instance c = InstantiateCoSimulation("bench", run->token, run->resources, fmi3False, fmi3False, fmi3False, fmi3False, 0, 0, 0,
                                             log_fmi3, 0);
    if (!c) fail("fmi3InstantiateCoSimulation", "no instance");
    check(EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0), "fmi3EnterInitializationMode");
    check(ExitInitializationMode(c), "fmi3ExitInitializationMode");
    const fmi3ValueReference input = (fmi3ValueReference)run->input, output = (fmi3ValueReference)run->output;
    const size_t inputs = run->input >= 0;
    fmi3Boolean event, terminate, early;
    fmi3Float64 reached;
    int status = 0;
    double begin = seconds();
    for (int i = 0; i < run->steps && !status; i++) {
        if (inputs) status |= SetFloat64(c, &input, inputs, &run->in[i], 1);
        status |= DoStep(c, i * run->step, run->step, fmi3True, &event, &terminate, &early, &reached);
        status |= GetFloat64(c, &output, 1, &run->out[i], 1);
    }
    double taken = seconds() - begin;
    check(status, "set, step and get");
    check(Terminate(c), "fmi3Terminate");
    FreeInstance(c);
    return taken;
}

static int ascending(const void *a, const void *b) {
    double difference = *(const double *)a - *(const double *)b;
    return (difference > 0.0) - (difference < 0.0);
}

static void *numbers(int count) {
    void *memory = count > 0 ? calloc((size_t)count, sizeof(double)) : 0;
    if (!memory) fail("arguments", "STEPS, ROUNDS and PASSES must be at least 1");
    return memory;
}

static Run prepare(char **word, double step, int steps, int rounds, const double *in) {
    Run run = {atoi(word[0]), open_library(word[1], RTLD_LOCAL), word[2], word[3], atoi(word[4]), atoi(word[5]), atoi(word[6]),
               step, steps, in, numbers(steps), numbers(steps), 0, 0};
    run.taken = numbers(run.passes * rounds);
    return run;
}

static double pass(const Run *run) { return run->version == 3 ? pass_fmi3(run) : pass_fmi2(run); }

static void take_turn(Run *run) {
    for (int k = 0; k < run->passes; k++) {
        run->taken[run->done++] = pass(run);
        if (memcmp(run->first, run->out, sizeof(double) * (size_t)run->steps)) fail("passes", "the outputs of two passes differ");
    }
}

static void report(Run *run) {
    double sum = 0.0;
    for (int i = 0; i < run->steps; i++) sum += run->out[i];
    qsort(run->taken, (size_t)run->done, sizeof *run->taken, ascending);
    printf("%.9g %a %a\n", run->taken[run->done / 2] / run->steps, run->out[run->steps - 1], sum);
}

/* Python makes a thread state for a thread that calls it, and deletes it when the call ends. pythonfmu's wrapper would pay
   for this in every call, several times what the component costs; a thread that has a state already is spared it. */
static void keep_thread_state(void *python) {
    ((int (*)(void))symbol(python, "PyGILState_Ensure"))();
    ((void *(*)(void))symbol(python, "PyEval_SaveThread"))();
}

enum { COMMON = 5, EACH = 7, MOST = 8 };

int main(int count, char **word) {
    int runs = (count - COMMON) / EACH;
    if (runs < 1 || runs > MOST || count != COMMON + EACH * runs)
        fail("arguments", "STEP STEPS ROUNDS PYTHON {VERSION LIBRARY TOKEN RESOURCES INPUT OUTPUT PASSES} ...");
    int steps = atoi(word[2]), rounds = atoi(word[3]);
    double *in = numbers(steps);
    for (int i = 0; i < steps; i++) in[i] = sin(0.01 * i);
    void *python = strcmp(word[4], "-") ? open_library(word[4], RTLD_GLOBAL) : 0;
    Run run[MOST];
    for (int k = 0; k < runs; k++) {
        run[k] = prepare(word + COMMON + EACH * k, atof(word[1]), steps, rounds, in);
        pass(&run[k]);
        memcpy(run[k].first, run[k].out, sizeof(double) * (size_t)steps);
    }
    if (python && getenv("KEEP_THREAD_STATE")) keep_thread_state(python);
    for (int round = 0; round < rounds; round++)
        for (int k = 0; k < runs; k++) take_turn(&run[k]);
    for (int k = 0; k < runs; k++) report(&run[k]);
    return 0;
}
