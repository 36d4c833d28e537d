/* Values of outer variables: inputs and outputs on the loop's bus, and what calls of the FMUs inside set and read. */

#include "numbers.h"

#include "fmi.h"

#include <math.h>
#include <string.h>

/* Whether a host's function moves variables of this type: fmi2Integer moves enumerations, too, as fmi3Int64 does. */
static int moves(int fmi, int type, int of_variable) {
    if (is_boolean(type)) return is_boolean(of_variable);
    if (fmi == FOR_FMI2 && type == TYPE_I4) return of_variable == TYPE_I4 || of_variable == TYPE_I8;
    return type == of_variable;
}

/* The variable of a value reference, if the function moves it; else null, and says so. The last reference is that of the time. */
static Variable *find(Container *container, const char *function, int fmi, int type, uint32_t reference) {
    if (reference >= container->variables || !*container->variable[reference].name) {
        complain(container, ERROR, "%s: %s: there is no variable with the value reference %lu", container->name, function,
               (unsigned long)reference);
        return 0;
    }
    Variable *const variable = &container->variable[reference];
    if (moves(fmi, type, variable->type)) return variable;
    complain(container, ERROR, "%s: %s: %s is of another type", container->name, function, variable->name);
    return 0;
}

static int is_time(const Container *container, int fmi, int type, uint32_t reference) {
    return fmi && type == TYPE_F8 && reference == container->variables;
}

/* Whether the values are as many as the variables have elements; if not, says so. */
static int check(Container *container, const char *function, int fmi, int type, const uint32_t *references, size_t count,
                 const void *values, const size_t *sizes, size_t value_count, int with_time) {
    size_t needed = 0;
    if (count && (!references || !values || (type == TYPE_BINARY && !sizes))) {
        complain(container, ERROR, "%s: %s: a pointer is null", container->name, function);
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = 0;
        if (!(with_time && is_time(container, fmi, type, references[i])) &&
            !(variable = find(container, function, fmi, type, references[i])))
            return 0;
        needed += variable ? variable->slots : 1;
    }
    if (needed == value_count) return 1;
    complain(container, ERROR, "%s: %s: the variables have %lu elements, but there are %lu values", container->name, function,
           (unsigned long)needed, (unsigned long)value_count);
    return 0;
}

static int may_be_set(Container *container, const char *function, const Variable *variable) {
    const int before = container->phase & (INSTANTIATED | INITIALIZING);
    if (variable->settable == ALWAYS || variable->settable == AN_INPUT || (variable->settable == BEFORE_START && before)) return 1;
    complain(container, ERROR, "%s: %s: %s %s", container->name, function, variable->name,
           variable->settable == NEVER ? "cannot be set" : "cannot be set after initialization");
    return 0;
}

/* Have an FMU inside take what waits for it. */
static Status set_whole(Container *container, Whole *whole) {
    Inner *const inner = &container->inner[whole->inner];
    whole->waiting = 0;
    if (!whole->set)
        return lacks(container, inner, whole->set_name);
    const int status = inner->version == 2 ? ((Fmi2Transfer *)whole->set)(inner->handle, &whole->reference, 1, whole->values)
                                           : ((Fmi3Transfer *)whole->set)(inner->handle, &whole->reference, 1, whole->values, whole->length);
    return judge_call(container, inner, whole->set_name, status);
}

Status set_waiting(Container *container) {
    Status worst = OK;
    container->waiting = 0;
    for (size_t i = 0; i < container->wholes; i++) {
        if (!container->whole[i].waiting) continue;
        const Status status = set_whole(container, &container->whole[i]);
        if (status > worst) worst = status;
    }
    return worst;
}

static Status read_whole(Container *container, Whole *whole) {
    Inner *const inner = &container->inner[whole->inner];
    if (!whole->get)
        return lacks(container, inner, whole->get_name);
    const int status = inner->version == 2 ? ((Fmi2Transfer *)whole->get)(inner->handle, &whole->reference, 1, whole->values)
                                           : ((Fmi3Transfer *)whole->get)(inner->handle, &whole->reference, 1, whole->values, whole->length);
    return judge_call(container, inner, whole->get_name, status);
}

