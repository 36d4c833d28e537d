/* Numbers of all types. */

#ifndef NUMBERS_H
#define NUMBERS_H

#include "container.h"

/* A number of any type: exact, whatever its size. `sign`: whether it is in `whole`, or, without a sign, in `natural`. */
typedef struct {
    enum { A_REAL, A_WHOLE, A_NATURAL } kind;
    double real;
    int64_t whole;
    uint64_t natural;
} Number;

int is_boolean(int type);

/* How many bytes a value has in the host's arrays, and in those of the FMUs inside. */
size_t value_size(int type);
Number number_at(int type, const unsigned char *at);
double as_real(Number);

/* Write a number in a type; 0 if it does not fit. */
int put_number(int type, unsigned char *at, Number);

/* What a number becomes on the way between outside and inside. */
Number converted(const Target *, Number);

#endif
