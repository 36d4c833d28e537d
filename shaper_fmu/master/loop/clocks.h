/* Clocks of FMI 3.0: when they tick, and what is exchanged while they do (FMI 3.0, section 2.2.8). */

#ifndef CLOCKS_H
#define CLOCKS_H

#include "loop.h"

#define FAILED (-1)

/* Have clocks tick in this super-dense instant, the timed ones if all else has settled. */
int tick(const System *system, Control *control, double t, int settled);

/* After discrete states were updated: ask for intervals, and tell the instances' next events; 1 if a tick is due at t, 0 if none
   is, or FAILED. */
int end_ticks(const System *system, Control *control, double t);

#endif
