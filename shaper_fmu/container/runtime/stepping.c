/* A container's steps: the loop goes from the host's communication point to the next one, and ends its own steps at all events. */

#include "container.h"

#include <math.h>

#define MOST_STEPS 1e15

/* How close two times are the same [s]: the loop's function of this name. */
static double time_rounding(double t, double h) { return 1e-9 * h + 64.0 * 2.220446049250313e-16 * fabs(t); }

/* Have the loop go from t to t + h: by one step, or by steps to the points of a grid that begins at the experiment's start. The
   host's steps need not fit to the grid. */
static void aim(Container *container, double t, double h) {
    Control *const control = &container->control;
    const double step = container->longest > 0.0 ? container->longest : h;
    control->start = container->longest > 0.0 ? container->origin : t;
    control->step = step;
    control->stop = t + h;
    control->done = (int64_t)floor((t - control->start) / step + 1e-9);
    control->steps = (int64_t)ceil((control->stop - control->start) / step - 1e-9);
    if (control->steps <= control->done) control->steps = control->done + 1;
    const double end = control->start + (double)control->steps * step;
    control->ends_whole = fabs(end - control->stop) <= time_rounding(control->stop, step);
    if (control->ends_whole && container->longest > 0.0) control->stop = end;
}

/* The point of the inner grid where the host means it: hosts add up their steps, or count nanoseconds, and a nonlinear plant inside
   makes more of the last bits. Without a grid the host's own numbers count. */
static double on_grid(const Container *container, double t) {
    if (!(container->longest > 0.0)) return t;
    const double near = container->origin + rint((t - container->origin) / container->longest) * container->longest;
    return fabs(near - t) <= time_rounding(t, container->longest) ? near : t;
}

/* Whether an FMU inside takes steps of one length alone. */
static int is_rigid(const Container *container) {
    for (size_t i = 0; i < container->system.instances.count; i++)
        if (container->system.instances.at[i].rigid) return 1;
    return 0;
}

static Status check_step(Container *container, double t, double h) {
    Control *const control = &container->control;
    if (container->discarded)
        return complain(container, ERROR, "%s: an FMU inside has refused a step, and has to be set back to a saved state", container->name);
    if (container->terminated)
        return complain(container, ERROR, "%s: an FMU inside has asked to end the simulation", container->name);
    if (!isfinite(t) || !isfinite(t + h) || !(h > 0.0))
        return complain(container, ERROR, "%s: cannot step from %.15g s by %.15g s", container->name, t, h);
    if (fabs(t - control->t) > time_rounding(t, h))
        return complain(container, ERROR, "%s: cannot step from %.15g s: the last step ended at %.15g s", container->name, t, control->t);
    if (!(t + h > t))
        return complain(container, ERROR, "%s: a step of %g s is too short for times of %g s", container->name, h, t);
    if (container->longest > 0.0 && (t + h - container->origin) / container->longest > MOST_STEPS)
        return complain(container, ERROR, "%s: a step of %g s has too many inner steps, of %g s", container->name, h, container->longest);
    const double begin = on_grid(container, t), steps = h / container->longest;
    if (container->longest > 0.0 && is_rigid(container) && !(fabs(rint(steps) - steps) <= 1e-6 && rint(steps) >= 1.0))
        return complain(container, ERROR, "%s: a step of %.15g s is no multiple of the steps inside, of %.15g s, and an FMU inside takes "
                        "no steps of other lengths", container->name, h, container->longest);
    if (control->smooth_from == control->t) control->smooth_from = begin;
    control->t = begin;
    return OK;
}

/* What the loop could not do, or what a call on the way has said. Only the request to end the simulation is no error. */
static Status stopped(Container *container) {
    const int fault = container->control.fault, status = container->control.fault_status;
    const Status found = fault ? tell_fault(container) : ERROR;
    container->ready = 0;
    if (found == ERROR) container->hurt = 1;
    if (fault == FAULT_TERMINATED) {
        container->terminated = 1;
        return DISCARD;
    }
    if (fault == FAULT_CALL_FAILED && status == DISCARD) container->discarded = 1;
    return found;
}

/* Begin a step: what waits is handled, and the instances get their inputs. */
static int begin_step(Container *container, double t, double h) {
    const System *const system = &container->system;
    Control *const control = &container->control;
    if (control->paused && !loop_handle_event(system, control, 0)) return 0; /* the host has not done it */
    if (container->waiting) {
        if (!loop_enter_event_mode(system, control) || set_waiting(container) > WARNING || !loop_handle_event(system, control, 1))
            return 0;
        container->ready = 0;
    }
    const int anew = container->dirty || !container->ready;
    container->dirty = 0;
    aim(container, t, h);
    return !anew || loop_go_on(system, control);
}

Status advance(Container *container, double t, double h, int no_going_back) {
    Control *const control = &container->control;
    control->fault = FAULT_NO_FAULT;
    const Status checked = check_step(container, t, h);
    if (checked) return checked;
    control->warnings = 0;
    control->room = INT64_MAX;
    control->rows = 0;
    control->unrecorded = 1;
    control->returning = !no_going_back;
    control->pausing = container->event_mode ? (container->early_return ? 2 : 1) : 0;
    if (!begin_step(container, t, h)) return stopped(container);
    container->ready = 0; /* the end of the run sets what passes through alone */
    for (int answer = ANSWER_GOING_ON; answer == ANSWER_GOING_ON;) {
        answer = container->steering ? run_with_slopes(container) : loop_run(&container->system, control, INT64_MAX);
        if (answer == ANSWER_FAULT) return stopped(container);
    }
    return control->warnings ? WARNING : OK;
}

/* Handle the event at which the host is: what has happened inside, and new values from outside. */
Status update_events(Container *container, double *next) {
    const System *const system = &container->system;
    Control *const control = &container->control;
    control->fault = FAULT_NO_FAULT;
    if (container->waiting) {
        if (!loop_enter_event_mode(system, control)) return tell_fault(container);
        if (set_waiting(container) > WARNING) return ERROR;
        if (!loop_handle_event(system, control, 1)) return tell_fault(container);
    } else if (control->paused || container->dirty) {
        if (!loop_handle_event(system, control, 0)) return tell_fault(container);
    }
    container->dirty = 0;
    container->ready = 0;
    *next = loop_next_event(system, control);
    return OK;
}

/* Bring inputs to what follows them at once, so that outputs can be read. */
Status look_through(Container *container) {
    if (container->phase == INITIALIZING) return container->dirty ? initialize_again(container) : OK;
    if (!container->dirty || !(container->phase & (STEPPING | EVENT))) return OK;
    container->ready = 0;
    return loop_look_through(&container->system, &container->control) ? OK : tell_fault(container);
}
