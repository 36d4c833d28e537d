/* Numbers of all types: exact, whatever their size. */

#include "numbers.h"

#include <float.h>
#include <math.h>
#include <string.h>

static int is_real(int type) { return type == TYPE_F8 || type == TYPE_F4; }
int is_boolean(int type) { return type == TYPE_BOOLEAN2 || type == TYPE_BOOLEAN3; }

/* How many bytes a value has in the host's arrays, and in those of the FMUs inside. */
size_t value_size(int type) {
    switch (type) {
    case TYPE_F8: case TYPE_I8: case TYPE_U8: return 8;
    case TYPE_I2: case TYPE_U2: return 2;
    case TYPE_I1: case TYPE_U1: case TYPE_BOOLEAN3: return 1;
    case TYPE_STRING: case TYPE_BINARY: return sizeof(char *);
    default: return 4;
    }
}


#define WHOLE(TYPE) do { TYPE found; memcpy(&found, at, sizeof found); number.kind = A_WHOLE; number.whole = (int64_t)found; } while (0)
#define NATURAL(TYPE) do { TYPE found; memcpy(&found, at, sizeof found); number.kind = A_NATURAL; number.natural = (uint64_t)found; } while (0)

Number number_at(int type, const unsigned char *at) {
    Number number = {A_REAL, 0.0, 0, 0};
    float single;
    switch (type) {
    case TYPE_F8: memcpy(&number.real, at, 8); break;
    case TYPE_F4:
        memcpy(&single, at, 4);
        number.real = (double)single;
        break;
    case TYPE_I1: WHOLE(int8_t); break;
    case TYPE_I2: WHOLE(int16_t); break;
    case TYPE_I4: WHOLE(int32_t); break;
    case TYPE_I8: WHOLE(int64_t); break;
    case TYPE_U1: NATURAL(uint8_t); break;
    case TYPE_U2: NATURAL(uint16_t); break;
    case TYPE_U4: NATURAL(uint32_t); break;
    case TYPE_U8: NATURAL(uint64_t); break;
    case TYPE_BOOLEAN3:
        NATURAL(uint8_t);
        number.natural = number.natural != 0;
        break;
    default:
        WHOLE(int32_t);
        number.whole = number.whole != 0;
    }
    return number;
}

double as_real(Number number) {
    return number.kind == A_REAL ? number.real : number.kind == A_WHOLE ? (double)number.whole : (double)number.natural;
}

/* A real number that is whole as one; 0 in *fits if it is none. */
static Number rounded(double value, int *fits) {
    Number number = {A_WHOLE, 0.0, 0, 0};
    const double whole = floor(value + 0.5);
    *fits = whole >= -0x1p63 && whole < 0x1p64;
    if (*fits && whole >= 0x1p63) {
        number.kind = A_NATURAL;
        number.natural = (uint64_t)whole;
    } else if (*fits)
        number.whole = (int64_t)whole;
    return number;
}

static int fits_between(Number number, int64_t least, uint64_t most) {
    if (number.kind == A_WHOLE && number.whole < 0) return number.whole >= least;
    return (number.kind == A_WHOLE ? (uint64_t)number.whole : number.natural) <= most;
}

#define PUT(TYPE) do { const TYPE put = (TYPE)bits; memcpy(at, &put, sizeof put); } while (0)

/* Write a number in a type; 0 if it does not fit. */
int put_number(int type, unsigned char *at, Number number) {
    int fits = 1;
    if (is_real(type)) {
        const double real = as_real(number);
        if (type == TYPE_F8) {
            memcpy(at, &real, 8);
            return 1;
        }
        if (isfinite(real) && fabs(real) > FLT_MAX) return 0;
        const float single = (float)real;
        memcpy(at, &single, 4);
        return 1;
    }
    if (number.kind == A_REAL) number = rounded(number.real, &fits);
    if (!fits) return 0;
    const uint64_t bits = number.kind == A_WHOLE ? (uint64_t)number.whole : number.natural;
    switch (type) {
    case TYPE_I1: fits = fits_between(number, INT8_MIN, INT8_MAX); PUT(int8_t); break;
    case TYPE_I2: fits = fits_between(number, INT16_MIN, INT16_MAX); PUT(int16_t); break;
    case TYPE_I4: fits = fits_between(number, INT32_MIN, INT32_MAX); PUT(int32_t); break;
    case TYPE_I8: fits = fits_between(number, INT64_MIN, INT64_MAX); PUT(int64_t); break;
    case TYPE_U1: fits = fits_between(number, 0, UINT8_MAX); PUT(uint8_t); break;
    case TYPE_U2: fits = fits_between(number, 0, UINT16_MAX); PUT(uint16_t); break;
    case TYPE_U4: fits = fits_between(number, 0, UINT32_MAX); PUT(uint32_t); break;
    case TYPE_U8: fits = fits_between(number, 0, UINT64_MAX); PUT(uint64_t); break;
    case TYPE_BOOLEAN3: {
        const uint8_t truth = bits != 0;
        memcpy(at, &truth, 1);
        break;
    }
    default: {
        const int32_t truth = bits != 0;
        memcpy(at, &truth, 4);
    }
    }
    return fits;
}

/* What a number becomes on the way between outside and inside. */
Number converted(const Target *target, Number number) {
    for (size_t i = 0; i < target->mapped; i++)
        if (target->mapping[2 * i] == as_real(number)) {
            const Number found = {A_REAL, target->mapping[2 * i + 1], 0, 0};
            return found;
        }
    if (target->gain == 1.0 && target->offset == 0.0) return number;
    const Number scaled = {A_REAL, target->gain * as_real(number) + target->offset, 0, 0};
    return scaled;
}
