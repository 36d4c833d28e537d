/* Inputs that are linear over a step: FMI 2.0's derivatives of inputs. FMUs inside that take derivatives get them; all others get
   the values at the beginning of each inner step. */

#include "container.h"

#include "fmi.h"

#include <math.h>

Status set_slopes(Container *container, const uint32_t *references, size_t count, const fmi2Integer *orders, const double *values) {
    if (count && (!references || !orders || !values)) return complain(container, ERROR, "%s: a pointer is null", container->name);
    for (size_t i = 0; i < count; i++) {
        const Variable *const variable = references[i] < container->variables ? &container->variable[references[i]] : 0;
        if (!variable || variable->settable != AN_INPUT || variable->type != TYPE_F8)
            return complain(container, ERROR, "%s: the variable with the value reference %lu is no real input", container->name,
                          (unsigned long)references[i]);
        if (orders[i] != 1 || !isfinite(values[i]))
            return complain(container, ERROR, "%s: the derivative of %s of order %d and value %g is not taken, only a first one that is finite",
                          container->name, variable->name, (int)orders[i], values[i]);
    }
    for (size_t i = 0; i < count; i++) container->variable[references[i]].slot[0].slope = values[i];
    container->sloping = 0;
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; k < container->variable[i].slots; k++) container->sloping |= container->variable[i].slot[k].slope != 0.0;
    container->steering = container->steering || container->sloping;
    return OK;
}

/* Tell the FMUs inside the slopes of their inputs. */
static int steer(Container *container) {
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; k < container->variable[i].slots; k++) {
            const Slot *const slot = &container->variable[i].slot[k];
            for (size_t n = 0; n < slot->steered; n++) {
                const Steered *const steered = &slot->steer[n];
                Inner *const inner = &container->inner[steered->inner];
                const char *const name = "fmi2SetRealInputDerivatives";
                Fmi2SetRealInputDerivatives *const function = (Fmi2SetRealInputDerivatives *)function_of(inner, name);
                const double slope = steered->gain * slot->slope;
                const int32_t order = 1;
                if (!function) return lacks(container, inner, name), 0;
                if (judge_call(container, inner, name, function(inner->handle, &steered->reference, 1, &order, &slope)) > WARNING) return 0;
            }
        }
    return 1;
}

/* Bring the inputs from where they are by their slopes over h. */
static void move_inputs(Container *container, double h) {
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; container->variable[i].on_bus && k < container->variable[i].slots; k++) {
            const Slot *const slot = &container->variable[i].slot[k];
            for (size_t n = 0; slot->slope != 0.0 && n < slot->targets; n++)
                container->system.bus.at[slot->target[n].place] += slot->slope * h;
        }
}

/* A run whose inputs move; answers as loop_run does. Where inputs are set after a step, they have their values at its end before. */
int run_with_slopes(Container *container) {
    const System *const system = &container->system;
    Control *const control = &container->control;
    while (control->done < control->steps) {
        const double t = control->t;
        if (!steer(container)) return ANSWER_FAULT;
        loop_plan_step(system, control);
        const double h = control->target - t;
        if (control->exchange) move_inputs(container, h);
        if (!loop_take_planned_step(system, control)) return ANSWER_FAULT;
        const double cut = t + h - control->t; /* an FMU may have ended the step before */
        if (control->exchange && cut > 0.0) move_inputs(container, -cut);
        if (!control->exchange) move_inputs(container, control->t - t);
    }
    container->dirty = 1;
    if (!container->sloping) container->steering = 0; /* the FMUs know that the slopes are 0 */
    return ANSWER_FINISHED;
}
