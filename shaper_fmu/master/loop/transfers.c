/* Values of any type. On the bus all of them are doubles. */

#include "transfers.h"

#include <float.h>
#include <string.h>

static size_t size_of(int type) {
    switch (type) {
    case TYPE_F8: case TYPE_I8: case TYPE_U8: return 8;
    case TYPE_I2: case TYPE_U2: return 2;
    case TYPE_I1: case TYPE_U1: case TYPE_BOOLEAN3: return 1;
    default: return 4;
    }
}

/* Write a whole number in its type, which it is known to fit into. The same memory may hold values of several types, one after
   the other, so it is copied to. */
#define WRITE(TYPE) do { const TYPE written = (TYPE)whole; memcpy(at, &written, sizeof written); } while (0)

static void write_whole(int type, char *at, double whole) {
    switch (type) {
    case TYPE_I1: WRITE(int8_t); break;
    case TYPE_U1: case TYPE_BOOLEAN3: WRITE(uint8_t); break;
    case TYPE_I2: WRITE(int16_t); break;
    case TYPE_U2: WRITE(uint16_t); break;
    case TYPE_U4: WRITE(uint32_t); break;
    case TYPE_I8: WRITE(int64_t); break;
    case TYPE_U8: WRITE(uint64_t); break;
    default: WRITE(int32_t);
    }
}

/* How many numbers a type has. */
static double numbers_of(int type) {
    switch (size_of(type)) {
    case 1: return 0x1p8;
    case 2: return 0x1p16;
    case 4: return 0x1p32;
    default: return 0x1p64;
    }
}

/* Write a value in its type; 0 if it does not fit. */
static int put(int type, char *at, double value) {
    if (type == TYPE_F8) {
        memcpy(at, &value, sizeof value);
        return 1;
    }
    if (type == TYPE_F4) {
        if (!(fabs(value) <= FLT_MAX)) return 0;
        const float single = (float)value;
        memcpy(at, &single, sizeof single);
        return 1;
    }
    if (type == TYPE_BOOLEAN2 || type == TYPE_BOOLEAN3) {
        write_whole(type, at, value != 0.0 ? 1.0 : 0.0);
        return 1;
    }
    const double whole = floor(value + 0.5);
    const int is_signed = type == TYPE_I1 || type == TYPE_I2 || type == TYPE_I4 || type == TYPE_I8;
    const double numbers = numbers_of(type);
    const double lowest = is_signed ? -0.5 * numbers : 0.0;
    if (!(lowest <= whole && whole < lowest + numbers)) return 0;
    write_whole(type, at, whole);
    return 1;
}

#define READ(TYPE) do { TYPE found; memcpy(&found, at, sizeof found); return (double)found; } while (0)

/* A value of any type as a double. */
static double taken(int type, const char *at) {
    switch (type) {
    case TYPE_F8: READ(double);
    case TYPE_F4: READ(float);
    case TYPE_I1: READ(int8_t);
    case TYPE_U1: READ(uint8_t);
    case TYPE_I2: READ(int16_t);
    case TYPE_U2: READ(uint16_t);
    case TYPE_I4: READ(int32_t);
    case TYPE_U4: READ(uint32_t);
    case TYPE_I8: READ(int64_t);
    case TYPE_U8: READ(uint64_t);
    case TYPE_BOOLEAN3: return *at != 0 ? 1.0 : 0.0;
    default: {
        int32_t found;
        memcpy(&found, at, sizeof found);
        return found != 0 ? 1.0 : 0.0;
    }
    }
}

/* What a value of a boolean, an integer or an enumeration becomes; not a number for one that is no item. */
static double mapped(const Element *element, double value) {
    for (uint32_t i = 0; i < element->mapped; i++)
        if (element->mapping[2 * i] == value) return element->mapping[2 * i + 1];
    return element->closed ? (double)NAN : value;
}

static int call(const Transfer *transfer) {
    if (!transfer->function) return 0;
    if (transfer->version < 3) return call2(transfer);
    Fmi3Transfer *const function = (Fmi3Transfer *)transfer->function;
    const int status =
        function(transfer->handle, transfer->references, transfer->reference_count, transfer->values, transfer->element_count);
    keep_arithmetic();
    return status;
}

int set_values(const System *system, Control *control, int number, double t) {
    const Transfer *const transfer = &system->transfers.at[number];
    const size_t size = size_of(transfer->type);
    char *const values = transfer->values;
    int differs = !(transfer->sparing && transfer->told);
    for (size_t i = 0; i < transfer->element_count; i++) {
        char last[8];
        memcpy(last, values + i * size, size);
        const double given = scaled(&transfer->elements[i]);
        const double value = mapped(&transfer->elements[i], given);
        if (!isfinite(value)) return fail(control, isfinite(given) ? FAULT_NO_ITEM : FAULT_NOT_FINITE, 0, number, (int)i, t);
        if (!put(transfer->type, values + i * size, value)) return fail(control, FAULT_NOT_IN_RANGE, 0, number, (int)i, t);
        differs |= memcmp(last, values + i * size, size) != 0;
    }
    if (!differs) return 1;
    system->transfers.at[number].told = 1;
    return judge(control, call(transfer), number, -1, t);
}

void keep_values(const Transfer *transfer) {
    const size_t size = size_of(transfer->type);
    const char *const values = transfer->values;
    for (size_t i = 0; i < transfer->element_count; i++) {
        const Element *const element = &transfer->elements[i];
        const double value = taken(transfer->type, values + i * size);
        *element->bus = element->gain == 1.0 ? value : element->gain * value + element->shift; /* a negated alias of FMI 1.0 */
    }
}

int call_again(const System *system, Control *control, int number, double t) {
    return judge(control, call(&system->transfers.at[number]), number, -1, t);
}

int ask_leniently(const System *system, int number) { return call(&system->transfers.at[number]); }

int get_values(const System *system, Control *control, int number, double t) {
    if (!call_again(system, control, number, t)) return 0;
    keep_values(&system->transfers.at[number]);
    return 1;
}
