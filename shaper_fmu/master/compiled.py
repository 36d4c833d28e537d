"""The stepping loop, compiled. It calls FMUs by address; the system that it steps is data (see layout.py).

A macro step goes from t to the next point of the grid, or to the earliest event before it. At an event the values from
the left are recorded, all instances with event mode enter it, values are exchanged in the order of direct feedthrough
until no discrete state changes any more, and the values from the right are recorded.
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from shaper_fmu.component import time_rounding as _rounding
from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import fmi2_do_step, fmi3_do_step, fmi3_update, pointer_to, read_f8, read_u1, simple_call
from shaper_fmu.master.transfers import compiled, fail, get_values, inlined, judge, set_values

_rounding = inlined(_rounding)
_MOST_UPDATES = 100
_CUT = 2  # at_event: the step has been shortened
GOING_ON, FINISHED, FULL, FAULT = range(4)


@inlined
def _opened(addresses):
    """The system behind its addresses. Arrays that nobody owns need no counting of references in the loop."""
    return of.Layout(
        carray(pointer_to(addresses[0, 0]), addresses[0, 1], of.INSTANCE),  # pyright: ignore[reportCallIssue]
        carray(pointer_to(addresses[1, 0]), addresses[1, 1], of.TRANSFER),
        carray(pointer_to(addresses[2, 0]), addresses[2, 1], of.ELEMENT),
        carray(pointer_to(addresses[3, 0]), addresses[3, 1], np.uint32),
        carray(pointer_to(addresses[4, 0]), addresses[4, 1], np.float64),
        carray(pointer_to(addresses[5, 0]), addresses[5, 1], np.float64),
        carray(pointer_to(addresses[6, 0]), addresses[6, 1], of.TABLE),
        carray(pointer_to(addresses[7, 0]), addresses[7, 1], np.float64),
        carray(pointer_to(addresses[8, 0]), addresses[8, 1], np.float64),
        carray(pointer_to(addresses[9, 0]), addresses[9, 1], np.float64),
        carray(pointer_to(addresses[10, 0]), addresses[10, 1], np.int32),
        carray(pointer_to(addresses[11, 0]), addresses[11, 1], np.int32),
        carray(pointer_to(addresses[12, 0]), addresses[12, 1], of.METRIC),
        carray(pointer_to(addresses[13, 0]), (addresses[13, 1], 2), np.int32),
        carray(pointer_to(addresses[14, 0]), (addresses[14, 1], 2), np.int32),
        carray(pointer_to(addresses[15, 0]), (addresses[15, 1], 2), np.int32),
    )


@inlined
def _step(system, control, number, t, h, stepped):
    instance = system.instances[np.uintp(number)]
    if instance.version == 2:
        return judge(control, fmi2_do_step(instance.do_step, (instance.handle, t, h, np.int32(1))), -1 - number, t)
    return _step3(system.instances, control, number, t, h, stepped)


@compiled
def _step3(instances, control, number, t, h, stepped):
    instance = instances[number]
    a = instance.answers
    arguments = (instance.handle, t, h, np.uint8(1), a + np.uintp(8), a + np.uintp(9), a + np.uintp(10), a)
    if not judge(control, fmi3_do_step(instance.do_step, arguments), -1 - number, t):
        return False
    if read_u1(a + np.uintp(9)):
        return fail(control, of.TERMINATED, 0, -1 - number, -1, read_f8(a))
    if instance.event_mode and read_u1(a + np.uintp(8)):
        control.at_event = 1
    reached = read_f8(a)
    if read_u1(a + np.uintp(10)) and reached < t + h - _rounding(t, h):
        if not control.cut or stepped > 0 or not reached > t + _rounding(t, h):
            return fail(control, of.EARLY_RETURN, 0, -1 - number, -1, reached)
        control.target = reached
        control.at_grid = 0
        control.at_event = _CUT
    return True


@inlined
def _tables(system, t):
    """Values of the tables at t, from the right where they jump; rows count as reached in spite of rounding."""
    for i in range(system.tables.size):
        table = system.tables[i]
        last = table.first + table.count - 1
        while table.cursor < last and system.table_times[table.cursor + 1] <= t + _rounding(t, 0.0):
            table.cursor += 1
        k = table.cursor
        value = system.table_values[k]
        if table.linear and k < last and t > system.table_times[k]:
            part = min(1.0, (t - system.table_times[k]) / (system.table_times[k + 1] - system.table_times[k]))
            value += part * (system.table_values[k + 1] - value)
        system.bus[table.place] = value


@inlined
def execute(system, control, program, t, h):
    """Run a program of transfers and steps over [t, t + h]; False if something failed, told in `control`.

    Where the first instance that steps returns early, the others step to there, too.
    """
    stepped = 0
    for i in range(np.uintp(program.shape[0])):
        code, number = program[i, np.uintp(0)], program[i, np.uintp(1)]
        if code == of.SET:
            going = set_values(system, control, number, t + h if control.exchange else t)
        elif code == of.GET:
            going = get_values(system, control, number, t + h)
        elif code == of.STEP:
            going = _step(system, control, number, t, h, stepped)
            stepped += 1
            if control.at_event == _CUT:
                control.at_event = 1
                h = control.target - t
        else:
            _tables(system, t + h if code == of.TABLES_NOW else t)
            going = True
        if not going:
            return False
    return True


@inlined
def plan(system, control):
    """Where the next step ends: at the next point of the grid, or at the earliest event before it."""
    last = control.done + 1 >= control.steps
    grid = control.stop if last else control.start + (control.done + 1) * control.step
    t = control.t
    target = grid
    if control.exact:
        near = _rounding(t, grid - t)
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


@inlined
def _update(system, control, number, t):
    """Update an instance's discrete states; 1 if it needs another one, 0 if not, -1 if it failed."""
    instance = system.instances[number]
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


