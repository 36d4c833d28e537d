/* Messages in words; log categories are numbered like the statuses, events being OK. */

#include "component.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const char *const CATEGORIES[] = {"logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

/* Say why a call fails, and return its status. */
Status refuse(Instance *instance, Status status, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(instance->text, sizeof instance->text, format, arguments);
    va_end(arguments);
    if (instance->log && instance->log_mask & 1 << status) instance->log(instance, status, CATEGORIES[status], instance->text);
    return status;
}

/* The name, or name[i] counted from 1 for an array. */
void put_label(char *text, int size, const Variable *v, int element) {
    if (v->size)
        snprintf(text, size, "%s[%d]", v->name, element + 1);
    else
        snprintf(text, size, "%s", v->name);
}

static int put_value(char *text, int size, const unsigned char *record, const Variable *v) {
    int value = *(const int *)(record + v->offset);
    if (v->kind == REAL) return snprintf(text, size, "%.9g", *(const double *)(record + v->offset));
    if (v->kind == BOOLEAN) return snprintf(text, size, "%s", value ? "True" : "False");
    for (int i = 0; i < v->items; i++)
        if (v->item[i].value == value) return snprintf(text, size, "%s", v->item[i].text);
    return snprintf(text, size, "%d", value);
}

static const Variable *variable_named(const char *name, int length) {
    for (int k = 0; k < component.variables; k++) {
        const Variable *v = &component.variable[k];
        if ((int)strlen(v->name) == length && !strncmp(v->name, name, length)) return v;
    }
    return 0;
}

/* A message with the values of the variables it names as {name}. */
static void put_message(char *text, int size, const unsigned char *record, const char *message) {
    int used = 0;
    while (*message && used < size - 1) {
        const char *end = *message == '{' ? strchr(message, '}') : 0;
        const Variable *v = end ? variable_named(message + 1, (int)(end - message) - 1) : 0;
        if (v) {
            used += put_value(text + used, size - used, record, v);
            message = end + 1;
        } else
            text[used++] = *message++;
    }
    text[used < size ? used : size - 1] = 0;
}

/* What a kernel's status number means. */
Status kernel_failure(Instance *instance, const unsigned char *record, int status, double t) {
    char words[800];
    snprintf(words, sizeof words, "failed with status %d", status);
    for (int i = 0; i < component.messages; i++)
        if (component.message[i].value == status) put_message(words, sizeof words, record, component.message[i].text);
    return refuse(instance, ERROR, "%s: %s (t = %.15g s)", component.name, words, t);
}

/* What a kernel's arithmetic has refused, and where. */
Status kernel_fault(Instance *instance, const Fault *fault, double t) {
    char words[400];
    if (!strcmp(fault->what, FAULT_INDEX))
        snprintf(words, sizeof words, "the index %.0f is outside of the %.0f elements of %s", fault->value, fault->limit, fault->name);
    else if (!strcmp(fault->what, FAULT_OVERFLOW))
        snprintf(words, sizeof words, "%s%s%.17g does not fit into an integer of %.0f bits", fault->name, *fault->name ? " = " : "",
                 fault->value, fault->limit);
    else if (*fault->name)
        snprintf(words, sizeof words, "%s: %s of %.15g", fault->what, fault->name, fault->value);
    else
        snprintf(words, sizeof words, "%s", fault->what);
    return refuse(instance, ERROR, "%s: %s (%s, t = %.15g s)", component.name, words, fault->where, t);
}

/* Switch the given categories, or all of them if none is given, on or off. */
Status set_logging(Instance *instance, int on, size_t categories, const char *const category[]) {
    int mask = categories ? 0 : LOG_ALL;
    if (!check_null(instance, category, categories, "SetDebugLogging")) return ERROR;
    for (size_t i = 0; i < categories; i++) {
        int found = -1;
        for (int k = 0; k < 5; k++)
            if (category[i] && !strcmp(category[i], CATEGORIES[k])) found = k;
        if (category[i] && !strcmp(category[i], "logAll"))
            mask = LOG_ALL;
        else if (found < 0)
            return refuse(instance, ERROR, "%s: there is no log category %s", component.name, category[i] ? category[i] : "(null)");
        else
            mask |= 1 << found;
    }
    instance->log_mask = on ? instance->log_mask | mask : instance->log_mask & ~mask;
    return OK;
}
