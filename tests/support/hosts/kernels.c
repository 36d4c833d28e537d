/* Runs kernel_step on every record of the standard input, and writes each with what it has become and whether there was a fault. */

#include "kernel.h"
#include "record.h"

#include <stdio.h>

int main(void) {
    static Record record;
    while (fread(&record, sizeof record, 1, stdin) == 1) {
        Fault fault = {0, 0, 0, 0.0, 0.0};
        int32_t status = kernel_step(&record, 0.0, 0.1, &fault), failed = fault.what || status;
        fwrite(&record, sizeof record, 1, stdout);
        fwrite(&failed, sizeof failed, 1, stdout);
    }
    return 0;
}
