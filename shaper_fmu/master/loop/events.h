/* Events: event mode of FMI 3.0, and values exchanged until nothing changes any more. */

#ifndef EVENTS_H
#define EVENTS_H

#include "loop.h"

/* Exchange values at t until nothing changes any more; instances with event mode go through it, and into it if `entering`. */
int handle_event(const System *system, Control *control, double t, int entering);

/* An event of the parts that the solver solves, within a step: nobody else takes part in it. */
int handle_event_of_parts(const System *system, Control *control, double t);

/* Handle an event at the end of a step. */
int end_in_event(const System *system, Control *control, double t);

/* Whether the source of an input has changed that is set in event mode alone. */
static inline int has_changed(const System *system) {
    for (size_t i = 0; i < system->watched.count; i++) {
        const WatchedInput *const input = &system->watched.at[i];
        if (system->bus.at[input->place] != input->value) return 1;
    }
    return 0;
}

#endif