@inlined
def _all_in_mode(system, control, entering, t):
    for i in range(system.instances.size):
        instance = system.instances[i]
        if instance.event_mode:
            address = instance.enter_event_mode if entering else instance.enter_step_mode
            if not judge(control, simple_call(address, (instance.handle,)), -1 - i, t, 1 if entering else 2):
                return False
    return True


@inlined
def handle_event(system, control, t, entering):
    """Exchange values at t until nothing changes any more; instances with event mode go through it."""
    if entering and not _all_in_mode(system, control, True, t):
        return False
    asking = 0
    for _ in range(_MOST_UPDATES):
        if not execute(system, control, system.exchange_program, t, 0.0):
            return False
        again = 0
        for i in range(system.instances.size):
            if system.instances[i].event_mode:
                answer = _update(system, control, i, t)
                if answer < 0:
                    return False
                if answer > 0:
                    again, asking = 1, i
        if not execute(system, control, system.read_program, t, 0.0):
            return False
        if not execute(system, control, system.exchange_program, t, 0.0):
            return False
        if again == 0:
            return _all_in_mode(system, control, False, t)
    return fail(control, of.ENDLESS_EVENTS, 0, -1 - asking, 3, t)


@inlined
def _measure(system, t):
    """Take the values at t into the metrics; see metrics.py for what they are."""
    for i in range(system.metrics.size):
        m = system.metrics[i]
        x = system.bus[m.place]
        anew = math.isnan(m.time)
        if m.command >= 0:
            command = system.bus[m.command]
            anew = anew or command != m.commanded
            m.commanded = command
        if anew:
            m.begin = t
            m.first = x
            m.sum = t if m.kind == of.OUTSIDE else 0.0
            m.largest = 0.0 if m.kind == of.ENVELOPE else x
            m.smallest = x
        elif m.kind == of.SQUARE:
            m.sum += m.last * m.last * (t - m.time)
        if m.kind == of.ENVELOPE:
            m.largest = max(m.largest, math.hypot(x - m.rest, system.bus[m.rate] / m.parameter))
        else:
            m.largest = max(m.largest, x)
        m.smallest = min(m.smallest, x)
        if m.kind == of.OUTSIDE and abs(x - m.rest) > m.parameter:
            m.sum = t
        m.last = x
        m.time = t


@inlined
def note(system, control, times, record, left):
    """Record a row; on the grid alone unless events are wanted, too."""
    if control.silent:
        return
    _measure(system, control.t)
    if not control.everywhere and (left or not control.at_grid):
        return
    row = np.uintp(control.rows)
    times[row] = control.t
    for i in range(np.uintp(system.recorded.size)):
        record[row, i] = system.bus[np.uintp(system.recorded[i])]
    control.rows += 1


@inlined
def take_step(system, control, times, record):
    """Step to the planned target and record; False if something failed."""
    t, target = control.t, control.target
    near = _rounding(t, target - t)
    event = control.exact and _is_event(system, control, near)
    whole = control.at_grid and control.done + 1 < control.steps and t == control.start + control.done * control.step
    h = control.step if whole else target - t
    if not execute(system, control, system.step_program, t, h):
        return False
    target = control.target  # an early return may have moved it
    control.t = target
    if control.at_grid:
        control.done += 1
    if event or control.at_event:
        control.events += 1
        note(system, control, times, record, True)
        if not handle_event(system, control, target, True):
            return False
    elif control.exchange and not execute(system, control, system.exchange_program, target, 0.0):
        return False
    note(system, control, times, record, False)
    return True


@compiled
def run(addresses, control, times, record, most):
    """Take up to `most` macro steps; returns GOING_ON, FINISHED, FULL (no room in the record) or FAULT."""
    system = _opened(addresses)
    for _ in range(most):
        if control.done >= control.steps:
            return FINISHED
        if control.rows + 2 > times.size:
            return FULL
        plan(system, control)
        if not take_step(system, control, times, record):
            return FAULT
    return FINISHED if control.done >= control.steps else GOING_ON


@compiled
def plan_step(addresses, control):
    """Only plan a step: where inputs are given by Python functions, they are asked before it is taken."""
    plan(_opened(addresses), control)


@compiled
def take_planned_step(addresses, control, times, record):
    """Take the planned step; False if something failed."""
    return take_step(_opened(addresses), control, times, record)


@compiled
def initialize(addresses, control, t):
    """Read all outputs and spread them over the connections, in initialization mode."""
    system = _opened(addresses)
    return execute(system, control, system.read_program, t, 0.0) and execute(system, control, system.exchange_program, t, 0.0)


@compiled
def begin(addresses, control, t, in_event_mode):
    """Read all outputs after initialization, and leave event mode if an instance is in it."""
    system = _opened(addresses)
    if not execute(system, control, system.read_program, t, 0.0):
        return False
    return not in_event_mode or handle_event(system, control, t, False)


@compiled
def first_row(addresses, control, times, record):
    """Record the row of the start."""
    note(_opened(addresses), control, times, record, False)
