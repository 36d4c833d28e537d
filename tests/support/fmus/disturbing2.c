/* An FMU of FMI 2.0 that adds up input / 3, swings behind its input (2 pi rad/s, damping ratio 0.05), and changes the state of its process. Its instance's name tells what and in which call:
   "upward_step" rounds upwards from the first step on. */

#define _GNU_SOURCE
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>
#include <xmmintrin.h>
#include <fcntl.h>
#define EXPORT __attribute__((visibility("default")))
#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"

typedef struct {
    char name[64];
    double input, sum, position, velocity;
} Instance;

static void heard(int signal) {}

static void disturb(const char *what) {
    if (strcmp(what, "directory") == 0)
        chdir("/");
    else if (strcmp(what, "locale") == 0)
        setlocale(LC_ALL, "C.UTF-8");
    else if (strcmp(what, "upward") == 0)
        fesetround(FE_UPWARD);
    else if (strcmp(what, "zero") == 0)
        _mm_setcsr(_mm_getcsr() | 0x6000);
    else if (strcmp(what, "flush") == 0)
        _mm_setcsr(_mm_getcsr() | 0x8000);
    else if (strcmp(what, "denormals") == 0)
        _mm_setcsr(_mm_getcsr() | 0x0040);
    else if (strcmp(what, "traps") == 0)
        feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
    else if (strcmp(what, "precision") == 0) {
        unsigned short word = 0x07f; /* single precision in the x87 */
        __asm__ volatile("fldcw %0" : : "m"(word));
    } else if (strcmp(what, "umask") == 0)
        umask(0777);
    else if (strcmp(what, "interrupt") == 0)
        signal(SIGINT, SIG_IGN);
    else if (strcmp(what, "pipe") == 0)
        signal(SIGPIPE, SIG_DFL);
    else if (strcmp(what, "handlers") == 0) {
        signal(SIGSEGV, heard);
        signal(SIGFPE, heard);
        signal(SIGTERM, heard);
    } else if (strcmp(what, "alarm") == 0) {
        struct itimerval soon = {{0, 0}, {0, 200000}};
        setitimer(ITIMER_REAL, &soon, NULL);
    } else if (strcmp(what, "handledalarm") == 0) {
        struct itimerval soon = {{0, 0}, {0, 200000}};
        signal(SIGALRM, heard);
        setitimer(ITIMER_REAL, &soon, NULL);
    } else if (strcmp(what, "mask") == 0) {
        sigset_t all;
        sigfillset(&all);
        sigprocmask(SIG_SETMASK, &all, NULL);
    } else if (strcmp(what, "close") == 0) {
        close(0), close(1), close(2);
    } else if (strcmp(what, "redirect") == 0) {
        freopen("/dev/null", "w", stdout);
        freopen("/dev/null", "w", stderr);
    } else if (strcmp(what, "nonblock") == 0)
        fcntl(1, F_SETFL, fcntl(1, F_GETFL) | O_NONBLOCK);
    else if (strcmp(what, "environment") == 0) {
        setenv("TZ", "Asia/Tokyo", 1);
        setenv("DISTURBED", "1", 1);
        unsetenv("HOME");
    }
}

static void at(Instance *self, const char *call) {
    char what[64];
    strcpy(what, self->name);
    char *where = strchr(what, '_');
    if (where != NULL && strcmp(where + 1, call) == 0)
        *where = '\0', disturb(what);
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Instance *self = calloc(1, sizeof *self);
    snprintf(self->name, sizeof self->name, "%s", name);
    at(self, "instantiate");
    return self;
}
EXPORT void fmi2FreeInstance(fmi2Component c) {
    at(c, "free");
    free(c);
}
#define CALL(Function, call) \
    EXPORT fmi2Status fmi2##Function { \
        at(c, call); \
        return fmi2OK; \
    }
CALL(SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f), "setup")
CALL(EnterInitializationMode(fmi2Component c), "enter")
CALL(ExitInitializationMode(fmi2Component c), "exit")
CALL(Terminate(fmi2Component c), "terminate")
EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    Instance *self = c;
    self->sum = self->position = self->velocity = 0.0;
    at(c, "reset");
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == 0 ? ((Instance *)c)->input : vr[i] == 1 ? ((Instance *)c)->sum : ((Instance *)c)->position;
    at(c, "get");
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    ((Instance *)c)->input = values[0];
    at(c, "set");
    return fmi2OK;
}
static void swing(Instance *self, double h) { /* exact for a constant input */
    const double frequency = 6.283185307179586, decay = 0.05 * frequency, damped = frequency * sqrt(1.0 - 0.05 * 0.05);
    double x = self->position - self->input, v = self->velocity, a = (v + decay * x) / damped;
    double fade = exp(-decay * h), c = cos(damped * h), s = sin(damped * h);
    self->position = self->input + fade * (x * c + a * s);
    self->velocity = fade * (v * c - (decay * a + damped * x) * s);
}
EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    Instance *self = c;
    self->sum += (self->input + t) * h / 3.0;
    swing(self, h);
    at(c, "step");
    return fmi2OK;
}
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(SetDebugLogging) ABSENT(GetInteger) ABSENT(GetBoolean) ABSENT(SetBoolean) ABSENT(SetInteger)
ABSENT(GetString) ABSENT(SetString) ABSENT(GetFMUstate) ABSENT(SetFMUstate) ABSENT(FreeFMUstate)
ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative)
ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus)
ABSENT(GetRealStatus) ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
