/* Two FMUs of FMI 3.0 linked into one program, without a loader: steps of the first one's input and the values of both.

   linked TOKEN INPUT OUTPUT TOKEN INPUT OUTPUT STEPS: value references; each output is printed as the bits of a double. */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FMI3_Export
#define FMI3_FUNCTION_PREFIX First_
#include "fmi3Functions.h"

#define OF(name) Second_fmi3##name
fmi3Instance OF(InstantiateCoSimulation)(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                         const fmi3ValueReference[], size_t, fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                         fmi3IntermediateUpdateCallback);
fmi3EnterInitializationModeTYPE OF(EnterInitializationMode);
fmi3ExitInitializationModeTYPE OF(ExitInitializationMode);
fmi3SetFloat64TYPE OF(SetFloat64);
fmi3GetFloat64TYPE OF(GetFloat64);
fmi3DoStepTYPE OF(DoStep);
fmi3FreeInstanceTYPE OF(FreeInstance);

static void must(fmi3Status status) {
    if (status != fmi3OK) exit(1);
}

static void print(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf("%016" PRIx64 "\n", bits);
}

int main(int argc, char **argv) {
    if (argc != 8) return 2;
    fmi3ValueReference in1 = (fmi3ValueReference)atoi(argv[2]), out1 = (fmi3ValueReference)atoi(argv[3]);
    fmi3ValueReference in2 = (fmi3ValueReference)atoi(argv[5]), out2 = (fmi3ValueReference)atoi(argv[6]);
    fmi3Instance first = fmi3InstantiateCoSimulation("first", argv[1], 0, false, false, false, false, 0, 0, 0, 0, 0);
    fmi3Instance second = OF(InstantiateCoSimulation)("second", argv[4], 0, false, false, false, false, 0, 0, 0, 0, 0);
    if (!first || !second) return 3;
    must(fmi3EnterInitializationMode(first, false, 0.0, 0.0, false, 0.0));
    must(OF(EnterInitializationMode)(second, false, 0.0, 0.0, false, 0.0));
    must(fmi3ExitInitializationMode(first));
    must(OF(ExitInitializationMode)(second));
    for (int i = 0; i < atoi(argv[7]); i++) {
        double input = i % 7 * 0.25, value;
        fmi3Boolean event, end, early;
        must(fmi3SetFloat64(first, &in1, 1, &input, 1));
        must(OF(SetFloat64)(second, &in2, 1, &input, 1));
        must(fmi3DoStep(first, i * 0.01, 0.01, true, &event, &end, &early, &value));
        must(OF(DoStep)(second, i * 0.01, 0.01, true, &event, &end, &early, &value));
        must(fmi3GetFloat64(first, &out1, 1, &value, 1));
        print(value);
        must(OF(GetFloat64)(second, &out2, 1, &value, 1));
        print(value);
    }
    fmi3FreeInstance(first);
    OF(FreeInstance)(second);
    return 0;
}
