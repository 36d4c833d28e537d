"""An FMU that adds up its input over time and, from t = 0.5 s on, does what its parameter `harm` tells."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

import fmpy

from shaper_fmu.export.native.toolchain import build_library, platform_named

NAMES = """
    none null abort hang leave leave_well fail crash_when_freed hang_in_initialization not_a_number killed_once
    fork fork_and_leave fork_at_start write_anywhere close_all reopen_all
"""
HARM: Sequence[str] = NAMES.split()  # in the order of the C source

SOURCE = """
#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <fcntl.h>
#include <unistd.h>
#include "fmi2TypesPlatform.h"
#include "fmi2FunctionTypes.h"
#define EXPORT __attribute__((visibility("default")))
enum { NONE, NULL_POINTER, ABORT, HANG, LEAVE, LEAVE_WELL, FAIL, CRASH_WHEN_FREED, HANG_IN_INITIALIZATION,
       NOT_A_NUMBER, KILLED_ONCE,
       FORK, FORK_AND_LEAVE, FORK_AT_START, WRITE_ANYWHERE, CLOSE_ALL, REOPEN_ALL };

static double command, sum;
static int harm, forgetful;
static volatile int *nowhere;

static void hang(void) { for (;;) sleep(1); }

/* What $HARMFUL_FRAME holds, into every pipe that is not a standard stream. */
static void write_anywhere(void) {
    static char bytes[4096];
    FILE *file = fopen(getenv("HARMFUL_FRAME"), "rb");
    size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    for (int i = 3; i < 64; i++) {
        struct stat status;
        if (fstat(i, &status) == 0 && S_ISFIFO(status.st_mode))
            if (write(i, bytes, length) < 0)
                continue; /* the reading end */
    }
}

static void close_all(void) { for (int i = 3; i < 256; i++) close(i); }

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    sum = command = harm = forgetful = 0;
    return &sum;
}
EXPORT void fmi2FreeInstance(fmi2Component c) { if (harm == CRASH_WHEN_FREED) *nowhere = 1; }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f) { return fmi2OK; }
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    if (harm == HANG_IN_INITIALIZATION)
        hang();
    if (harm == FORK_AT_START)
        fork();
    return fmi2OK;
}
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) {
    command = harm = 0;
    if (!forgetful)
        sum = 0.0;
    return fmi2OK;
}
EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
    for (size_t i = 0; i < n; i++)
        values[i] = vr[i] == 0 ? command : sum;
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
    command = values[0];
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer values[]) {
    for (size_t i = 0; i < n; i++)
        *(vr[i] == 0 ? &harm : &forgetful) = values[i];
    return fmi2OK;
}
EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_going_back) {
    sum += h * command;
    if (t < 0.5 - 1e-9 || harm == NONE)
        return fmi2OK;
    if (t > 0.5 + 0.5 * h && harm >= FORK)
        return fmi2OK; /* those are done once a run */
    fputs("first line\\n", stderr);
    fprintf(stderr, "harm %d now\\n", harm);
    switch (harm) {
    case NULL_POINTER: *nowhere = 1; break;
    case ABORT: /* with a process of its own that goes on */
        if (fork() == 0)
            hang();
        abort();
    case HANG: hang();
    case LEAVE: exit(3);
    case LEAVE_WELL: exit(0);
    case FAIL: return fmi2Error;
    case NOT_A_NUMBER: sum = 0.0 / (sum - sum); return fmi2OK;
    case KILLED_ONCE: /* as by somebody else, the first time that this run is done */
        if (fopen(getenv("HARMFUL_MARK"), "wx"))
            raise(SIGKILL);
        break;
    case FORK: fork(); break; /* and both return */
    case FORK_AND_LEAVE: if (fork() != 0) _exit(0); else break;
    case WRITE_ANYWHERE: write_anywhere(); break;
    case CLOSE_ALL: close_all(); break;
    case REOPEN_ALL: close_all(); while (open("/dev/null", O_RDWR) < 64) ;
    }
    return fmi2OK;
}
EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
#define ABSENT(Name) EXPORT fmi2Status fmi2##Name(void) { return fmi2Error; }
ABSENT(SetDebugLogging) ABSENT(GetInteger) ABSENT(GetBoolean) ABSENT(SetBoolean)
ABSENT(GetString) ABSENT(SetString) ABSENT(GetFMUstate) ABSENT(SetFMUstate) ABSENT(FreeFMUstate)
ABSENT(SerializedFMUstateSize) ABSENT(SerializeFMUstate) ABSENT(DeSerializeFMUstate) ABSENT(GetDirectionalDerivative)
ABSENT(SetRealInputDerivatives) ABSENT(GetRealOutputDerivatives) ABSENT(CancelStep) ABSENT(GetStatus)
ABSENT(GetRealStatus) ABSENT(GetIntegerStatus) ABSENT(GetBooleanStatus) ABSENT(GetStringStatus)
"""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="harmful" guid="{harmful}">
  <CoSimulation modelIdentifier="harmful" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="command" valueReference="0" causality="input" variability="continuous"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="harm" valueReference="0" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="forgetful" valueReference="1" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="sum" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="4" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
"""


def build_harmful(folder: Path) -> Path:
    """Write `folder`/harmful.fmu."""
    library = folder / f"harmful{fmpy.sharedLibraryExtension}"
    (folder / "harmful.c").write_text(SOURCE)
    build_library([folder / "harmful.c"], library, platform_named("this"), [Path(str(fmpy.__file__)).parent / "c-code"])
    with zipfile.ZipFile(folder / "harmful.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return folder / "harmful.fmu"
