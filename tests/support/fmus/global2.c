/* An FMU of FMI 2.0 whose instances share global variables: sum adds up rate * h over all of them, and begins where the last
   instance in the process has left it. With STAYS the library is never unloaded. */

#define _GNU_SOURCE
#include <dlfcn.h>
#define EXPORT __attribute__((visibility("default")))
#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

static double sum, rate;
static int settings[2]; /* fatal: at 0.5 s; forgetful: a reset leaves sum as it is */

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Dl_info own;
    if (STAYS && dladdr(&sum, &own))
        dlopen(own.dli_fname, RTLD_NOW | RTLD_NODELETE);
    return &rate;
}
EXPORT void fmi2FreeInstance(fmi2Component c) {}
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f) { return fmi2OK; }
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    if (!settings[1])
        sum = 0.0;
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == 0 ? rate : sum;
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    rate = values[0];
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer values[]) {
    for (size_t i = 0; i < n; i++)
        settings[vr[i]] = values[i];
    return fmi2OK;
}
EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    sum += h * rate;
    return settings[0] && t > 0.45 ? fmi2Fatal : fmi2OK;
}
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(SetDebugLogging) ABSENT(GetInteger) ABSENT(GetBoolean) ABSENT(SetBoolean)
ABSENT(GetString) ABSENT(SetString) ABSENT(GetFMUstate) ABSENT(SetFMUstate) ABSENT(FreeFMUstate)
ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative)
ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus)
ABSENT(GetRealStatus) ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
