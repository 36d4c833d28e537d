"""Events in the compiled loop: event mode of FMI 3.0, and values exchanged until nothing changes any more."""

from __future__ import annotations

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import fmi3_update, read_f8, read_u1, simple_call
from shaper_fmu.master.clock_loop import end_ticks, tick
from shaper_fmu.master.execution import execute, opened
from shaper_fmu.master.transfers import compiled, fail, inlined, judge

_MOST_UPDATES = 100


@compiled
def _update(instances, control, number, t):
    """Update an instance's discrete states; 1 if it needs another one, 0 if not, -1 if it failed."""
    instance = instances[number]
    a = instance.answers
    flags = a + np.uintp(8), a + np.uintp(9), a + np.uintp(10), a + np.uintp(11), a + np.uintp(12)
    arguments = (instance.handle, flags[0], flags[1], flags[2], flags[3], flags[4], a)
    if not judge(control, fmi3_update(instance.update, arguments), -1 - number, t, 3):
        return -1
    if read_u1(flags[1]):
        fail(control, of.TERMINATED, 0, -1 - number, 3, t)
        return -1
    instance.next_event = read_f8(a) if read_u1(flags[4]) else of.NO_EVENT
    return 1 if read_u1(flags[0]) else 0


@compiled
def _all_in_mode(instances, control, entering, t):
    for i in range(instances.size):
        instance = instances[i]
        if instance.event_mode:
            address = instance.enter_event_mode if entering else instance.enter_step_mode
            if not judge(control, simple_call(address, (instance.handle,)), -1 - i, t, 1 if entering else 2):
                return False
    return True


@inlined
def has_changed(system):
    """Whether the source of an input has changed that is set in event mode alone."""
    for i in range(system.watched.size):
        if system.bus[system.watched[i].place] != system.watched[i].value:
            return True
    return False


@inlined
def _resume(system, control, t):
    """Note what inputs have got in event mode, and set those that a step begins with."""
    for i in range(system.watched.size):
        if control.all_open:  # else a guard may have kept some from being set
            system.watched[i].value = system.bus[system.watched[i].place]
    return control.done >= control.steps or execute(system, control, system.resume_program, t, 0.0)


@compiled
def handle_event(address, control, t, entering):
    """Exchange values at t until nothing changes any more; instances with event mode go through it.

    A function of its own, not inlined: events are rare, and the loop's code has to fit into the processor's cache.
    """
    system = opened(address)
    control.smooth_from, control.resuming = t, 1 if entering else 0
    if entering and not _all_in_mode(system.instances, control, True, t):
        return False
    asking, rereading = 0, control.rereading != 0
    for i in range(system.instances.size):
        rereading = rereading or system.instances[i].event_mode != 0
    settled = False
    for _ in range(_MOST_UPDATES):
        if not execute(system, control, system.event_program, t, 0.0):
            return False
        if system.clocks.size and not tick(address, control, t, settled):
            return False
        again = 0
        for i in range(system.instances.size):
            if system.instances[i].event_mode:
                answer = _update(system.instances, control, i, t)
                if answer < 0:
                    return False
                if answer > 0:
                    again, asking = 1, i
        if system.clocks.size:
            due = end_ticks(address, control, t)
            if due < 0:
                return False
            settled = due > 0 and again == 0
            again = max(again, due)
        if not rereading:  # all that follows the inputs has been read
            return True
        if not execute(system, control, system.event_read_program, t, 0.0):
            return False
        if not execute(system, control, system.event_program, t, 0.0):
            return False
        if again == 0:
            return _all_in_mode(system.instances, control, False, t) and _resume(system, control, t)
    return fail(control, of.ENDLESS_EVENTS, 0, -1 - asking, 3, t)


@compiled
def end_in_event(address, control, t):
    """Handle an event at the end of a step. Inputs that Python functions give have kept their value from its beginning so far."""
    system = opened(address)
    for i in range(control.function_place, control.function_place + control.functions):
        system.bus[i] = system.bus[i + control.functions]
    return handle_event(address, control, t, True)
