/* FMI 3.0: arrays whose size is a structural parameter: product[i] = factor[i] * input[i], total their sum; mode is an enumeration.

   Like a strict FMU, it takes the size in configuration mode alone, and arrays with all their elements alone; a reset takes the
   size back. Only the functions are there that a master needs. */

#include <stdlib.h>
#include <string.h>

#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define MOST 100

enum { SIZE, INPUT, FACTOR, PRODUCT, TOTAL, MODE, MODE_OUT };

typedef struct {
    int configuring, initializing;
    fmi3UInt64 size;
    fmi3Int64 mode;
    double input[MOST], factor[MOST];
} Sized;

static void start(Sized *self) {
    memset(self, 0, sizeof *self);
    self->size = 3, self->mode = 2;
    for (int i = 0; i < MOST; i++)
        self->factor[i] = i < 2 ? 10.0 + i : 7.0;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
    fmi3Boolean early_return, const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment environment,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Sized *self = malloc(sizeof *self);
    start(self);
    return self;
}

EXPORT void fmi3FreeInstance(fmi3Instance c) { free(c); }
EXPORT fmi3Status fmi3Reset(fmi3Instance c) { start(c); return fmi3OK; }

EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    Sized *self = c;
    if (self->initializing)
        return fmi3Error;
    self->configuring = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { ((Sized *)c)->configuring = 0; return fmi3OK; }

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                              fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
    ((Sized *)c)->initializing = 1;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }

EXPORT fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 values[], size_t n_values) {
    Sized *self = c;
    if (!self->configuring || n != 1 || vr[0] != SIZE || values[0] > MOST)
        return fmi3Error;
    self->size = values[0];
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int64 values[], size_t n_values) {
    if (n != 1 || vr[0] != MODE)
        return fmi3Error;
    ((Sized *)c)->mode = values[0];
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int64 values[], size_t n_values) {
    if (n != 1 || vr[0] != MODE_OUT)
        return fmi3Error;
    values[0] = ((Sized *)c)->mode;
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[], size_t n_values) {
    Sized *self = c;
    if (n_values != n * self->size || self->configuring)
        return fmi3Error;
    for (size_t i = 0; i < n; i++, values += self->size)
        memcpy(vr[i] == INPUT ? self->input : self->factor, values, self->size * sizeof *values);
    return fmi3OK;
}

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[], size_t n_values) {
    Sized *self = c;
    size_t place = 0;
    for (size_t i = 0; i < n; i++) {
        double total = 0.0;
        for (size_t k = 0; k < self->size; k++) {
            if (vr[i] == PRODUCT && place < n_values)
                values[place++] = self->factor[k] * self->input[k];
            total += self->factor[k] * self->input[k];
        }
        if (vr[i] == TOTAL)
            values[place++] = total;
    }
    return place == n_values ? fmi3OK : fmi3Error;
}

EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_going_back, fmi3Boolean *event,
                             fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    *event = *terminate = *early = 0, *last = t + h;
    return fmi3OK;
}
