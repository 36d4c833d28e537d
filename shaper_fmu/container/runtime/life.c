/* A container's life: from its instantiation through initialization to its end. */

#include "container.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A container whose host is known, so that everything else can be said; null if there is not enough memory. It owns `resources`. */
Container *new_container(const char *name, const char *token, char *resources) {
    Container *const container = (Container *)calloc(1, sizeof *container);
    char *const copy = (char *)malloc(strlen(name ? name : "") + 1);
    if (!container || !copy) {
        free(container);
        free(copy);
        free(resources);
        return 0;
    }
    container->instance_name = strcpy(copy, name ? name : "");
    container->given_token = token;
    container->resources = resources;
    container->name = "container";
    container->phase = INSTANTIATED;
    return container;
}

static Status prepare(Container *container) {
    Status worst = OK;
    for (size_t i = 0; i < container->inners && worst <= WARNING; i++) worst = prepare_inner(container, &container->inner[i]);
    return worst;
}

/* Bring the loop's arrays, and what belongs to a run, to its beginning. */
static void begin_anew(Container *container) {
    read_fields(container, container->beginning);
    container->control = container->fresh;
    container->dirty = container->ready = container->waiting = container->discarded = container->terminated = 0;
    container->entered = container->sloping = container->steering = 0;
    container->step_status = OK;
    container->tolerance_defined = container->stop_defined = 0;
    container->phase = INSTANTIATED;
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; container->variable[i].settable == AN_INPUT && k < container->variable[i].slots; k++) {
            Slot *const slot = &container->variable[i].slot[k];
            slot->slope = 0.0;
            for (size_t n = 0; container->variable[i].on_bus && n < slot->targets; n++)
                container->system.bus.at[slot->target[n].place] = slot->start;
        }
    container->origin = container->control.start;
    for (size_t i = 0; i < container->wholes; i++) {
        Whole *const whole = &container->whole[i];
        whole->waiting = 0;
        if (whole->first) memcpy(whole->values, whole->first, 8 * whole->length);
    }
}

/* Keep what whole arrays are set to at the beginning: a reset brings back the elements that nobody sets. */
static int keep_first_values(Container *container) {
    for (size_t i = 0; i < container->wholes; i++) {
        Whole *const whole = &container->whole[i];
        if (!whole->known) continue;
        whole->first = take(container, whole->length, 8);
        if (!whole->first) return complain(container, ERROR, "%s: there is not enough memory", container->name), 0;
        memcpy(whole->first, whole->values, 8 * whole->length);
    }
    return 1;
}

/* Read the system, and make all instances; 0 if that fails, which is said, or if the host wants what is none of its kinds. */
int begin_container(Container *container, int known_kind) {
    char *const path = container->resources ? joined(container->resources, "container/system.bin") : 0;
    if (!path) {
        complain(container, ERROR, "%s: the host tells no resources, and there are none beside this library", container->name);
        return 0;
    }
    int done = read_system(container, path);
    free(path);
    if (!done) return 0;
    if (!known_kind) {
        complain(container, ERROR, "%s: this kind of simulation is not supported", container->name);
        return 0;
    }
    if (!*container->instance_name) {
        complain(container, ERROR, "%s: an instance needs a name", container->name);
        return 0;
    }
    if (!container->given_token || strcmp(container->given_token, container->token)) {
        complain(container, ERROR, "%s: the token %s is not that of its resources, %s: they do not belong to this description",
               container->name, container->given_token ? container->given_token : "(null)", container->token);
        return 0;
    }
    for (size_t i = 0; i < container->inners; i++)
        if (!instantiate_inner(container, &container->inner[i])) return 0;
    put_handles(container);
    container->control = container->fresh;
    container->beginning = (unsigned char *)take(container, fields_size(container), 1);
    if (!container->beginning) return complain(container, ERROR, "%s: there is not enough memory", container->name), 0;
    write_fields(container, container->beginning);
    if (!keep_first_values(container)) return 0;
    begin_anew(container);
    return prepare(container) <= WARNING;
}

void free_container(Container *container) {
    int lost = 0;
    enter(container);
    for (size_t i = 0; i < container->inners; i++) lost |= container->inner[i].failed;
    free_all_states(container, lost);
    for (size_t i = container->inners; i-- > 0;) {
        container->inner[i].failed |= lost; /* FMI allows no call of any instance of an FMU that has failed beyond repair */
        if (!lost) free_inner(&container->inner[i]);
    }
    leave(container, OK);
    for (size_t i = 0; i < container->takings && !lost; i++) free(container->taken[i]); /* lost FMUs still hold their callbacks */
    free(container->taken);
    free(container->resources);
    free(container->instance_name);
    free(container);
}

