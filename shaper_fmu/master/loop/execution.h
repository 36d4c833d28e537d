/* Programs: transfers, steps and tables over one step. */

#ifndef EXECUTION_H
#define EXECUTION_H

#include "loop.h"

#include <math.h>

/* How close to the end of the step [t, t + h] an event counts as reached [s]: component.py's function of this name. */
static inline double time_rounding(double t, double h) { return 1e-9 * h + 64.0 * 2.220446049250313e-16 * fabs(t); }

/* A step that an instance has ended early; see Control.at_event. */
#define SHORTENED 2

/* Run a program over [t, t + h]. Where the first instance that steps returns early, the others step to there, too. */
int execute(const System *system, Control *control, Operations program, double t, double h);

#endif
