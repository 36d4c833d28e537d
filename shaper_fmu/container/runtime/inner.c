/* The FMUs inside: their libraries, their instances, and how they are initialized. */

#include "container.h"

#include "fmi.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The library of this platform in the FMU's folder; null if there is none. */
static char *library_path(const Container *container, const Inner *inner) {
    char *const fmu = joined(container->resources, inner->folder);
    for (int i = 0; fmu && i < 3; i++) {
        const char *const platform = LIBRARY_FOLDERS[inner->version == 3][i];
        char rest[400];
        if (!platform || snprintf(rest, sizeof rest, "binaries/%s/%s%s", platform, inner->identifier, LIBRARY_SUFFIX) >= (int)sizeof rest)
            break;
        char *const path = joined(fmu, rest);
        FILE *const file = path ? (FILE *)open_file(path) : 0;
        if (file) {
            fclose(file);
            free(fmu);
            return path;
        }
        free(path);
    }
    free(fmu);
    return 0;
}

int load_inner(Container *container, Inner *inner) {
    char why[500] = "";
    char *const path = library_path(container, inner);
    if (path)
        inner->library = load_library(path, why, sizeof why);
    else
        snprintf(why, sizeof why, "%s has no library for this platform, %s", inner->folder, LIBRARY_FOLDERS[inner->version == 3][0]);
    if (!inner->library) complain(container, ERROR, "%s: %s cannot be loaded: %s", container->name, inner->name, why);
    free(path);
    return inner->library != 0;
}

Function function_of(const Inner *inner, const char *function) { return find_function(inner->library, function); }

Status lacks(Container *container, const Inner *inner, const char *function) {
    return complain(container, ERROR, "%s: %s: its library lacks the function %s", container->name, inner->name, function);
}

/* The FMU's status as that of a call of the container; what is wrong is said. */
Status judge_call(Container *container, Inner *inner, const char *function, int status) {
    return status == OK || status == WARNING ? (Status)status : inner_failure(container, inner, function, status);
}

Status call_inner(Container *container, Inner *inner, const char *function) {
    SimpleFunction *const called = (SimpleFunction *)function_of(inner, function);
    if (!called) return lacks(container, inner, function);
    return judge_call(container, inner, function, called(inner->handle));
}

static int is_plain(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || strchr("-._~/:", c);
}

/* The path as a URL. */
static char *url_of(const char *path) {
    char *const url = (char *)malloc(3 * strlen(path) + 10), *at = url;
    if (!url) return 0;
    at += sprintf(at, path[0] == '/' ? "file://" : "file:///");
    for (; *path; path++)
        if (is_plain(*path))
            *at++ = *path;
        else
            at += sprintf(at, *path == '\\' ? "/" : "%%%02X", (unsigned)(unsigned char)*path);
    *at = 0;
    return url;
}

