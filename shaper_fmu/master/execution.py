"""Programs of the compiled loop: transfers, steps and tables over one step, with the system opened from its addresses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import carray  # pyright: ignore[reportPrivateImportUsage]

from shaper_fmu.component import time_rounding
from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import fmi2_do_step, fmi2_set_slopes, fmi3_do_step, pointer_to, read_f8, read_u1, read_u8, write_f8
from shaper_fmu.master.transfers import (
    compiled,
    fail,
    get_reals,
    get_values,
    inlined,
    judge,
    keep_values,
    set_again,
    set_reals,
    set_values,
)
from shaper_fmu.metrics.metric import GATHERED

rounding: Any = inlined(time_rounding)
CUT = 2
"""at_event: the step has been shortened."""


@inlined
def opened(address):
    """The system behind the address of its arrays' addresses. Arrays that nobody owns need no counting of references."""
    a = np.uintp(address)
    return of.Layout(
        _array(a, 0, of.INSTANCE),
        _array(a, 1, of.TRANSFER),
        _array(a, 2, of.ELEMENT),
        _array(a, 3, np.uint32),
        _array(a, 4, np.float64),
        _array(a, 5, np.float64),
        _array(a, 6, of.TABLE),
        _array(a, 7, np.float64),
        _array(a, 8, np.float64),
        _array(a, 9, np.float64),
        _array(a, 10, np.int32),
        _array(a, 11, np.int32),
        _array(a, 12, GATHERED),
        _program(a, 13),
        _program(a, 14),
        _program(a, 15),
        _array(a, 16, of.SLOPE),
        _array(a, 17, of.SLOPES_OF),
        _program(a, 18),
        _array(a, 19, of.GUARD),
        _array(a, 20, np.int32),
        _program(a, 21),
        _array(a, 22, np.float64),
        _program(a, 23),
        _program(a, 24),
        _program(a, 25),
        _program(a, 26),
        _program(a, 27),
        _array(a, 28, of.WATCHED),
        _array(a, 29, of.CLOCK),
        _array(a, 30, of.CLOCK_GUARD),
        _array(a, 31, np.int32),
        _program(a, 32),
        _program(a, 33),
    )


@inlined
def _array(address, field, kind):
    at = address + np.uintp(16 * field)
    return carray(pointer_to(read_u8(at)), np.int64(read_u8(at + np.uintp(8))), kind)  # pyright: ignore[reportCallIssue]


@inlined
def _program(address, field):
    at = address + np.uintp(16 * field)
    return carray(pointer_to(read_u8(at)), (np.int64(read_u8(at + np.uintp(8))), 2), np.int32)  # pyright: ignore[reportCallIssue]


@inlined
def _step2(instances, control, number, t, h):
    instance = instances[np.uintp(number)]
    return judge(control, fmi2_do_step(instance.do_step, (instance.handle, t, h, np.int32(1 - control.returning))), -1 - number, t)


@compiled
def _step3(instances, control, number, t, h, stepped):
    instance = instances[number]
    a = instance.answers
    arguments = (instance.handle, t, h, np.uint8(1 - control.returning), a + np.uintp(8), a + np.uintp(9), a + np.uintp(10), a)
    if not judge(control, fmi3_do_step(instance.do_step, arguments), -1 - number, t):
        return False
    if read_u1(a + np.uintp(9)):
        return fail(control, of.TERMINATED, 0, -1 - number, -1, read_f8(a))
    if instance.event_mode and read_u1(a + np.uintp(8)):
        control.at_event = 1
    reached = read_f8(a)
    if read_u1(a + np.uintp(10)) and reached < t + h - rounding(t, h):
        if not control.cut or stepped > 0 or not reached > t + rounding(t, h):
            return fail(control, of.EARLY_RETURN, 0, -1 - number, -1, reached)
        control.target = reached
        control.at_grid = 0
        control.at_event = CUT
    return True