/* Whether a value can be put where it belongs; if not, says so. On the bus all are doubles, which have whole numbers up to 2^53. */
static int can_put(Container *container, const char *function, const Variable *variable, const Slot *slot, int type,
                   const unsigned char *value) {
    const Number number = number_at(type, value);
    int fits = !variable->on_bus || number.kind == A_REAL || fabs(as_real(number)) <= 0x1p53;
    for (size_t i = 0; !variable->on_bus && i < slot->targets; i++) {
        unsigned char tried[8];
        fits = fits && put_number(container->whole[slot->target[i].place].type, tried, converted(&slot->target[i], number));
    }
    if (!fits) complain(container, ERROR, "%s: %s: the value of %s does not fit into its type", container->name, function, variable->name);
    return fits;
}

/* Whether texts or binaries can be passed in; if not, says so. */
static int can_pass_in(Container *container, const char *function, const Variable *variable, const void *values, const size_t *sizes) {
    for (size_t i = 0; i < variable->slots; i++)
        if (!((const void *const *)values)[i] && (!sizes || sizes[i])) {
            complain(container, ERROR, "%s: %s: the value of %s is a null pointer", container->name, function, variable->name);
            return 0;
        }
    for (size_t i = 0; variable->slots && i < variable->slot[0].targets; i++)
        if (container->whole[variable->slot[0].target[i].place].length != variable->slots) {
            complain(container, ERROR, "%s: %s: %s is a part of an array of texts, which is set as a whole", container->name, function,
                     variable->name);
            return 0;
        }
    return 1;
}

/* Put a value where it belongs, as it can be; of a whole it is set later, with all others. */
static void put(Container *container, const Variable *variable, const Slot *slot, int type, const unsigned char *value) {
    for (size_t i = 0; i < slot->targets; i++) {
        const Target *const target = &slot->target[i];
        if (variable->on_bus) {
            const double given = as_real(number_at(type, value));
            double *const place = &container->system.bus.at[target->place];
            container->dirty |= memcmp(place, &given, sizeof given) != 0;
            *place = given;
            continue;
        }
        Whole *const whole = &container->whole[target->place];
        unsigned char *const at = (unsigned char *)whole->values + (size_t)target->element * value_size(whole->type);
        put_number(whole->type, at, converted(target, number_at(type, value)));
        whole->waiting = 1;
    }
}

/* Have the FMUs take what has been put; in the modes in which FMI allows it, or at the next event. */
static Status flush(Container *container, const Variable *variable) {
    Status worst = OK;
    for (size_t k = 0; k < variable->slots; k++)
        for (size_t i = 0; i < variable->slot[k].targets; i++) {
            Whole *const whole = &container->whole[variable->slot[k].target[i].place];
            if (!whole->waiting) continue;
            if (whole->in_event_mode && container->phase & (STEPPING | EVENT)) {
                container->waiting = 1;
                continue;
            }
            const Status status = set_whole(container, whole);
            if (status > worst) worst = status;
        }
    if (container->phase == INITIALIZING) container->dirty = 1;
    return worst;
}

/* Texts, and FMI 3.0's binaries, go through as they are. */
static Status pass_in(Container *container, const Variable *variable, const void *values, const size_t *sizes) {
    Status worst = OK;
    for (size_t i = 0; variable->slots && i < variable->slot[0].targets; i++) {
        Whole *const whole = &container->whole[variable->slot[0].target[i].place];
        Inner *const inner = &container->inner[whole->inner];
        typedef int SetTexts2(void *, const uint32_t *, size_t, const void *);
        typedef int SetTexts3(void *, const uint32_t *, size_t, const void *, size_t);
        typedef int SetBinary(void *, const uint32_t *, size_t, const size_t *, const void *, size_t);
        if (!whole->set)
            return lacks(container, inner, whole->set_name);
        int status;
        if (whole->type == TYPE_BINARY)
            status = ((SetBinary *)whole->set)(inner->handle, &whole->reference, 1, sizes, values, whole->length);
        else if (inner->version == 2)
            status = ((SetTexts2 *)whole->set)(inner->handle, &whole->reference, 1, values);
        else
            status = ((SetTexts3 *)whole->set)(inner->handle, &whole->reference, 1, values, whole->length);
        const Status judged = judge_call(container, inner, whole->set_name, status);
        if (judged > worst) worst = judged;
    }
    return worst;
}

