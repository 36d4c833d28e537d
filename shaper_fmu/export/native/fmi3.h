/* What the files of the FMI 3.0 layer share. */

#ifndef FMI3_LAYER_H
#define FMI3_LAYER_H

#include "component.h"
#include "fmi3Functions.h"

#define READABLE (INITIALIZING | STEPPING | EVENT | CONTINUOUS | INTERMEDIATE | TERMINATED | FAILED)
#define WRITABLE (INSTANTIATED | INITIALIZING | STEPPING | EVENT | CONTINUOUS)
#define ANY (READABLE | WRITABLE)
#define BETWEEN_CALLS (ANY & ~INTERMEDIATE)
#define REQUIRE(phases) \
    Instance *self = (Instance *)instance; \
    if (!allowed(self, __func__, phases)) return fmi3Error

INTERNAL const Variable *find_variable(Instance *, fmi3ValueReference vr, int kinds, const char *type);

#endif
