"""The stepping loop, compiled. It calls FMUs by address; the system that it steps is data (see layout.py).

A macro step goes from t to the next point of the grid, or to the earliest event before it. At an event the values from
the left are recorded, all instances with event mode enter it, values are exchanged in the order of direct feedthrough
until no discrete state changes any more, and the values from the right are recorded.
"""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import write_f8
from shaper_fmu.master.event_loop import end_in_event, handle_event, has_changed
from shaper_fmu.master.execution import execute, opened, rounding
from shaper_fmu.master.transfers import compiled, inlined
from shaper_fmu.metrics import metric

GOING_ON, FINISHED, FULL, FAULT = range(4)


@inlined
def plan(system, control):
    """Where the next step ends: at the next point of the grid, or at the earliest event before it."""
    last = control.done + 1 >= control.steps
    grid = control.stop if last else control.start + (control.done + 1) * control.step
    t = control.t
    target = grid
    if control.exact:
        near = rounding(t, grid - t)
        for i in range(system.event_places.size):
            due = system.bus[system.event_places[i]]
            if t + near < due < target - near:
                target = due
        for i in range(system.instances.size):
            due = system.instances[i].next_event
            if t + near < due < target - near:
                target = due
        while control.jump < system.jumps.size and system.jumps[control.jump] <= t + near:
            control.jump += 1
        if control.jump < system.jumps.size and system.jumps[control.jump] < target - near:
            target = system.jumps[control.jump]
    control.target = target
    control.at_grid = 1 if target == grid else 0
    control.at_event = 0


@inlined
def _is_event(system, control, near):
    """Whether an announced event is at the target."""
    for i in range(system.event_places.size):
        if abs(system.bus[system.event_places[i]] - control.target) <= near:
            return True
    for i in range(system.instances.size):
        if abs(system.instances[i].next_event - control.target) <= near:
            return True
    return control.jump < system.jumps.size and abs(system.jumps[control.jump] - control.target) <= near


@compiled
def _find_due(guards, causes, bus, instances, control, jump, near):
    """Find out which guards' causes have an event at the target, before the step overwrites what was announced."""
    for i in range(guards.size):
        guards[i].due = 0
        for k in range(guards[i].first, guards[i].first + guards[i].count):
            cause = causes[k]
            when = jump if cause == of.JUMPS else bus[cause] if cause >= 0 else instances[-1 - cause].next_event
            if abs(when - control.target) <= near:
                guards[i].due = 1


@compiled
def _set_guards(guards, control, off_grid):
    """What the guards let through from now on; everything at a point of the grid, and after an event that nobody announced."""
    control.all_open = 0 if off_grid and not control.at_event else 1
    for i in range(guards.size):
        guards[i].open = guards[i].due


@compiled
def _measure(metrics, bus, t):
    """Take the values at t into the metrics; see metrics/metric.py for what they are."""
    for i in range(metrics.size):
        m = metrics[i]
        x = bus[m.place]
        anew = math.isnan(m.time)
        unmoved = m.command < 0 or bus[m.command] == m.commanded
        if m.kind == metric.EXTREMES and m.smallest <= x <= m.largest and unmoved and not anew:  # most steps of most metrics
            m.last = x
            m.time = t
            continue
        if m.command >= 0:
            command = bus[m.command]
            anew = anew or command != m.commanded
            m.commanded = command
        if anew:
            m.begin = t
            m.first = x
            m.sum = t if m.kind == metric.OUTSIDE else 0.0
            m.largest = 0.0 if m.kind == metric.ENVELOPE else x
            m.smallest = x
        elif m.kind == metric.SQUARE:
            m.sum += m.last * m.last * (t - m.time)
        if m.kind == metric.ENVELOPE:
            m.largest = max(m.largest, math.hypot(x - m.rest, bus[m.rate] / m.parameter))
        else:
            m.largest = max(m.largest, x)
        m.smallest = min(m.smallest, x)
        if m.kind == metric.OUTSIDE and abs(x - m.rest) > m.parameter:
            m.sum = t
        if math.isnan(x):  # which comparisons pass over
            m.largest = m.smallest = m.sum = x
        m.last = x
        m.time = t


