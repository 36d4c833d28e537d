/* A native FMU's library and its functions, on every platform. */

#ifndef LIBRARY_H
#define LIBRARY_H

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define SYMBOL(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#define REASON() (printf("error %lu\n", GetLastError()), "see above")
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define SYMBOL(library, name) dlsym(library, name)
#define REASON() dlerror()
#endif

static inline void *open_library(const char *path) {
    void *library = OPEN(path);
    if (!library) fprintf(stderr, "%s cannot be loaded: %s\n", path, REASON()), exit(2);
    return library;
}

static inline void *symbol_of(void *library, const char *name) {
    void *found = SYMBOL(library, name);
    if (!found) fprintf(stderr, "%s is missing\n", name), exit(2);
    return found;
}

/* GET(fmi2DoStep) is that function of `library`, with its type. */
#define GET(name) ((name##TYPE *)symbol_of(library, #name))

#define MUST(call) \
    do { \
        int status_ = (int)(call); \
        if (status_) fprintf(stderr, "%s: status %d\n", #call, status_), exit(3); \
    } while (0)

static void log2_message(void *environment, const char *instance, fmi2Status status, const char *category, const char *text, ...) {
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, text);
    fprintf(stderr, "message: "), vfprintf(stderr, text, arguments), fprintf(stderr, "\n");
    va_end(arguments);
}

static void log3_message(void *environment, fmi3Status status, const char *category, const char *text) {
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "message: %s\n", text);
}

static const fmi2CallbackFunctions CALLBACKS2 = {log2_message, 0, 0, 0, 0};

/* A co-simulation instance of FMI 2 or 3. */
static inline void *new_fmu(void *library, int fmi, const char *token) {
    void *made = fmi == 2 ? GET(fmi2Instantiate)("one", fmi2CoSimulation, token, "", &CALLBACKS2, 0, 0)
                          : GET(fmi3InstantiateCoSimulation)("one", token, "", 0, 0, 0, 0, 0, 0, 0, log3_message, 0);
    if (!made) fprintf(stderr, "no instance\n"), exit(3);
    return made;
}

static inline void begin(void *library, int fmi, void *fmu) {
    if (fmi == 2) {
        MUST(GET(fmi2SetupExperiment)(fmu, 0, 0.0, 0.0, 0, 0.0));
        MUST(GET(fmi2EnterInitializationMode)(fmu));
    } else
        MUST(GET(fmi3EnterInitializationMode)(fmu, 0, 0.0, 0.0, 0, 0.0));
}

static inline void end_begin(void *library, int fmi, void *fmu) {
    if (fmi == 2)
        MUST(GET(fmi2ExitInitializationMode)(fmu));
    else
        MUST(GET(fmi3ExitInitializationMode)(fmu));
}

static inline int step_fmu(void *library, int fmi, void *fmu, double t, double h) {
    fmi3Boolean event, end, early;
    double last;
    return fmi == 2 ? (int)GET(fmi2DoStep)(fmu, t, h, 1) : (int)GET(fmi3DoStep)(fmu, t, h, 1, &event, &end, &early, &last);
}

/* Set or get one real variable with n elements; FMI 2 has one reference for each. */
static inline void reals(void *library, int fmi, void *fmu, int set, unsigned reference, size_t n, double *values) {
    if (fmi == 3) {
        MUST(set ? GET(fmi3SetFloat64)(fmu, &reference, 1, values, n) : GET(fmi3GetFloat64)(fmu, &reference, 1, values, n));
        return;
    }
    for (unsigned i = 0; i < n; i++) {
        unsigned one = reference + i;
        MUST(set ? GET(fmi2SetReal)(fmu, &one, 1, values + i) : GET(fmi2GetReal)(fmu, &one, 1, values + i));
    }
}

#endif
