/* Values between the bus and FMUs, by one call of one function for each transfer. */

#ifndef TRANSFERS_H
#define TRANSFERS_H

#include "arithmetic.h"
#include "faults.h"
#include "fmi.h"

#include <math.h>

/* Inputs from the bus, and outputs to it, whatever their type. */
int set_values(const System *system, Control *control, int number, double t);
int get_values(const System *system, Control *control, int number, double t);

/* Only call: set what has been set before, whatever is on the bus now; or have the memory filled, but not the bus. */
int call_again(const System *system, Control *control, int number, double t);

/* The same, to be refused without harm: the status. */
int ask_leniently(const System *system, int number);

/* Bring the values in a transfer's memory to the bus. */
void keep_values(const Transfer *transfer);

/* The value that an element is set to. */
static inline double scaled(const Element *element) { return element->gain * *element->bus + element->shift; }

static inline int call2(const Transfer *transfer) {
    Fmi2Transfer *const function = (Fmi2Transfer *)transfer->function;
    const int status = function(transfer->handle, transfer->references, transfer->reference_count, transfer->values);
    keep_arithmetic();
    return status;
}

/* Real inputs and outputs of FMI 1.0 and 2.0: the straight path of most transfers. */
static inline int set_reals(const System *system, Control *control, int number, double t) {
    const Transfer *const transfer = &system->transfers.at[number];
    double *const values = transfer->values;
    for (size_t i = 0; i < transfer->element_count; i++) {
        const double value = scaled(&transfer->elements[i]);
        if (!isfinite(value)) return fail(control, FAULT_NOT_FINITE, 0, number, (int)i, t);
        values[i] = value;
    }
    return judge(control, call2(transfer), number, -1, t);
}

static inline int get_reals(const System *system, Control *control, int number, double t) {
    const Transfer *const transfer = &system->transfers.at[number];
    if (!judge(control, call2(transfer), number, -1, t)) return 0;
    const double *const values = transfer->values;
    for (size_t i = 0; i < transfer->element_count; i++) *transfer->elements[i].bus = values[i];
    return 1;
}

#endif