@compiled
def _tables(tables, times, values, bus, t):
    """Values of the tables at t, from the right where they jump; rows count as reached in spite of rounding."""
    for i in range(tables.size):
        table = tables[i]
        last = table.first + table.count - 1
        while table.cursor < last and times[table.cursor + 1] <= t + rounding(t, 0.0):
            table.cursor += 1
        k = table.cursor
        value = values[k]
        if table.linear and k < last and t > times[k]:
            part = min(1.0, (t - times[k]) / (times[k + 1] - times[k]))
            value += part * (values[k + 1] - value)
        bus[table.place] = value


@compiled
def _ticks(clocks, numbers, guard):
    """Whether one of a guard's clocks ticks; has begun to, where its operations are done once."""
    for i in range(guard.first, guard.first + guard.count):
        active = clocks[numbers[i]].active
        if active == 1 or (active and not guard.once):
            return True
    return False


@compiled
def _hold(slopes, bus, t):
    """Keep the values of the sources of linear inputs at the beginning of a step, and at that of the step before."""
    for i in range(slopes.size):
        row = slopes[i]
        row.previous, row.previous_time = bus[row.held], row.held_time
        bus[row.held], row.held_time = bus[row.source], t


@compiled
def _set_slopes(called, slopes, bus, control, t, h):
    """Tell an instance the slopes of its linear inputs over [t, t + h].

    The slope is that of the line to the source's value at t + h where it is known already and continuous there; else the
    slope over the step before, unless an event was in between; else none.
    """
    for i in range(called.rows):
        row = slopes[called.first + i]
        slope = 0.0
        if row.known and h > 0.0 and not control.ends_at_event:
            slope = (bus[row.source] - bus[row.held]) / h
        elif row.previous_time >= control.smooth_from and t > row.previous_time:
            slope = (bus[row.held] - row.previous) / (t - row.previous_time)
        write_f8(called.values + np.uintp(8 * i), row.gain * slope)
    arguments = (called.handle, called.references, np.uintp(called.rows), called.orders, called.values)
    return judge(control, fmi2_set_slopes(called.function, arguments), -1 - called.instance, t, 4)


@inlined
def execute(system, control, program, t, h):
    """Run a program over [t, t + h]; False if something failed, told in `control`.

    Where the first instance that steps returns early, the others step to there, too.
    """
    stepped = skipped = 0
    for i in range(np.uintp(program.shape[0])):
        code, number = program[i, np.uintp(0)], program[i, np.uintp(1)]
        going = True
        if skipped > 0:
            skipped -= 1
        elif code == of.SET2:
            going = set_reals(system.transfers, control, number, t + h if control.exchange else t)
        elif code == of.GET2:
            going = get_reals(system.transfers, control, number, t + h)
        elif code == of.STEP2:
            going = _step2(system.instances, control, number, t, h)
            stepped += 1
        elif code == of.SET:
            going = set_values(system.transfers, control, number, t + h if control.exchange else t)
        elif code == of.GET:
            going = get_values(system.transfers, control, number, t + h)
        elif code == of.STEP3:
            going = _step3(system.instances, control, number, t, h, stepped)
            stepped += 1
            if control.at_event == CUT:
                control.at_event = 1
                h = control.target - t
        elif code == of.SLOPES:
            going = _set_slopes(system.slopes_of[number], system.slopes, system.bus, control, t, h)
        elif code == of.GUARDED:
            skipped = 0 if control.all_open or system.guards[number].open else system.guards[number].skip
        elif code == of.KEEP:
            keep_values(system.transfers[number])
        elif code == of.AGAIN:
            going = control.resuming == 0 or set_again(system.transfers, control, number, t)
        elif code == of.CLOCKED:
            guard = system.clock_guards[number]
            skipped = 0 if _ticks(system.clocks, system.clock_numbers, guard) else guard.skip
        elif code == of.HOLD:
            _hold(system.slopes, system.bus, t)
        else:
            when = t + h if code == of.TABLES_NOW else t
            _tables(system.tables, system.table_times, system.table_values, system.bus, when)
        if not going:
            return False
    return True
