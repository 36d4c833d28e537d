/* What is said to the host, and what the FMUs inside say. */

#include "container.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#if defined(_MSC_VER)
#define ONE_PER_THREAD __declspec(thread)
#else
#define ONE_PER_THREAD __thread
#endif

static ONE_PER_THREAD Container *at_work; /* whose FMUs this thread calls */

static const char *const CATEGORIES[] = {"logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

void enter(Container *container) {
    container->arithmetic = loop_arithmetic_mode();
    if (container->arithmetic != loop_standard_arithmetic()) loop_set_arithmetic_mode(loop_standard_arithmetic());
    container->outer = at_work; /* where a container is in a container */
    at_work = container;
    container->hurt = 0;
}

Status leave(Container *container, Status status) {
    at_work = container->outer;
    if (loop_arithmetic_mode() != container->arithmetic) loop_set_arithmetic_mode(container->arithmetic);
    if (container->hurt) settle_phase(container, ERROR);
    for (size_t i = 0; i < container->inners; i++)
        if (container->inner[i].failed) return settle_phase(container, FATAL);
    return status;
}

static void log_text(Container *container, Status status, const char *text) {
    if (container->log && (status != OK || container->logging)) container->log(container, status, CATEGORIES[status], text);
}

/* Say why a call fails, and return its status. */
Status complain(Container *container, Status status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(container->text, sizeof container->text, format, arguments);
    va_end(arguments);
    log_text(container, status, container->text);
    return status;
}

int set_logging(Container *container, int on, size_t categories, const char *const category[]) {
    for (size_t i = 0; i < categories; i++) {
        int known = category && category[i] && !strcmp(category[i], "logAll");
        for (int k = 0; category && category[i] && k < 5; k++) known |= !strcmp(category[i], CATEGORIES[k]);
        if (!known)
            return (int)complain(container, ERROR, "%s: there is no log category %s", container->name,
                          category && category[i] ? category[i] : "(null)");
    }
    container->logging = on != 0;
    return OK;
}

/* An FMU's status, or what is none, as one. */
static Status status_of(int status) { return status >= OK && status <= FATAL ? (Status)status : ERROR; }

static void said(Inner *inner, int status, const char *text) {
    size_t length = strlen(text);
    while (length && isspace((unsigned char)text[length - 1])) length--;
    if (!length) return;
    if (length >= sizeof inner->said) length = sizeof inner->said - 1;
    memmove(inner->said, text, length);
    inner->said[length] = 0;
    Container *const container = inner->container;
    char line[800];
    snprintf(line, sizeof line, "%s: %s", inner->name, inner->said);
    log_text(container, status_of(status), line);
}

/* printf's work for a message of an FMU, which may lack arguments that its format asks for: texts are looked at first. */
static void put_formatted(char *text, size_t size, const char *format, va_list arguments) {
    size_t used = 0;
    while (*format && used + 1 < size) {
        if (*format != '%' || format[1] == '%') {
            text[used++] = *format;
            format += *format == '%' ? 2 : 1;
            continue;
        }
        char one[40];
        size_t length = 1 + strspn(format + 1, "-+ #0123456789."), bytes = sizeof(int), longs = 0;
        for (; format[length] && strchr("hlLzjt", format[length]); length++) {
            const char c = format[length];
            if (c == 'l') bytes = longs++ ? sizeof(long long) : sizeof(long);
            if (c == 'j') bytes = sizeof(intmax_t);
            if (c == 'z' || c == 't') bytes = c == 'z' ? sizeof(size_t) : sizeof(ptrdiff_t);
        }
        const char kind = format[length];
        if (!kind || length + 2 > sizeof one) break;
        memcpy(one, format, length + 1);
        one[length + 1] = 0;
        const size_t room = size - used;
        int put;
        if (strchr("diouxXc", kind))
            put = bytes > sizeof(int) ? snprintf(text + used, room, one, va_arg(arguments, long long))
                                      : snprintf(text + used, room, one, va_arg(arguments, int));
        else if (strchr("eEfFgGaA", kind) && format[length - 1] != 'L')
            put = snprintf(text + used, room, one, va_arg(arguments, double));
        else if (kind == 's' && !longs) {
            const char *const argument = va_arg(arguments, const char *);
            size_t whole = 0;
            while (whole < room && (whole && (uintptr_t)(argument + whole) % 4096 ? 1 : is_readable(argument + whole, 1)) && argument[whole])
                whole++;
            put = snprintf(text + used, room, "%.*s", (int)whole, whole ? argument : "");
        } else if (kind == 'p')
            put = snprintf(text + used, room, one, va_arg(arguments, void *));
        else
            break; /* no conversion, or one that writes: what follows is not formatted */
        used += put < 0 ? 0 : (size_t)put < room ? (size_t)put : room - 1;
        format += length + 1;
    }
    snprintf(text + used, size - used, "%s", format);
}

/* Whose message it is. Some FMUs give no environment (20-sim's), or what is none (Overture's): it is looked for among those of the
   container at work in this thread, then the name is. Where no container is, nothing is known. */
static Inner *speaker(const void *environment, const char *name) {
    if (!at_work || !at_work->inners) return 0;
    for (size_t i = 0; i < at_work->inners; i++)
        if (environment == &at_work->inner[i]) return &at_work->inner[i];
    for (size_t i = 0; i < at_work->inners; i++)
        if (name && at_work->inner[i].full_name && is_readable(name, 1) && !strcmp(at_work->inner[i].full_name, name))
            return &at_work->inner[i];
    return &at_work->inner[0];
}

void logger2(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    Inner *const inner = speaker(environment, name);
    (void)category;
    if (!inner || !is_readable(message, 1)) return;
    char text[600];
    va_list arguments;
    va_start(arguments, message);
    put_formatted(text, sizeof text, message, arguments);
    va_end(arguments);
    said(inner, (int)status, text);
}

void logger3(void *environment, fmi3Status status, fmi3String category, fmi3String message) {
    Inner *const inner = speaker(environment, 0);
    (void)category;
    if (inner && is_readable(message, 1)) said(inner, (int)status, message);
}

static const char *verb_of(int status) {
    switch (status) {
    case 2: return "was refused (Discard)";
    case 3: return "failed";
    case 4: return "failed (Fatal: it cannot be used any more)";
    case 5: return "goes on in the background (Pending), which is not supported";
    default: return "returned what is no status";
    }
}

/* What has failed inside, with the FMU's own words. */
static Status say_failure(Container *container, Inner *inner, const char *function, int status, double t, const char *words) {
    char when[60] = "";
    if (container->phase & (STEPPING | EVENT))
        snprintf(when, sizeof when, " at t = %.15g s", t);
    else
        snprintf(when, sizeof when, " %s", container->phase & INSTANTIATED ? "before initialization" : "at initialization");
    if (status == FATAL) inner->failed = 1;
    const Status outer = status == FATAL ? FATAL : status == DISCARD || status == OK ? DISCARD : ERROR; /* OK: it ends the simulation */
    if (outer == ERROR) container->hurt = 1;
    return complain(container, outer, "%s: %s%s: %s %s%s%s", container->name, inner->name, when, function, words,
                  *inner->said ? ": " : " and gave no message", inner->said);
}

Status inner_failure(Container *container, Inner *inner, const char *function, int status) {
    return say_failure(container, inner, function, status, container->control.t, verb_of(status));
}

static const char *called(const Inner *inner, int number) {
    static const char *const names[] = {
        "DoStep", "EnterEventMode", "EnterStepMode", "UpdateDiscreteStates", "SetRealInputDerivatives", "Reset", "SetupExperiment",
        "EnterInitializationMode", "ExitInitializationMode", "SetClock", "GetClock", "GetIntervalDecimal", "GetIntervalFraction",
        "GetShiftDecimal", "GetShiftFraction"};
    static ONE_PER_THREAD char text[60];
    const int known = number >= 0 && number < (int)(sizeof names / sizeof *names);
    snprintf(text, sizeof text, "fmi%d%s", inner->version, known ? names[number] : "?");
    return text;
}

/* An input's value that cannot be set. */
static Status tell_value(Container *container, const Control *control, const Label *label) {
    const Transfer *const transfer = &container->system.transfers.at[control->fault_where];
    const double value = *transfer->elements[control->fault_element].bus;
    const char *const words = control->fault == FAULT_NOT_IN_RANGE ? ", which does not fit into its type"
                              : control->fault == FAULT_NO_ITEM    ? ", which is not an item of its enumeration"
                                                                   : "";
    const char *const name = (size_t)control->fault_element < label->elements ? label->element[control->fault_element] : "?";
    return complain(container, ERROR, "%s: %s at t = %.15g s: the value for input %s is %.15g%s", container->name,
                  container->inner[label->inner].name, control->fault_time, name, value, words);
}

/* What has gone wrong in the loop. */
Status tell_fault(Container *container) {
    const Control *const control = &container->control;
    const double t = control->fault_time;
    if (control->fault >= FAULT_BAD_INTERVAL) {
        const size_t number = (size_t)control->fault_element;
        return complain(container, ERROR, "%s: clock %s at t = %.15g s: its interval, or its next tick, makes no sense", container->name,
                      number < container->clocks ? container->clock[number] : "?", t);
    }
    const Label *const label = control->fault_where >= 0 ? &container->label[control->fault_where] : 0;
    Inner *const inner = &container->inner[label ? label->inner : -1 - control->fault_where];
    const char *const function = label ? label->function : called(inner, control->fault_element);
    switch (control->fault) {
    case FAULT_CALL_FAILED: return say_failure(container, inner, function, control->fault_status, t, verb_of(control->fault_status));
    case FAULT_NOT_FINITE: case FAULT_NOT_IN_RANGE: case FAULT_NO_ITEM: return tell_value(container, control, label);
    case FAULT_EARLY_RETURN:
        return say_failure(container, inner, function, ERROR, t,
                           "returned early, from an event that it had not announced, and the step cannot be shortened for all");
    case FAULT_TERMINATED: return say_failure(container, inner, function, OK, t, "asked to end the simulation");
    case FAULT_OPEN_LOOP:
        return complain(container, ERROR, "%s: no values were found that close a loop without delay", container->name);
    default: return say_failure(container, inner, function, ERROR, t, "asked for another update again and again");
    }
}