static Status pass_out(Container *container, const Variable *variable, void *values, size_t *sizes) {
    typedef int GetBinary(void *, const uint32_t *, size_t, size_t *, void *, size_t);
    if (!variable->slots) return OK;
    Whole *const whole = &container->whole[variable->slot[0].target[0].place];
    Inner *const inner = &container->inner[whole->inner];
    if (whole->type != TYPE_BINARY) {
        const Status status = read_whole(container, whole);
        for (size_t k = 0; k < variable->slots && status <= WARNING; k++)
            ((const char **)values)[k] = ((const char *const *)whole->values)[variable->slot[k].target[0].element];
        return status;
    }
    if (!whole->get)
        return lacks(container, inner, whole->get_name);
    const int status = ((GetBinary *)whole->get)(inner->handle, &whole->reference, 1, sizes, values, whole->length);
    return judge_call(container, inner, whole->get_name, status);
}

/* Whether all can be set, before any is. */
static int can_set(Container *container, const char *function, int type, const uint32_t *references, size_t count, const void *values,
                   const size_t *sizes) {
    const unsigned char *at = (const unsigned char *)values;
    for (size_t i = 0; i < count; i++) {
        const Variable *const variable = &container->variable[references[i]];
        if (!may_be_set(container, function, variable)) return 0;
        if (type >= TYPE_STRING && !can_pass_in(container, function, variable, at, sizes)) return 0;
        for (size_t k = 0; type < TYPE_STRING && k < variable->slots; k++)
            if (!can_put(container, function, variable, &variable->slot[k], type, at + k * value_size(type))) return 0;
        at += variable->slots * value_size(type);
        if (sizes) sizes += variable->slots;
    }
    return 1;
}

Status set_variables(Container *container, const char *function, int fmi, int type, const uint32_t *references, size_t count,
                     const void *values, const size_t *sizes, size_t value_count) {
    if (!check(container, function, fmi, type, references, count, values, sizes, value_count, 0)) return ERROR;
    if (!can_set(container, function, type, references, count, values, sizes)) return ERROR;
    Status worst = OK;
    const unsigned char *at = (const unsigned char *)values;
    for (size_t i = 0; i < count && worst <= WARNING; i++) {
        const Variable *const variable = &container->variable[references[i]];
        Status status = OK;
        if (type >= TYPE_STRING)
            status = pass_in(container, variable, at, sizes);
        else
            for (size_t k = 0; k < variable->slots; k++) put(container, variable, &variable->slot[k], type, at + k * value_size(type));
        if (type < TYPE_STRING && !variable->on_bus) status = flush(container, variable);
        at += variable->slots * value_size(type);
        if (sizes) sizes += variable->slots;
        if (status > worst) worst = status;
    }
    return worst;
}

/* Read the elements of a variable. */
static Status get(Container *container, const char *function, const Variable *variable, int type, unsigned char *values) {
    int last = -1;
    for (size_t k = 0; k < variable->slots; k++) {
        const Target *const target = &variable->slot[k].target[0];
        Number number = {A_REAL, 0.0, 0, 0};
        if (variable->on_bus)
            number.real = container->system.bus.at[target->place];
        else {
            Whole *const whole = &container->whole[target->place];
            const Status status = target->place == last || whole->waiting ? OK : read_whole(container, whole);
            if (status > WARNING) return status;
            last = target->place;
            number = number_at(whole->type, (unsigned char *)whole->values + (size_t)target->element * value_size(whole->type));
        }
        if (variable->settable != AN_INPUT || !variable->on_bus) number = converted(target, number);
        if (!put_number(type, values + k * value_size(type), number))
            return complain(container, ERROR, "%s: %s: the value of %s does not fit into its type", container->name, function, variable->name);
    }
    return OK;
}

Status get_variables(Container *container, const char *function, int fmi, int type, const uint32_t *references, size_t count,
                     void *values, size_t *sizes, size_t value_count) {
    if (!check(container, function, fmi, type, references, count, values, sizes, value_count, 1)) return ERROR;
    Status worst = container->dirty ? look_through(container) : OK;
    unsigned char *at = (unsigned char *)values;
    for (size_t i = 0; i < count && worst <= WARNING; i++) {
        if (is_time(container, fmi, type, references[i])) {
            memcpy(at, &container->control.t, 8);
            at += 8;
            continue;
        }
        const Variable *const variable = &container->variable[references[i]];
        const Status status = type >= TYPE_STRING ? pass_out(container, variable, at, sizes) : get(container, function, variable, type, at);
        at += variable->slots * value_size(type);
        if (sizes) sizes += variable->slots;
        if (status > worst) worst = status;
    }
    return worst;
}
