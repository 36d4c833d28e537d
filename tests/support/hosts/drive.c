/* Runs a script of calls, so that libraries of different platforms can be compared: drive SCRIPT

   A line is a call, of the library opened last. Values are bits of doubles in hexadecimal, which no text conversion changes.
     open PATH FMI TOKEN
     title WORD       print it
     begin            instantiate and enter initialization
     real VR N BITS.. set a real variable of N elements
     whole VR KIND VALUE   set an integer (i), enumeration (e) or boolean (b)
     end              leave initialization
     step T H         bits of both
     get VR N         print the bits of a real variable
     exchange N       print the derivatives of a new model exchange instance with N states, all 0.2
     free */

#include "library.h"

static void *library;
static int fmi;
static char token[256];

static double read_bits(void) {
    unsigned long long bits = 0;
    double value;
    if (scanf("%llx", &bits) != 1) exit(4);
    memcpy(&value, &bits, sizeof value);
    return value;
}

static void print_bits(const double *values, size_t n) {
    for (size_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        printf("%016llx\n", (unsigned long long)bits);
    }
}

static void set_whole(void *fmu, unsigned vr, char kind, int value) {
    fmi3Boolean truth = value != 0;
    int64_t number = value;
    if (fmi == 2)
        MUST(kind == 'b' ? GET(fmi2SetBoolean)(fmu, &vr, 1, &value) : GET(fmi2SetInteger)(fmu, &vr, 1, &value));
    else if (kind == 'b')
        MUST(GET(fmi3SetBoolean)(fmu, &vr, 1, &truth, 1));
    else
        MUST(kind == 'i' ? GET(fmi3SetInt32)(fmu, &vr, 1, &value, 1) : GET(fmi3SetInt64)(fmu, &vr, 1, &number, 1));
}

static void derivatives(int n) {
    double x[64], dx[64];
    for (int i = 0; i < 64; i++) x[i] = 0.2;
    void *fmu = fmi == 2 ? GET(fmi2Instantiate)("me", fmi2ModelExchange, token, "", &CALLBACKS2, 0, 0)
                         : GET(fmi3InstantiateModelExchange)("me", token, "", 0, 0, 0, log3_message);
    if (!fmu) exit(3);
    begin(library, fmi, fmu), end_begin(library, fmi, fmu);
    if (fmi == 2) {
        fmi2EventInfo info;
        MUST(GET(fmi2NewDiscreteStates)(fmu, &info));
        MUST(GET(fmi2EnterContinuousTimeMode)(fmu));
        MUST(GET(fmi2SetTime)(fmu, 0.25));
        MUST(GET(fmi2SetContinuousStates)(fmu, x, (size_t)n));
        MUST(GET(fmi2GetDerivatives)(fmu, dx, (size_t)n));
        GET(fmi2FreeInstance)(fmu);
    } else {
        fmi3Boolean b[5];
        double next;
        MUST(GET(fmi3UpdateDiscreteStates)(fmu, b, b + 1, b + 2, b + 3, b + 4, &next));
        MUST(GET(fmi3EnterContinuousTimeMode)(fmu));
        MUST(GET(fmi3SetTime)(fmu, 0.25));
        MUST(GET(fmi3SetContinuousStates)(fmu, x, (size_t)n));
        MUST(GET(fmi3GetContinuousStateDerivatives)(fmu, dx, (size_t)n));
        GET(fmi3FreeInstance)(fmu);
    }
    print_bits(dx, (size_t)n);
}

int main(int count, char **argument) {
    char word[16], path[2048], kind;
    void *fmu = 0;
    unsigned vr;
    int n;
    double values[64];
    if (count != 2 || !freopen(argument[1], "r", stdin)) return 1;
    while (scanf("%15s", word) == 1) {
        if (!strcmp(word, "open") && scanf("%2047s %d %255s", path, &fmi, token) == 3)
            library = open_library(path);
        else if (!strcmp(word, "title") && scanf("%2047s", path) == 1)
            puts(path);
        else if (!strcmp(word, "begin"))
            fmu = new_fmu(library, fmi, token), begin(library, fmi, fmu);
        else if (!strcmp(word, "real") && scanf("%u %d", &vr, &n) == 2 && n <= 64) {
            for (int i = 0; i < n; i++) values[i] = read_bits();
            reals(library, fmi, fmu, 1, vr, (size_t)n, values);
        } else if (!strcmp(word, "whole") && scanf("%u %c %d", &vr, &kind, &n) == 3)
            set_whole(fmu, vr, kind, n);
        else if (!strcmp(word, "end"))
            end_begin(library, fmi, fmu);
        else if (!strcmp(word, "step")) {
            double t = read_bits(), h = read_bits();
            MUST(step_fmu(library, fmi, fmu, t, h));
        } else if (!strcmp(word, "get") && scanf("%u %d", &vr, &n) == 2 && n <= 64) {
            reals(library, fmi, fmu, 0, vr, (size_t)n, values);
            print_bits(values, (size_t)n);
        } else if (!strcmp(word, "exchange") && scanf("%d", &n) == 1 && n <= 64)
            derivatives(n);
        else if (!strcmp(word, "free"))
            fmi == 2 ? GET(fmi2FreeInstance)(fmu) : GET(fmi3FreeInstance)(fmu);
        else
            return fprintf(stderr, "what is %s?\n", word), 4;
    }
    return 0;
}
