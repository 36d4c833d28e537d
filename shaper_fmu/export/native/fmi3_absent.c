/* FMI 3.0 functions for what our FMUs do not have: other types, clocks, structural parameters, partial derivatives. */

#include "fmi3.h"

static fmi3Status absent(Instance *self, const char *function, const char *what) {
    return (fmi3Status)refuse(self, ERROR, "%s: %s: there are no %s in this FMU", component.name, function, what);
}

#define VALUES(Name) \
    fmi3Status fmi3Get##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             fmi3##Name values[], size_t nValues) { \
        (void)valueReferences, (void)values, (void)nValues; \
        REQUIRE(READABLE); \
        return nValueReferences ? absent(self, __func__, "variables of type " #Name) : fmi3OK; \
    } \
    fmi3Status fmi3Set##Name(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             const fmi3##Name values[], size_t nValues) { \
        (void)valueReferences, (void)values, (void)nValues; \
        REQUIRE(WRITABLE); \
        return nValueReferences ? absent(self, __func__, "variables of type " #Name) : fmi3OK; \
    }

VALUES(Float32)
VALUES(Int8)
VALUES(UInt8)
VALUES(Int16)
VALUES(UInt16)
VALUES(UInt32)
VALUES(UInt64)
VALUES(String)

#define ABSENT(Name, what, ...) \
    fmi3Status fmi3##Name(fmi3Instance instance, __VA_ARGS__) { \
        REQUIRE(BETWEEN_CALLS); \
        return absent(self, __func__, what); \
    }

#define REFERENCES const fmi3ValueReference vr[], size_t n

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

ABSENT(GetBinary, "binary variables", REFERENCES, size_t sizes[], fmi3Binary values[], size_t nValues)
ABSENT(SetBinary, "binary variables", REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t nValues)
ABSENT(GetClock, "clocks", REFERENCES, fmi3Clock values[])
ABSENT(SetClock, "clocks", REFERENCES, const fmi3Clock values[])
ABSENT(GetIntervalDecimal, "clocks", REFERENCES, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetIntervalFraction, "clocks", REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
ABSENT(GetShiftDecimal, "clocks", REFERENCES, fmi3Float64 shifts[])
ABSENT(GetShiftFraction, "clocks", REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT(SetIntervalDecimal, "clocks", REFERENCES, const fmi3Float64 intervals[])
ABSENT(SetIntervalFraction, "clocks", REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(SetShiftDecimal, "clocks", REFERENCES, const fmi3Float64 shifts[])
ABSENT(SetShiftFraction, "clocks", REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT(ActivateModelPartition, "model partitions", fmi3ValueReference clockReference, fmi3Float64 activationTime)
ABSENT(GetNumberOfVariableDependencies, "dependencies that change while running", fmi3ValueReference vr, size_t *n)
ABSENT(GetVariableDependencies, "dependencies that change while running", fmi3ValueReference dependent,
       size_t elementIndicesOfDependent[], fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
       fmi3DependencyKind dependencyKinds[], size_t nDependencies)
ABSENT(GetAdjointDerivative, "adjoint derivatives", const fmi3ValueReference unknowns[], size_t nUnknowns,
       const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, fmi3Float64 sensitivity[],
       size_t nSensitivity)

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    REQUIRE(BETWEEN_CALLS);
    return absent(self, __func__, "structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    REQUIRE(BETWEEN_CALLS);
    return absent(self, __func__, "structural parameters");
}
