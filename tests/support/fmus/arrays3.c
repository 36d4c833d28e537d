/* Two states, in an array, that follow the elements of an input: x1' = u1 + 2 u2 + 0.5 u3 - x1, x2' = u2 - 2 x2, with the outputs
   y1 = x1 + 0.1 u3 and y2 = x2. FMI 3.0, model exchange. */

#include <stdlib.h>
#include <string.h>

#include "fmi3FunctionTypes.h"

#define EXPORT __attribute__((visibility("default")))

typedef struct {
    double u[3], x[2], rates[2], y[2]; /* by value reference */
} Arrays;

static void start(Arrays *self) {
    memset(self, 0, sizeof *self);
    self->u[2] = 0.7;
}

static void evaluate(Arrays *self) {
    const double *const u = self->u, *const x = self->x;
    self->rates[0] = u[0] + 2.0 * u[1] + 0.5 * u[2] - x[0];
    self->rates[1] = u[1] - 2.0 * x[1];
    self->y[0] = x[0] + 0.1 * u[2];
    self->y[1] = x[1];
}

static double *values_of(Arrays *self, fmi3ValueReference reference) {
    double *const all[] = {self->u, self->x, self->rates, self->y};
    return all[reference];
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                                 fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                                 fmi3LogMessageCallback logger) {
    Arrays *const self = malloc(sizeof *self);
    start(self);
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }
EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean d, fmi3Float64 tolerance, fmi3Float64 start_time,
                                              fmi3Boolean s, fmi3Float64 stop_time) {
    return fmi3OK;
}
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { return start(c), fmi3OK; }

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t m) {
    evaluate(c);
    for (size_t i = 0; i < n; i++) {
        const size_t count = vr[i] == 0 ? 3 : 2;
        memcpy(values, values_of(c, vr[i]), count * sizeof *values);
        values += count;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t m) {
    for (size_t i = 0; i < n; i++) {
        const size_t count = vr[i] == 0 ? 3 : 2;
        memcpy(values_of(c, vr[i]), values, count * sizeof *values);
        values += count;
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance c) { return fmi3OK; }
EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return fmi3OK; }
EXPORT fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals,
                                           fmi3Boolean *values, fmi3Boolean *defined, fmi3Float64 *when) {
    *again = *end = *nominals = *values = *defined = fmi3False;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { return fmi3OK; }

EXPORT fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    return memcpy(((Arrays *)c)->x, x, n * sizeof *x), fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    return memcpy(x, ((Arrays *)c)->x, n * sizeof *x), fmi3OK;
}

EXPORT fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 rates[], size_t n) {
    evaluate(c);
    return memcpy(rates, ((Arrays *)c)->rates, n * sizeof *rates), fmi3OK;
}
