/* A container under a host's own arithmetic: rounding LIBRARY FMI TOKEN INPUT OUTPUT MODE

   MODE is what the host sets in MXCSR, in hexadecimal. Prints the bits of the output after each step, then 1 if the mode was kept after
   every call. */

#include "library.h"

#include <xmmintrin.h>

#define TOLD 0x3fu /* what MXCSR tells of operations that were done */

int main(int count, char **argument) {
    if (count != 7) return 1;
    void *library = open_library(argument[1]);
    const int fmi = atoi(argument[2]);
    const unsigned input = (unsigned)atoi(argument[4]), output = (unsigned)atoi(argument[5]);
    const unsigned mode = (unsigned)strtoul(argument[6], 0, 16);
    int kept = 1;
    uint64_t bits[60];
#define LOOK kept &= (_mm_getcsr() & ~TOLD) == (mode & ~TOLD)
    _mm_setcsr(mode);
    void *fmu = new_fmu(library, fmi, argument[3]);
    LOOK;
    begin(library, fmi, fmu);
    double one = 1.0;
    reals(library, fmi, fmu, 1, input, 1, &one);
    LOOK;
    end_begin(library, fmi, fmu);
    for (int i = 0; i < 60; i++) {
        double value;
        MUST(step_fmu(library, fmi, fmu, i / 128.0, 1.0 / 128.0)); /* exact in any mode */
        LOOK;
        reals(library, fmi, fmu, 0, output, 1, &value);
        LOOK;
        memcpy(&bits[i], &value, sizeof value);
    }
    fmi == 2 ? GET(fmi2FreeInstance)(fmu) : GET(fmi3FreeInstance)(fmu);
    LOOK;
    _mm_setcsr(0x1f80);
    for (int i = 0; i < 60; i++) printf("%016llx\n", (unsigned long long)bits[i]);
    printf("%d\n", kept);
    return 0;
}
