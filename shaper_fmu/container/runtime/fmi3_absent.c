/* FMI 3.0 functions for what a container does not have: clocks outside, model exchange, derivatives, structural parameters. */

#include "container.h"
#include "fmi3Functions.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define ABSENT(Name, ...) \
    fmi3Status fmi3##Name(__VA_ARGS__) { \
        Container *const container = (Container *)instance; \
        if (!allowed(container, __func__, ~LOST)) return fmi3Error; \
        return (fmi3Status)complain(container, ERROR, "%s: %s is not supported", container->name, __func__); \
    }

#define SELF fmi3Instance instance
#define REFERENCES const fmi3ValueReference vr[], size_t n

ABSENT(GetClock, SELF, REFERENCES, fmi3Clock values[])
ABSENT(SetClock, SELF, REFERENCES, const fmi3Clock values[])
ABSENT(GetIntervalDecimal, SELF, REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetIntervalFraction, SELF, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetShiftDecimal, SELF, REFERENCES, fmi3Float64 shifts[])
ABSENT(GetShiftFraction, SELF, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(SetIntervalDecimal, SELF, REFERENCES, const fmi3Float64 intervals[])
ABSENT(SetIntervalFraction, SELF, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(SetShiftDecimal, SELF, REFERENCES, const fmi3Float64 shifts[])
ABSENT(SetShiftFraction, SELF, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(ActivateModelPartition, SELF, fmi3ValueReference clockReference, fmi3Float64 activationTime)
ABSENT(GetNumberOfVariableDependencies, SELF, fmi3ValueReference vr, size_t *n)
ABSENT(GetVariableDependencies, SELF, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
       fmi3ValueReference independents[], size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
       size_t nDependencies)
ABSENT(EnterConfigurationMode, SELF)
ABSENT(ExitConfigurationMode, SELF)
ABSENT(GetDirectionalDerivative, SELF, const fmi3ValueReference unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[],
       size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
ABSENT(GetAdjointDerivative, SELF, const fmi3ValueReference unknowns[], size_t nUnknowns, const fmi3ValueReference knowns[],
       size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
ABSENT(GetOutputDerivatives, SELF, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
ABSENT(EnterContinuousTimeMode, SELF)
ABSENT(CompletedIntegratorStep, SELF, fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *enterEventMode,
       fmi3Boolean *terminateSimulation)
ABSENT(SetTime, SELF, fmi3Float64 time)
ABSENT(SetContinuousStates, SELF, const fmi3Float64 states[], size_t n)
ABSENT(GetContinuousStateDerivatives, SELF, fmi3Float64 derivatives[], size_t n)
ABSENT(GetEventIndicators, SELF, fmi3Float64 indicators[], size_t n)
ABSENT(GetContinuousStates, SELF, fmi3Float64 states[], size_t n)
ABSENT(GetNominalsOfContinuousStates, SELF, fmi3Float64 nominals[], size_t n)
ABSENT(GetNumberOfEventIndicators, SELF, size_t *n)
ABSENT(GetNumberOfContinuousStates, SELF, size_t *n)
