/* What the solver asks of the FMUs: times, states, derivatives, event indicators; see solver.h. */

#ifndef PARTS_H
#define PARTS_H

#include "loop.h"

/* How an evaluation has ended; REFUSED: another state may do. */
enum { EVALUATED, REFUSED, BROKEN = -1 };

/* Keep why an evaluation is refused: it is a fault if no other state does. */
int refuse(Control *control, int fault, int status, int where, int element);

/* Bring all parts to this time and state, and their inputs to the outputs that they are connected to. */
int place_parts(const System *system, Control *control, double t, const double *state);

/* Have parts of FMI 1.0 take inputs after an event or a completed step, or after their initialization if they do not know all
   of them. */
int open_after_event(const System *system, Control *control, double t, int initializing);

/* Keep the values that a part's linear inputs have at t, where a step begins. */
int note_inputs(const System *system, Control *control, int number, double t);

/* The parts' derivatives and event indicators, where they have been placed. */
int get_derivatives(const System *system, Control *control, double t, double *rates);
int get_indicators(const System *system, Control *control, double t, double *indicators);

/* d rates / d state by the FMUs' directional derivatives; columns[i] is where the column of state i begins. */
int get_jacobian(const System *system, Control *control, double t, double **columns);

/* Their states and nominal values. */
int get_states(const System *system, Control *control, double t, double *state, double *nominals);

/* Tell the parts that want to hear of it that a step is completed; *event: whether one asks for an event. */
int complete_step(const System *system, Control *control, double t, int *event);

/* The same for an instance that has not been told: those of FMI 1.0 take no event else. */
int complete_before_event(const System *system, Control *control, int instance, double t);

/* Whether inputs from outside have other values than when this was asked last. */
int inputs_have_changed(const System *system, Control *control, double t, int *changed);

#endif
