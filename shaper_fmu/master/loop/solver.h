/* Model exchange: the differential equations of FMUs without solvers of their own, solved together by SUNDIALS' CVODE.

   All such FMUs of a system are the parts of one system of equations, so that all of them come to the same time. Where they are
   coupled as one, values pass between them in every evaluation (`coupled_program`). A step ends early at an event, or the event
   is handled within it where the step cannot be shortened for all. */

#ifndef SOLVER_H
#define SOLVER_H

#include "loop.h"

#include <stddef.h>

/* Solve the equations over [t, t + h]; `may_end` tells whether the step may be ended early, for all. */
int solve(const System *system, Control *control, double t, double h, int may_end);

/* An event has been handled: states and derivatives may have jumped. */
void restart_solver(const System *system);

/* What could not be done; where an evaluation was refused, that is the reason. */
int broken(Control *control, const Solver *solver, int flag, double t);

static inline Solver *solver_of(const System *system) { return system->solvers.count ? &system->solvers.at[0] : NULL; }

static inline size_t size_of_state(const Solver *solver) { return sizeof(double) * (size_t)(solver->states > 0 ? solver->states : 1); }

/* A run begins. */
void reset_solver(const System *system);

/* What CVODE calls. */
LOOP_API int loop_derivatives(double t, void *state, void *rates, void *solver);
LOOP_API int loop_indicators(double t, void *state, double *indicators, void *solver);
LOOP_API int loop_jacobian(double t, void *state, void *rates, void *matrix, void *solver, void *, void *, void *);

#endif
