/* Resident memory before and after many instances and many saved states: memory LIBRARY FMI TOKEN INSTANCES STATES

   Prints two lines of two numbers: kilobytes before and after the instances, and the same for the states. */

#include "library.h"

#include <dirent.h>
#include <unistd.h>

static long resident_kilobytes(void) {
    long total = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &total, &resident) != 2) exit(4);
    fclose(file);
    return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

static int open_files(void) {
    int found = 0;
    DIR *files = opendir("/proc/self/fd");
    while (files && readdir(files)) found++;
    if (files) closedir(files);
    return found;
}

static void one_life(void *library, int fmi, const char *token, int initialized) {
    void *fmu = new_fmu(library, fmi, token);
    if (initialized) {
        begin(library, fmi, fmu), end_begin(library, fmi, fmu);
        MUST(step_fmu(library, fmi, fmu, 0.0, 0.01));
    }
    fmi == 2 ? GET(fmi2FreeInstance)(fmu) : GET(fmi3FreeInstance)(fmu);
}

/* Save, serialize, restore from the bytes, and free both states. */
static void one_state(void *library, int fmi, void *fmu, void *bytes, size_t size) {
    void *state = 0, *copy = 0;
    if (fmi == 2) {
        MUST(GET(fmi2GetFMUstate)(fmu, &state));
        MUST(GET(fmi2SerializeFMUstate)(fmu, state, bytes, size));
        MUST(GET(fmi2DeSerializeFMUstate)(fmu, bytes, size, &copy));
        MUST(GET(fmi2SetFMUstate)(fmu, copy));
        MUST(GET(fmi2FreeFMUstate)(fmu, &state));
        MUST(GET(fmi2FreeFMUstate)(fmu, &copy));
    } else {
        MUST(GET(fmi3GetFMUState)(fmu, &state));
        MUST(GET(fmi3SerializeFMUState)(fmu, state, bytes, size));
        MUST(GET(fmi3DeserializeFMUState)(fmu, bytes, size, &copy));
        MUST(GET(fmi3SetFMUState)(fmu, copy));
        MUST(GET(fmi3FreeFMUState)(fmu, &state));
        MUST(GET(fmi3FreeFMUState)(fmu, &copy));
    }
}

int main(int count, char **argument) {
    if (count != 6) return 1;
    int fmi = atoi(argument[2]);
    const char *token = argument[3];
    long instances = atol(argument[4]), states = atol(argument[5]);
    void *library = open_library(argument[1]);
    for (long i = 0; i < 1000 && i < instances; i++) one_life(library, fmi, token, 0); /* warm-up: the allocator keeps some pages */
    for (long i = 0; i < 3; i++) one_life(library, fmi, token, 1);
    long before = resident_kilobytes();
    const int open_before = open_files();
    for (long i = 0; i < instances; i++) one_life(library, fmi, token, i % 100 == 0);
    printf("%ld %ld\n", before, resident_kilobytes());
    if (open_files() != open_before) return fprintf(stderr, "files are left open\n"), 5;
    void *fmu = new_fmu(library, fmi, token);
    begin(library, fmi, fmu), end_begin(library, fmi, fmu);
    size_t size = 0;
    void *first = 0;
    if (fmi == 2) {
        MUST(GET(fmi2GetFMUstate)(fmu, &first));
        MUST(GET(fmi2SerializedFMUstateSize)(fmu, first, &size));
        MUST(GET(fmi2FreeFMUstate)(fmu, &first));
    } else {
        MUST(GET(fmi3GetFMUState)(fmu, &first));
        MUST(GET(fmi3SerializedFMUStateSize)(fmu, first, &size));
        MUST(GET(fmi3FreeFMUState)(fmu, &first));
    }
    void *bytes = malloc(size);
    for (long i = 0; i < 1000 && i < states; i++) one_state(library, fmi, fmu, bytes, size);
    before = resident_kilobytes();
    for (long i = 0; i < states; i++) one_state(library, fmi, fmu, bytes, size);
    printf("%ld %ld\n", before, resident_kilobytes());
    return 0;
}
