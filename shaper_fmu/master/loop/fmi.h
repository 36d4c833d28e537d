/* The functions of FMI that the loop calls, by their types.

   FMI 3.0's boolean is C's bool, which must not hold other numbers than 0 and 1; some FMUs write others, so it is a byte here. */

#ifndef FMI_H
#define FMI_H

#include <stddef.h>
#include <stdint.h>

typedef uint8_t Fmi3Boolean;
typedef char Fmi1Boolean;

/* Where a call answers by booleans: those that take C's int for them write four bytes, and must not write over anything else. */
typedef struct {
    Fmi3Boolean flag[5];
    Fmi3Boolean spare[11];
} Answers;

/* fmi3EnterEventMode, fmi3EnterStepMode, fmi2Reset, fmiResetSlave, fmi2EnterInitializationMode and the like */
typedef int SimpleFunction(void *instance);

/* fmi2GetReal, fmi2SetReal and the like, and those of FMI 1.0; fmi3SetClock, fmi3GetClock, and fmi3GetShiftDecimal are called in the same way */
typedef int Fmi2Transfer(void *instance, const uint32_t *references, size_t count, void *values);

/* fmi3GetFloat64 and the like */
typedef int Fmi3Transfer(void *instance, const uint32_t *references, size_t count, void *values, size_t value_count);

typedef int Fmi2SetupExperiment(void *instance, int tolerance_defined, double tolerance, double start, int stop_defined, double stop);

typedef int Fmi3EnterInitializationMode(void *instance, Fmi3Boolean tolerance_defined, double tolerance, double start,
                                        Fmi3Boolean stop_defined, double stop);

typedef int Fmi1InitializeSlave(void *instance, double start, Fmi1Boolean stop_defined, double stop);

typedef int Fmi1DoStep(void *instance, double t, double h, Fmi1Boolean new_step);

/* and that of FMI 1.0 */
typedef int Fmi2SetRealInputDerivatives(void *instance, const uint32_t *references, size_t count, const int32_t *orders,
                                        const double *values);

typedef int Fmi2DoStep(void *instance, double t, double h, int no_going_back);

typedef int Fmi3DoStep(void *instance, double t, double h, Fmi3Boolean no_going_back, Fmi3Boolean *event_needed,
                       Fmi3Boolean *terminate, Fmi3Boolean *early_return, double *reached);

typedef int Fmi3UpdateDiscreteStates(void *instance, Fmi3Boolean *again, Fmi3Boolean *terminate, Fmi3Boolean *nominals_changed,
                                     Fmi3Boolean *values_changed, Fmi3Boolean *event_defined, double *event_time);

typedef int Fmi3GetIntervalDecimal(void *instance, const uint32_t *references, size_t count, double *intervals,
                                   int *qualifiers);

typedef int Fmi3GetIntervalFraction(void *instance, const uint32_t *references, size_t count, uint64_t *counters,
                                    uint64_t *resolutions, int *qualifiers);

typedef int Fmi3GetShiftDecimal(void *instance, const uint32_t *references, size_t count, double *shifts);

typedef int Fmi3GetShiftFraction(void *instance, const uint32_t *references, size_t count, uint64_t *counters,
                                 uint64_t *resolutions);

/* Model exchange */

typedef int FmiSetTime(void *instance, double t);

/* fmi2GetContinuousStates, fmi2GetDerivatives, fmi2GetEventIndicators and the like */
typedef int FmiGetArray(void *instance, double *values, size_t count);

typedef int FmiSetArray(void *instance, const double *values, size_t count);

typedef int Fmi1Completed(void *instance, char *event);

typedef int Fmi2Completed(void *instance, int no_going_back, int32_t *event, int32_t *terminate);

typedef int Fmi3Completed(void *instance, Fmi3Boolean no_going_back, Fmi3Boolean *event, Fmi3Boolean *terminate);

typedef struct {
    char converged;
    char references_changed;
    char values_changed;
    char terminate;
    char event_defined;
    double event_time;
} Fmi1EventInfo;

typedef int Fmi1EventUpdate(void *instance, Fmi1Boolean intermediate, Fmi1EventInfo *info);

typedef int Fmi1Initialize(void *instance, Fmi1Boolean tolerance_controlled, double tolerance, Fmi1EventInfo *info);

typedef struct {
    int32_t again;
    int32_t terminate;
    int32_t nominals_changed;
    int32_t values_changed;
    int32_t event_defined;
    double event_time;
} Fmi2EventInfo;

typedef int Fmi2NewDiscreteStates(void *instance, Fmi2EventInfo *info);

typedef int Fmi2Directional(void *instance, const uint32_t *unknowns, size_t unknown_count, const uint32_t *knowns,
                            size_t known_count, const double *seed, double *sensitivity);

typedef int Fmi3Directional(void *instance, const uint32_t *unknowns, size_t unknown_count, const uint32_t *knowns,
                            size_t known_count, const double *seed, size_t seed_count, double *sensitivity,
                            size_t sensitivity_count);

#endif