static const char *phase_name(Phase phase) {
    switch (phase) {
    case INSTANTIATED: return "before initialization";
    case INITIALIZING: return "during initialization";
    case STEPPING: return "between steps";
    case EVENT: return "in event mode";
    case TERMINATED: return "after termination";
    case LOST: return "after a fatal error";
    default: return "after an error";
    }
}

/* Whether the function may be called now; if not, says so. */
int allowed(Container *container, const char *function, int phases) {
    if (!container) return 0;
    if ((int)container->phase & phases) return 1;
    complain(container, ERROR, "%s: %s cannot be called %s", container->name, function, phase_name(container->phase));
    return 0;
}

/* After a call that has failed. Only a step can be refused (Discard) so that all is as it was. */
Status settle_phase(Container *container, Status status) {
    if (status <= WARNING) return status;
    if (status == FATAL)
        container->phase = LOST;
    else if (container->phase != LOST)
        container->phase = FAILED;
    return status == FATAL ? FATAL : ERROR;
}

Status set_start(Container *container, double start, int stop_defined, double stop, int tolerance_defined, double tolerance) {
    if (!isfinite(start))
        return complain(container, ERROR, "%s: the start time %g is not a finite number", container->name, start);
    if (stop_defined && !(stop >= start))
        return complain(container, ERROR, "%s: the stop time %.15g s is before the start time %.15g s", container->name, stop, start);
    container->origin = container->control.start = container->control.t = container->control.smooth_from = start;
    container->control.stop = stop_defined ? stop : start;
    container->stop_defined = stop_defined;
    container->stop = stop_defined ? stop : 0.0;
    container->tolerance_defined = tolerance_defined && tolerance > 0.0;
    container->tolerance = tolerance;
    return OK;
}

/* Bring outputs to inputs, once more if some have changed meanwhile. */
Status initialize_again(Container *container) {
    Control *const control = &container->control;
    if (!loop_initialize(&container->system, control, control->t)) return tell_fault(container);
    container->dirty = 0;
    if (!container->cuts.count) return OK;
    System in_loops = container->system;
    in_loops.cut_places = container->cuts;
    in_loops.loop_memory = container->cut_memory;
    container->cut_memory.at[container->cut_memory.count - 1] = 0.0; /* no Jacobian is known */
    if (loop_close_loops(&in_loops, control, control->t)) return OK;
    container->dirty = 1;
    return tell_fault(container);
}

Status enter_initialization(Container *container) {
    container->phase = INITIALIZING;
    container->control.steps = container->control.done = 0;
    container->control.stop = container->stop_defined ? container->stop : container->origin;
    for (size_t i = 0; i < container->inners; i++) {
        const Status status = set_up_inner(container, &container->inner[i]);
        if (status > WARNING) return settle_phase(container, status);
    }
    return settle_phase(container, initialize_again(container));
}

/* Leave initialization mode. No instance gets its inputs for the first step here, since the host may still give others. */
static Status exit_all(Container *container) {
    Control *const control = &container->control;
    const System *const system = &container->system;
    int in_event_mode = 0;
    if (container->dirty && initialize_again(container) > WARNING) return ERROR;
    if (system->clocks.count && !loop_start_clocks(system, control)) return tell_fault(container);
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        in_event_mode |= inner->event_mode;
        const Status status =
            call_inner(container, inner, inner->version == 2 ? "fmi2ExitInitializationMode" : "fmi3ExitInitializationMode");
        if (status > WARNING) return status;
    }
    const int exchange = control->exchange;
    control->exchange = 0;
    const int begun = loop_begin(system, control, control->t, in_event_mode);
    control->exchange = exchange;
    return begun ? OK : tell_fault(container);
}

Status exit_initialization(Container *container) {
    const Status status = exit_all(container);
    if (status > WARNING) return settle_phase(container, status);
    container->phase = container->event_mode ? EVENT : STEPPING;
    return OK;
}

Status terminate(Container *container) {
    Status worst = OK;
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        const Status status = call_inner(container, inner, inner->version == 2 ? "fmi2Terminate" : "fmi3Terminate");
        if (status > worst) worst = status;
    }
    if (worst > WARNING) return settle_phase(container, worst);
    container->phase = TERMINATED;
    return worst;
}

Status reset(Container *container) {
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        const Status status = call_inner(container, inner, inner->version == 2 ? "fmi2Reset" : "fmi3Reset");
        if (status > WARNING) return settle_phase(container, status);
    }
    begin_anew(container);
    return settle_phase(container, prepare(container));
}
