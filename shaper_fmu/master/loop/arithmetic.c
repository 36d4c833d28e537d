/* The registers that say how a processor calculates. */

#include "arithmetic.h"

#if defined(__GNUC__) && defined(__x86_64__)

/* MXCSR, and above it the control word of the x87, whose long double some FMUs calculate with: of 53 bits on Windows, of 64
   elsewhere. */
#if defined(_WIN32)
#define STANDARD (UINT64_C(0x27f) << 32 | 0x1f80)
#else
#define STANDARD (UINT64_C(0x37f) << 32 | 0x1f80)
#endif

uint64_t loop_arithmetic_mode(void) {
    uint16_t x87;
    __asm__ __volatile__("fnstcw %0" : "=m"(x87));
    return (uint64_t)x87 << 32 | _mm_getcsr();
}

void loop_set_arithmetic_mode(uint64_t mode) {
    const uint16_t x87 = (uint16_t)(mode >> 32);
    _mm_setcsr((unsigned)mode);
    __asm__ __volatile__("fnclex\n\tfldcw %0" : : "m"(x87) : "memory");
}

#elif defined(__GNUC__) && defined(__aarch64__)

#define STANDARD 0

uint64_t loop_arithmetic_mode(void) {
    uint64_t mode;
    __asm__ __volatile__("mrs %0, fpcr" : "=r"(mode));
    return mode;
}

void loop_set_arithmetic_mode(uint64_t mode) { __asm__ __volatile__("msr fpcr, %0" : : "r"(mode) : "memory"); }

#else

#define STANDARD 0

uint64_t loop_arithmetic_mode(void) { return STANDARD; }

void loop_set_arithmetic_mode(uint64_t mode) { (void)mode; }

#endif

uint64_t loop_standard_arithmetic(void) { return STANDARD; }

void put_arithmetic_back(void) { loop_set_arithmetic_mode(STANDARD); }
