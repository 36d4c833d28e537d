/* Event indicators that are 0, or that inputs jump over 0: of both CVODE sees no change of the sign.

   An event is where an indicator comes to be above 0, or comes not to be (FMI 2.0.4, section 3.1.1; FMI 3.0, section 3.1.1). At 0 it
   is not above it; a model that asks whether a value is above its limit answers no there, and yes behind it. */

#ifndef CROSSINGS_H
#define CROSSINGS_H

#include "solver.h"

enum { WATCHING_NONE, WATCHING_FIRST, WATCHING_ON }; /* the first step, later ones */

/* Find out which indicators are 0 at the beginning, as after a bounce, and what they become; *leaving: whether one leaves 0 at once,
   to where `between_values` are then. */
int watch(const System *system, Control *control, Solver *solver, double t, double near, int *leaving);

/* Whether an indicator that was 0 at the beginning has come and gone unseen within the first step, or has left 0 in any. */
int has_been_missed(Solver *solver, int *missed);

/* After a step: go on to watch those that are 0 still. */
void go_on_watching(Solver *solver);

/* Where an indicator is 0 at an event, go on until it is no more, within the rounding of times. */
int pass_zeros(const System *system, Control *control, Solver *solver, double near);

/* Keep the event indicators at t, before inputs change: where these jump one over 0, that is an event. */
int note_indicators(const System *system, Control *control, double t);

/* Whether the inputs have jumped one to its other side since then. */
int have_inputs_crossed(const System *system, Control *control, double t, int *crossed);

#endif
