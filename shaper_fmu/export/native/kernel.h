/* What kernels in C need beside the mathematics library: Python's arithmetic, with a fault where Python raises an error.

   Integers have 64 bits, in the record 32. A fault is kept, the first one alone, and the kernel goes on with a harmless
   value to its end: nothing is read or written outside of the record, and no loop that a fault has spoiled goes on. Where
   the bounds of the operands are known to exclude a fault, the plain operator stands in place of these functions. Compile
   without contraction of products and sums (-ffp-contract=off) and without -ffast-math: then results are Python's. */

#ifndef SHAPER_FMU_KERNEL_H
#define SHAPER_FMU_KERNEL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    const char *what;  /* happened; null: nothing */
    const char *name;  /* of the array, the variable or the function, or empty */
    const char *where; /* file:line of the Python source */
    double value;      /* that did not fit */
    double limit;      /* the array's size */
} Fault;

#define FAULT_INDEX "index out of range"
#define FAULT_ZERO "division by zero"
#define FAULT_DOMAIN "math domain error"
#define FAULT_RANGE "math range error"
#define FAULT_OVERFLOW "integer out of range"
#define FAULT_NO_INTEGER "cannot convert to an integer"
#define FAULT_COMPLEX "the power of a negative number is complex"
#define FAULT_SHIFT "negative shift count"

/* Inside of its library alone, where a platform can tell: every FMU of a process has kernels of these names. */
#if defined(NOT_EXPORTED)
/* as defined by who compiles it */
#elif defined(__GNUC__) && !defined(_WIN32)
#define NOT_EXPORTED __attribute__((visibility("hidden")))
#else
#define NOT_EXPORTED
#endif

/* What a component's kernels.c defines: 0 or the number of a message, and a fault if there was one. */
#ifdef __cplusplus
extern "C" {
#endif
NOT_EXPORTED int kernel_start(void *record, Fault *fault);
NOT_EXPORTED int kernel_step(void *record, double t, double h, Fault *fault);
#ifdef __cplusplus
}
#endif

static inline void set_fault(Fault *fault, const char *what, const char *name, double value, double limit, const char *where) {
    if (fault->what) return;
    fault->what = what;
    fault->name = name;
    fault->where = where;
    fault->value = value;
    fault->limit = limit;
}

/* The index of an element, counted from the end if it is negative. */
static inline int64_t checked_index(Fault *fault, int64_t i, int64_t size, const char *name, const char *where) {
    if (i >= 0 && i < size) return i;
    if (i < 0 && i >= -size) return i + size;
    set_fault(fault, FAULT_INDEX, name, (double)i, (double)size, where);
    return 0;
}

/* Integers: what does not fit into 64 bits is a fault, and 0. */

static inline int64_t overflow(Fault *fault, double value, const char *where) {
    set_fault(fault, FAULT_OVERFLOW, "", value, 64.0, where);
    return 0;
}

static inline int64_t checked_sum(Fault *fault, int64_t a, int64_t b, const char *where) {
    if (b > 0 ? a > INT64_MAX - b : a < INT64_MIN - b) return overflow(fault, (double)a + (double)b, where);
    return a + b;
}

static inline int64_t checked_difference(Fault *fault, int64_t a, int64_t b, const char *where) {
    if (b > 0 ? a < INT64_MIN + b : a > INT64_MAX + b) return overflow(fault, (double)a - (double)b, where);
    return a - b;
}

static inline int64_t checked_product(Fault *fault, int64_t a, int64_t b, const char *where) {
    bool fits = a == 0 || b == 0;
    if (!fits) {
        if (a > 0)
            fits = b > 0 ? a <= INT64_MAX / b : b >= INT64_MIN / a;
        else
            fits = b > 0 ? a >= INT64_MIN / b : b >= INT64_MAX / a;
    }
    return fits ? a * b : overflow(fault, (double)a * (double)b, where);
}

static inline int64_t checked_negative(Fault *fault, int64_t a, const char *where) {
    return a == INT64_MIN ? overflow(fault, -(double)a, where) : -a;
}

static inline int64_t checked_magnitude(Fault *fault, int64_t a, const char *where) {
    return a < 0 ? checked_negative(fault, a, where) : a;
}

static inline int64_t magnitude(int64_t a) { return a < 0 ? -a : a; }

/* a // b and a % b round towards minus infinity. */
static inline int64_t floor_quotient(int64_t a, int64_t b) { return a / b - (a % b != 0 && (a < 0) != (b < 0)); }

static inline int64_t floor_remainder(int64_t a, int64_t b) {
    int64_t r = a % b;
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}

