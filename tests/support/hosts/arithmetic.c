/* Changes how the processor calculates, as an FMU may, and prints results after each change, and after the loop's guard. */

#include "arithmetic.h"

#include <stdio.h>

#if defined(__x86_64__)
static const uint64_t changes[] = {0x2000, 0x4000, 0x6000, 0x8000, 0x0040, 0x8040}; /* down, up, to zero, flush, denormals are 0, both */
#else
static const uint64_t changes[] = {2 << 22, 1 << 22, 3 << 22, 1 << 24, 0, 0}; /* down, up, to zero, flush */
#endif

#define TOLD (~UINT64_C(0x3f)) /* without what MXCSR tells of operations that were done */

/* By functions of their own, as FMUs are: else the compiler may calculate before the mode is changed. */
static volatile double one = 1.0, three = 3.0, tiny = 0x1p-1060;
static __attribute__((noinline)) double third(void) { return one / three; }
static __attribute__((noinline)) double small(void) { return 2.0 * tiny; }

int main(void) {
    const uint64_t standard = loop_standard_arithmetic();
    loop_set_arithmetic_mode(standard);
    for (int i = 0; i < 6; i++) {
        loop_set_arithmetic_mode(standard | changes[i]);
        const double changed = third(), flushed = small();
        keep_arithmetic();
        const double put_back = third(), kept = small();
        const int is_standard = ((loop_arithmetic_mode() ^ standard) & TOLD) == 0;
        printf("%a %a %a %a %d %d\n", changed, flushed, put_back, kept, is_standard, arithmetic_has_changed());
    }
    return 0;
}
