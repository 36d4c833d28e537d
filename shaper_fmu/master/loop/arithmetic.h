/* How this thread's processor rounds, flushes denormal numbers and traps: an FMU that leaves it changed changes nobody's numbers.

   The mode that is kept is the one that C begins with: to the nearest, with denormal numbers, without traps. After every call
   of an FMU the loop looks whether sums are rounded as they should be, in less than a nanosecond (to read MXCSR takes four); traps,
   and what is changed in the x87 alone, are put back by the master with the rest of the process's state. Processors other than
   x86-64 and AArch64, and other compilers than gcc and clang, are not looked after. */

#ifndef ARITHMETIC_H
#define ARITHMETIC_H

#include "loop.h"

#if defined(__GNUC__) && defined(__x86_64__)

#include <emmintrin.h>

/* Single precision: to the nearest, 1 and 3/4 of its last place make the next number, and -1 the same; the others are denormal.
   The compiler must not know one of the summands, so that it makes the sum here, after the call. */
static inline int arithmetic_has_changed(void) {
    __m128 little = _mm_setr_ps(0x0.cp-23f, -0x0.cp-23f, 0x1p-140f, 0.0f);
    const __m128 big = _mm_setr_ps(1.0f, -1.0f, 0x1p-140f, 0x1p-140f);
    const __m128 expected = _mm_setr_ps(0x1.000002p0f, -0x1.000002p0f, 0x1p-139f, 0x1p-140f);
    __asm__ __volatile__("" : "+x"(little));
    /* as integers: a comparison of denormal numbers may flush them, too */
    const __m128i same = _mm_cmpeq_epi32(_mm_castps_si128(_mm_add_ps(little, big)), _mm_castps_si128(expected));
    return _mm_movemask_epi8(same) != 0xffff;
}

#elif defined(__GNUC__) && defined(__aarch64__)

static inline int arithmetic_has_changed(void) { return loop_arithmetic_mode() != 0; }

#else

static inline int arithmetic_has_changed(void) { return 0; }

#endif

void put_arithmetic_back(void);

/* After every call of an FMU. */
static inline void keep_arithmetic(void) {
    if (arithmetic_has_changed()) put_arithmetic_back();
}

#endif
