/* Instances in threads at once: threads LIBRARY FMI TOKEN OUTPUT SIZE INPUT SIZE STEPS [serial]

   Each of eight threads makes an instance, gives it an input that is its own, does the steps, and frees it; twice. Prints
   the bits of the output after every step, thread by thread. INPUT is -1 if there is none. SIZE is the number of elements of
   an array, which all get the same value; the first one is printed. */

#include "library.h"

#include <math.h>
#include <pthread.h>

enum { THREADS = 8, LARGEST = 64 };

static void *library;
static const char *token;
static int fmi, output, output_size, input, input_size, steps;
static pthread_barrier_t start;

typedef struct {
    int number, together;
    double *found;
} Task;

static void *work(void *argument) {
    Task *task = argument;
    for (int round = 0; round < 2; round++) {
        if (task->together) pthread_barrier_wait(&start);
        void *fmu = new_fmu(library, fmi, token);
        begin(library, fmi, fmu), end_begin(library, fmi, fmu);
        for (int i = 0; i < steps; i++) {
            double value[LARGEST];
            for (int k = 0; k < LARGEST; k++) value[k] = sin(0.1 * i + task->number);
            if (input >= 0) reals(library, fmi, fmu, 1, (unsigned)input, (size_t)input_size, value);
            MUST(step_fmu(library, fmi, fmu, 0.01 * i, 0.01));
            reals(library, fmi, fmu, 0, (unsigned)output, (size_t)output_size, value);
            task->found[round * steps + i] = value[0];
        }
        fmi == 2 ? GET(fmi2FreeInstance)(fmu) : GET(fmi3FreeInstance)(fmu);
    }
    return 0;
}

int main(int count, char **argument) {
    if (count < 9) return 1;
    library = open_library(argument[1]);
    fmi = atoi(argument[2]), token = argument[3], output = atoi(argument[4]), output_size = atoi(argument[5]);
    input = atoi(argument[6]), input_size = atoi(argument[7]), steps = atoi(argument[8]);
    if (output_size > LARGEST || input_size > LARGEST) return 1;
    int together = count == 9;
    Task task[THREADS];
    pthread_t thread[THREADS];
    pthread_barrier_init(&start, 0, THREADS);
    for (int i = 0; i < THREADS; i++) task[i] = (Task){i, together, calloc((size_t)(2 * steps), sizeof(double))};
    for (int i = 0; i < THREADS; i++) {
        if (together)
            pthread_create(&thread[i], 0, work, &task[i]);
        else
            work(&task[i]);
    }
    for (int i = 0; together && i < THREADS; i++) pthread_join(thread[i], 0);
    for (int i = 0; i < THREADS; i++)
        for (int k = 0; k < 2 * steps; k++) {
            uint64_t bits;
            memcpy(&bits, &task[i].found[k], sizeof bits);
            printf("%016llx\n", (unsigned long long)bits);
        }
    return 0;
}