static inline int64_t checked_quotient(Fault *fault, int64_t a, int64_t b, const char *where) {
    if (b == 0) return set_fault(fault, FAULT_ZERO, "", (double)a, 0.0, where), (int64_t)0;
    if (b == -1) return checked_negative(fault, a, where);
    return floor_quotient(a, b);
}

static inline int64_t checked_remainder(Fault *fault, int64_t a, int64_t b, const char *where) {
    if (b == 0) return set_fault(fault, FAULT_ZERO, "", (double)a, 0.0, where), (int64_t)0;
    return b == -1 ? 0 : floor_remainder(a, b);
}

/* a ** n for n >= 0 */
static inline int64_t checked_power(Fault *fault, int64_t a, int64_t n, const char *where) {
    int64_t power = 1;
    if (a == 0 || a == 1) return n == 0 ? 1 : a;
    if (a == -1) return n % 2 ? -1 : 1;
    for (; n > 0 && !fault->what; n--) power = checked_product(fault, power, a, where);
    return power;
}

static inline int64_t shift_left(Fault *fault, int64_t a, int64_t n, const char *where) {
    if (n < 0) return set_fault(fault, FAULT_SHIFT, "", (double)n, 0.0, where), (int64_t)0;
    if (a == 0) return 0;
    if (n > 62) return overflow(fault, ldexp((double)a, n > 1000 ? 1000 : (int)n), where);
    return checked_product(fault, a, (int64_t)1 << n, where);
}

static inline int64_t shift_right(Fault *fault, int64_t a, int64_t n, const char *where) {
    if (n < 0) return set_fault(fault, FAULT_SHIFT, "", (double)n, 0.0, where), (int64_t)0;
    if (n > 62) return a < 0 ? -1 : 0;
    return floor_quotient(a, (int64_t)1 << n);
}

/* An integer for a variable of the record. */
static inline int32_t integer32(Fault *fault, int64_t n, const char *name, const char *where) {
    if (n >= INT32_MIN && n <= INT32_MAX) return (int32_t)n;
    set_fault(fault, FAULT_OVERFLOW, name, (double)n, 32.0, where);
    return 0;
}

/* A real number that is whole, as an integer. */
static inline int64_t integer(Fault *fault, double whole, const char *name, const char *where) {
    if (whole >= -9223372036854775808.0 && whole < 9223372036854775808.0) return (int64_t)whole;
    set_fault(fault, isfinite(whole) ? FAULT_OVERFLOW : FAULT_NO_INTEGER, name, whole, 64.0, where);
    return 0;
}

/* An integer as a real number, where it must be exact. */
static inline double exact_real(Fault *fault, int64_t n, const char *where) {
    if (n < -9007199254740992 || n > 9007199254740992) set_fault(fault, FAULT_OVERFLOW, "", (double)n, 54.0, where);
    return (double)n;
}

/* Less than, equal to or greater than 0, as an integer is to a real number; NaN if that is NaN. */
static inline double compared(int64_t n, double x) {
    int64_t whole;
    if (!((double)n == x)) return isnan(x) ? x : (double)n < x ? -1.0 : 1.0;
    if (x >= 9223372036854775808.0) return -1.0;
    whole = (int64_t)x; /* x has no fraction: it is as large as the rounded n */
    return n < whole ? -1.0 : n > whole ? 1.0 : 0.0;
}

static inline int64_t smaller_integer(int64_t a, int64_t b) { return b < a ? b : a; }
static inline int64_t larger_integer(int64_t a, int64_t b) { return b > a ? b : a; }

/* Real numbers. The first argument is kept where the second is NaN, as by Python's min and max. */

static inline double smaller(double a, double b) { return b < a ? b : a; }
static inline double larger(double a, double b) { return b > a ? b : a; }

static inline double divided(Fault *fault, double a, double b, const char *where) {
    if (b == 0.0) return set_fault(fault, FAULT_ZERO, "", a, 0.0, where), 0.0;
    return a / b;
}

/* a % b with the sign of b, b not 0 */
static inline double real_remainder(double a, double b) {
    double r = fmod(a, b);
    if (r == 0.0) return copysign(0.0, b);
    return (b < 0.0) != (r < 0.0) ? r + b : r;
}

/* a // b, b not 0: the whole number at which a - b n is the remainder */
static inline double real_floor_quotient(double a, double b) {
    double r = fmod(a, b), n = (a - r) / b;
    if (r != 0.0 && (b < 0.0) != (r < 0.0)) n -= 1.0;
    if (n == 0.0) return copysign(0.0, a / b);
    return n - floor(n) > 0.5 ? floor(n) + 1.0 : floor(n);
}