@inlined
def note(system, control, left):
    """Record a row; on the grid alone unless events are wanted, too."""
    if control.silent:
        return
    if system.metrics.size:
        _measure(system.metrics, system.bus, control.t)
    if control.unrecorded or (not control.everywhere and (left or not control.at_grid)):
        return
    write_f8(control.next_time, control.t)
    control.next_time += np.uintp(8)
    at = control.next_row
    for i in range(np.uintp(system.recorded.size)):
        write_f8(at, system.bus[np.uintp(system.recorded[i])])
        at += np.uintp(8)
    control.next_row = at
    control.rows += 1


@inlined
def _exchange(system, address, control, t):
    """Exchange values after a step that ends at no event; a change of an input that is set in event mode alone is one."""
    if control.exchange:
        final = control.done >= control.steps
        if not execute(system, control, system.final_program if final else system.exchange_program, t, 0.0):
            return False
    if system.watched.size == 0 or not has_changed(system):
        return True
    control.events += 1
    note(system, control, True)
    return end_in_event(address, control, t)


@inlined
def take_step(system, address, control):
    """Step to the planned target and record; False if something failed."""
    t, target = control.t, control.target
    near = rounding(t, target - t)
    if system.watched.size and not control.exchange and has_changed(system) and not handle_event(address, control, t, True):
        return False  # a Python function's value has changed
    event = control.exact and _is_event(system, control, near)
    control.ends_at_event = 1 if event else 0
    off_grid = event and not control.at_grid
    if off_grid and system.guards.size:
        jump = system.jumps[control.jump] if control.jump < system.jumps.size else of.NO_EVENT
        _find_due(system.guards, system.causes, system.bus, system.instances, control, jump, near)
    unbroken = control.at_grid and t == control.start + control.done * control.step
    whole = unbroken and (control.done + 1 < control.steps or control.ends_whole)
    h = control.step if whole else target - t
    if not execute(system, control, system.jump_program if event else system.step_program, t, h):
        return False
    if system.guards.size:
        _set_guards(system.guards, control, off_grid)
    target = control.target  # an early return may have moved it
    control.t = target
    if control.at_grid:
        control.done += 1
    if event or control.at_event:
        control.events += 1
        note(system, control, True)
        if not end_in_event(address, control, target):
            return False
    elif not _exchange(system, address, control, target):
        return False
    note(system, control, False)
    return True


@inlined
def _is_to_stop(system, control):
    """Whether the variable that ends the run has been true long enough."""
    if system.bus[control.stop_place] == 0.0:
        control.true_since = of.NO_EVENT
    elif control.true_since == of.NO_EVENT:
        control.true_since = control.t
    return control.t - control.true_since >= control.stop_hold


@compiled
def run(address, control, most):
    """Take up to `most` macro steps; returns GOING_ON, FINISHED, FULL (no room in the record) or FAULT."""
    system = opened(address)
    for _ in range(most):
        if control.done >= control.steps:
            return FINISHED
        if control.rows + 2 > control.room:
            return FULL
        plan(system, control)
        if not take_step(system, address, control):
            return FAULT
        if control.stop_place >= 0 and _is_to_stop(system, control):
            return FINISHED
    return FINISHED if control.done >= control.steps else GOING_ON


@compiled
def plan_step(address, control):
    """Only plan a step: where inputs are given by Python functions, they are asked before it is taken."""
    plan(opened(address), control)


@compiled
def take_planned_step(address, control):
    """Take the planned step; False if something failed."""
    return take_step(opened(address), address, control)


@compiled
def initialize(address, control, t):
    """Read all outputs and spread them over the connections, in initialization mode."""
    system = opened(address)
    if system.clocks.size and not execute(system, control, system.clock_program, t, 0.0):
        return False
    return execute(system, control, system.read_program, t, 0.0) and execute(system, control, system.initial_program, t, 0.0)


@compiled
def exchange(address, control, t):
    """Spread the bus over the connections, and read what follows without delay, in initialization mode."""
    system = opened(address)
    return execute(system, control, system.initial_program, t, 0.0)


@compiled
def begin(address, control, t, in_event_mode):
    """Read all outputs after initialization, set the inputs of the first step, and leave event mode if an instance is in it."""
    system = opened(address)
    if not execute(system, control, system.read_program, t, 0.0):
        return False
    if in_event_mode:
        return handle_event(address, control, t, False)
    return not control.exchange or execute(system, control, system.exchange_program, t, 0.0)


@compiled
def first_row(address, control):
    """Record the row of the start."""
    note(opened(address), control, False)
