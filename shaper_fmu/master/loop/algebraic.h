/* Loops without delay between parts that are solved as one: Newton's method for the values of the cut inputs' sources. */

#ifndef ALGEBRAIC_H
#define ALGEBRAIC_H

#include "loop.h"

/* Exchange values by a program at t; with loops, until what is exchanged comes back as it went in. Returns what evaluations do
   (see parts.h). */
int exchange_in_loops(const System *system, Control *control, Operations program, double t);

#endif
