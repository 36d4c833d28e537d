/* The stepping loop: what a master calls.

   A system is data (see layout.h, which loop_header.py writes from the declarations in layout*.py): instances of FMUs with the
   addresses of their functions, transfers of values, and programs that say in which order values move and instances step. A
   Control is the state of a run. Nothing is kept anywhere else, so that systems can be stepped side by side in threads.

   A macro step goes from t to the next point of the grid, or to the earliest event before it. At an event the values from the
   left are recorded, all instances with event mode enter it, values are exchanged in the order of direct feedthrough until no
   discrete state changes any more, and the values from the right are recorded.

   Functions that return a truth value return 0 if something failed, and tell in the control what and where. */

#ifndef LOOP_H
#define LOOP_H

#include "layout.h"

#if defined(LOOP_API)
/* nothing of it is seen outside of the library that it is part of */
#elif defined(_WIN32)
#define LOOP_API __declspec(dllexport)
#elif defined(__GNUC__)
#define LOOP_API __attribute__((visibility("default")))
#else
#define LOOP_API
#endif

/* In initialization mode: set the inputs of FMI 1.0's instances, which have no such mode, before they are initialized. */
LOOP_API int loop_begin_early(const System *system, Control *control, double t);

/* In initialization mode: read all outputs and spread them over the connections. */
LOOP_API int loop_initialize(const System *system, Control *control, double t);

/* In initialization mode: spread the bus over the connections, and read what follows without delay. */
LOOP_API int loop_exchange(const System *system, Control *control, double t);

/* In initialization mode: find values at the cut places that come back from the exchange as they went in. */
LOOP_API int loop_close_loops(const System *system, Control *control, double t);

/* At the end of initialization mode: find out the first ticks of clocks. */
LOOP_API int loop_start_clocks(const System *system, Control *control);

/* After initialization mode: read all outputs, set the inputs of the first step, and leave event mode if an instance is in it. */
LOOP_API int loop_begin(const System *system, Control *control, double t, int in_event_mode);

/* Record the row of the start. */
LOOP_API void loop_first_row(const System *system, Control *control);

/* Take up to `most` macro steps; returns an ANSWER. */
LOOP_API int loop_run(const System *system, Control *control, int64_t most);

/* Only plan a step, and take it: where inputs are given by somebody else's functions, they are asked in between. */
LOOP_API void loop_plan_step(const System *system, Control *control);
LOOP_API int loop_take_planned_step(const System *system, Control *control);

/* A run goes on after its end, to another one: give the instances the inputs of the next step, since values from outside have
   changed, or not all inputs have been set since the end. */
LOOP_API int loop_go_on(const System *system, Control *control);

/* Handle an event that waits: after Control.paused, or where values from outside have changed. With `entered` the instances are
   in event mode already. */
LOOP_API int loop_handle_event(const System *system, Control *control, int entered);

/* Have all instances with event mode enter it. */
LOOP_API int loop_enter_event_mode(const System *system, Control *control);

/* Bring other values from outside, at the end of a run, to what follows them at once. */
LOOP_API int loop_look_through(const System *system, Control *control);

/* The earliest event that is known [s]; NO_EVENT for none. */
LOOP_API double loop_next_event(const System *system, Control *control);

/* Bring all instances from wherever they are to the start of a run. */
LOOP_API int loop_start_again(const System *system, Control *control, int in_event_mode);

/* Whole runs, one after the other; `controls` are the control in use, and a fresh one. */
LOOP_API void loop_whole_runs(const System *system, Control *controls, int in_event_mode, Runs *runs);

/* How this thread's processor calculates (see arithmetic.h): the mode, that of C's beginning, and another one. */
LOOP_API uint64_t loop_arithmetic_mode(void);
LOOP_API uint64_t loop_standard_arithmetic(void);
LOOP_API void loop_set_arithmetic_mode(uint64_t mode);

#endif