static void *instantiate2(Container *container, Inner *inner, const char *resources) {
    typedef fmi2Component Instantiate(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
    Instantiate *const function = (Instantiate *)function_of(inner, "fmi2Instantiate");
    if (!function) lacks(container, inner, "fmi2Instantiate");
    const fmi2CallbackFunctions callbacks = {logger2, calloc, free, 0, inner};
    memcpy(&inner->callbacks, &callbacks, sizeof callbacks); /* whose members are constant */
    char *const url = url_of(resources);
    void *const made = function && url
                           ? function(inner->full_name, fmi2CoSimulation, inner->token, url, &inner->callbacks, fmi2False, fmi2True)
                           : 0;
    free(url);
    return made;
}

static void *instantiate3(Container *container, Inner *inner, const char *resources) {
    typedef fmi3Instance Instantiate(fmi3String, fmi3String, fmi3String, fmi3Boolean, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                     const fmi3ValueReference *, size_t, fmi3InstanceEnvironment, fmi3LogMessageCallback,
                                     fmi3IntermediateUpdateCallback);
    Instantiate *const function = (Instantiate *)function_of(inner, "fmi3InstantiateCoSimulation");
    if (!function) lacks(container, inner, "fmi3InstantiateCoSimulation");
    char *const path = is_folder(resources) ? joined(resources, "") : 0;
    void *const made = function ? function(inner->full_name, inner->token, path, fmi3False, fmi3True, inner->event_mode != 0,
                                           inner->event_mode != 0, 0, 0, inner, logger3, 0)
                                : 0;
    free(path);
    return made;
}

/* Errors and warnings are wanted, but not a message for each event. */
static void keep_quiet(Inner *inner) {
    const char *const category[] = {"logEvents"};
    if (inner->version == 2) {
        typedef int Quiet(void *, fmi2Boolean, size_t, const fmi2String *);
        Quiet *const function = (Quiet *)function_of(inner, "fmi2SetDebugLogging");
        if (function) function(inner->handle, fmi2False, 1, category);
    } else {
        typedef int Quiet(void *, fmi3Boolean, size_t, const fmi3String *);
        Quiet *const function = (Quiet *)function_of(inner, "fmi3SetDebugLogging");
        if (function) function(inner->handle, 0, 1, category);
    }
}

int instantiate_inner(Container *container, Inner *inner) {
    const size_t length = strlen(container->instance_name) + strlen(inner->name) + 2;
    char *const fmu = joined(container->resources, inner->folder), *const resources = fmu ? joined(fmu, "resources") : 0;
    inner->full_name = (char *)take(container, length, 1);
    if (inner->full_name && resources) {
        snprintf(inner->full_name, length, "%s.%s", container->instance_name, inner->name);
        inner->handle = inner->version == 2 ? instantiate2(container, inner, resources) : instantiate3(container, inner, resources);
    }
    free(resources);
    free(fmu);
    if (!inner->handle)
        complain(container, ERROR, "%s: %s cannot be instantiated%s%s", container->name, inner->name, *inner->said ? ": " : "",
               inner->said);
    else if (inner->events_logged)
        keep_quiet(inner);
    return inner->handle != 0;
}

void free_inner(Inner *inner) {
    typedef void Free(void *);
    if (inner->handle && !inner->failed) {
        Free *const function = (Free *)function_of(inner, inner->version == 2 ? "fmi2FreeInstance" : "fmi3FreeInstance");
        if (function) function(inner->handle);
    }
    inner->handle = 0;
    if (inner->library) unload_library(inner->library);
    inner->library = 0;
}

/* Set what belongs to this phase. */
static Status set_values_of(Container *container, Inner *inner, int phase) {
    for (size_t i = 0; i < inner->setting_count; i++) {
        const Setting *const setting = &inner->settings[i];
        if (setting->phase != phase) continue;
        const Function function = function_of(inner, setting->function);
        if (!function) return lacks(container, inner, setting->function);
        const int status =
            inner->version == 2 ? ((Fmi2Transfer *)function)(inner->handle, &setting->reference, 1, setting->values)
                                : ((Fmi3Transfer *)function)(inner->handle, &setting->reference, 1, setting->values, setting->count);
        if (judge_call(container, inner, setting->function, status) > WARNING) return ERROR;
    }
    return OK;
}

/* What the system gives an instance before the host gives anything: after its instantiation, and after a reset. */
Status prepare_inner(Container *container, Inner *inner) {
    int configured = 0;
    for (size_t i = 0; i < inner->setting_count; i++) configured |= inner->settings[i].phase == IN_CONFIGURATION;
    if (configured && (call_inner(container, inner, "fmi3EnterConfigurationMode") > WARNING ||
                       set_values_of(container, inner, IN_CONFIGURATION) > WARNING ||
                       call_inner(container, inner, "fmi3ExitConfigurationMode") > WARNING))
        return ERROR;
    return set_values_of(container, inner, WHEN_INSTANTIATED);
}

/* Have an instance enter initialization mode. */
Status set_up_inner(Container *container, Inner *inner) {
    const size_t number = (size_t)(inner - container->inner);
    const double own = container->system.instances.at[number].tolerance, start = container->origin;
    const double tolerance = container->tolerance_defined ? container->tolerance : own;
    if (inner->version == 2) {
        Fmi2SetupExperiment *const set_up = (Fmi2SetupExperiment *)function_of(inner, "fmi2SetupExperiment");
        if (!set_up) return lacks(container, inner, "fmi2SetupExperiment");
        const int status = set_up(inner->handle, tolerance > 0.0, tolerance, start, container->stop_defined, container->stop);
        if (judge_call(container, inner, "fmi2SetupExperiment", status) > WARNING) return ERROR;
        if (call_inner(container, inner, "fmi2EnterInitializationMode") > WARNING) return ERROR;
    } else {
        const char *const name = "fmi3EnterInitializationMode";
        Fmi3EnterInitializationMode *const enter_mode = (Fmi3EnterInitializationMode *)function_of(inner, name);
        if (!enter_mode) return lacks(container, inner, name);
        const int status = enter_mode(inner->handle, tolerance > 0.0, tolerance, start, container->stop_defined != 0, container->stop);
        if (judge_call(container, inner, name, status) > WARNING) return ERROR;
    }
    return set_values_of(container, inner, IN_INITIALIZATION);
}