static inline double checked_real_remainder(Fault *fault, double a, double b, const char *where) {
    if (b == 0.0) return set_fault(fault, FAULT_ZERO, "", a, 0.0, where), 0.0;
    return real_remainder(a, b);
}

static inline double checked_real_quotient(Fault *fault, double a, double b, const char *where) {
    if (b == 0.0) return set_fault(fault, FAULT_ZERO, "", a, 0.0, where), 0.0;
    return real_floor_quotient(a, b);
}

/* a ** b */
static inline double real_power(Fault *fault, double a, double b, const char *where) {
    double power = pow(a, b);
    if (a == 0.0 && b < 0.0 && isfinite(b))
        set_fault(fault, FAULT_ZERO, "", b, 0.0, where);
    else if (isnan(power) && !isnan(a) && !isnan(b))
        set_fault(fault, FAULT_COMPLEX, "", a, 0.0, where);
    else if (isinf(power) && isfinite(a) && isfinite(b))
        set_fault(fault, FAULT_RANGE, "**", a, 0.0, where);
    return power;
}

/* An element that a number is looked for among; in Python the same NaN is found there, another one is not. */
static inline double no_nan(Fault *fault, double sought, double element, const char *where) {
    if (isnan(sought) && isnan(element)) set_fault(fault, "NaN is looked for among values", "", sought, 0.0, where);
    return element;
}

/* What a function of the mathematics library has found for x. NaN and infinity are no answers to a finite number. */
static inline double answer(Fault *fault, double found, double x, const char *what, const char *name, const char *where) {
    if (isfinite(found) || isnan(x) || (isinf(found) && isinf(x))) return found;
    set_fault(fault, isnan(found) ? FAULT_DOMAIN : what, name, x, 0.0, where);
    return found;
}

static inline double answer2(Fault *fault, double found, double x, double y, const char *name, const char *where) {
    if (isfinite(found) || isnan(x) || isnan(y) || (isinf(found) && (isinf(x) || isinf(y)))) return found;
    set_fault(fault, isnan(found) ? FAULT_DOMAIN : FAULT_RANGE, name, x, 0.0, where);
    return found;
}

#define CHECKED(function, infinite) \
    static inline double checked_##function(Fault *fault, double x, const char *where) { \
        return answer(fault, function(x), x, infinite, #function, where); \
    }
CHECKED(sqrt, FAULT_RANGE)
CHECKED(cbrt, FAULT_RANGE)
CHECKED(exp, FAULT_RANGE)
CHECKED(exp2, FAULT_RANGE)
CHECKED(expm1, FAULT_RANGE)
CHECKED(log, FAULT_DOMAIN)
CHECKED(log2, FAULT_DOMAIN)
CHECKED(log10, FAULT_DOMAIN)
CHECKED(log1p, FAULT_DOMAIN)
CHECKED(sin, FAULT_RANGE)
CHECKED(cos, FAULT_RANGE)
CHECKED(tan, FAULT_RANGE)
CHECKED(asin, FAULT_RANGE)
CHECKED(acos, FAULT_RANGE)
CHECKED(sinh, FAULT_RANGE)
CHECKED(cosh, FAULT_RANGE)
CHECKED(acosh, FAULT_RANGE)
CHECKED(atanh, FAULT_DOMAIN)
CHECKED(tgamma, FAULT_DOMAIN)
CHECKED(lgamma, FAULT_DOMAIN)
#undef CHECKED

static inline double checked_fmod(Fault *fault, double x, double y, const char *where) {
    return answer2(fault, fmod(x, y), x, y, "fmod", where);
}

static inline double checked_pow(Fault *fault, double x, double y, const char *where) {
    if (x == 0.0 && y < 0.0 && isfinite(y)) set_fault(fault, FAULT_DOMAIN, "pow", y, 0.0, where);
    return answer2(fault, pow(x, y), x, y, "pow", where);
}

/* How often a loop runs over range(begin, end, step). */
static inline int64_t range_length(Fault *fault, int64_t begin, int64_t end, int64_t step, const char *where) {
    uint64_t far, by;
    if (step == 0) return set_fault(fault, FAULT_ZERO, "range", 0.0, 0.0, where), (int64_t)0;
    if (step > 0 ? begin >= end : begin <= end) return 0;
    far = step > 0 ? (uint64_t)end - (uint64_t)begin : (uint64_t)begin - (uint64_t)end;
    by = step > 0 ? (uint64_t)step : 0u - (uint64_t)step;
    return (int64_t)((far - 1u) / by + 1u);
}

#endif
