"""Clocks in the compiled loop: when they tick, and what is exchanged while they do (FMI 3.0, section 2.2.8).

The next tick of an instance's clocks is part of its `next_event`, so that steps end there. Of the super-dense instants of an
event the timed clocks get one of their own, after all else has settled: they sample values from the right of jumps.
"""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import (
    fmi2_transfer,
    fmi3_get_interval_fraction,
    fmi3_transfer,
    read_f8,
    read_i4,
    read_u1,
    read_u8,
    write_i4,
    write_u1,
)
from shaper_fmu.master.execution import execute, opened, rounding
from shaper_fmu.master.transfers import compiled, fail, judge

_MOST_TICKS = 50
"""Of one clock at one time."""
_ONE = np.uintp(1)
_SET, _GET, _DECIMAL, _FRACTION, _SHIFT_DECIMAL, _SHIFT_FRACTION = range(9, 15)  # as faults.py counts the functions
_UNKNOWN, _UNCHANGED, _CHANGED = range(3)  # fmi3IntervalQualifier
_FAILED = -1
_COUNTER, _RESOLUTION, _QUALIFIER = np.uintp(0), np.uintp(8), np.uintp(16)  # of the 64 bytes for answers


@compiled
def _is_timed(clock):
    return clock.kind == of.PERIODIC or clock.kind == of.CHANGING or clock.kind == of.COUNTDOWN


@compiled
def _tick_time(clock):
    """When a periodic clock ticks next; by multiplication, so that no rounding adds up."""
    return clock.origin + (clock.shift + clock.count * clock.interval) / clock.resolution


@compiled
def _ask_interval(instances, control, clock, number, t):
    """Ask for an interval [s / resolution]; returns its qualifier, or _FAILED."""
    instance = instances[clock.instance]
    a, where = instance.answers, -1 - clock.instance
    write_i4(a + _QUALIFIER, np.int32(-1))
    if clock.fraction:
        arguments = (instance.handle, clock.reference, _ONE, a + _COUNTER, a + _RESOLUTION, a + _QUALIFIER)
        if not judge(control, fmi3_get_interval_fraction(clock.get_interval, arguments), where, t, _FRACTION):
            return _FAILED
        interval, resolution = float(read_u8(a + _COUNTER)), float(read_u8(a + _RESOLUTION))
    else:
        decimal = (instance.handle, clock.reference, _ONE, a + _COUNTER, a + _QUALIFIER)
        if not judge(control, fmi3_transfer(clock.get_interval, decimal), where, t, _DECIMAL):
            return _FAILED
        interval, resolution = read_f8(a + _COUNTER), 1.0
    qualifier = read_i4(a + _QUALIFIER)
    if qualifier == _UNKNOWN and clock.kind == of.COUNTDOWN:
        return _UNKNOWN
    if qualifier != _UNCHANGED and qualifier != _CHANGED:
        fail(control, of.NO_INTERVAL, qualifier, where, number, t)
        return _FAILED
    known = clock.interval / clock.resolution
    if qualifier == _UNCHANGED and math.isfinite(known):
        return _UNCHANGED
    clock.interval, clock.resolution = interval, resolution
    told = interval / resolution
    if not (math.isfinite(told) and (told >= 0.0 if clock.kind != of.PERIODIC else told > 0.0)):
        fail(control, of.BAD_INTERVAL, 0, where, number, t)
        return _FAILED
    return _UNCHANGED if clock.kind == of.PERIODIC and told == known else _CHANGED


@compiled
def _ask_shift(instances, control, clock, number):
    """Ask for a periodic clock's shift, in the resolution of its interval if it is told in that one, too."""
    instance = instances[clock.instance]
    a, where, t = instance.answers, -1 - clock.instance, control.start
    if clock.fraction:
        fraction = (instance.handle, clock.reference, _ONE, a + _COUNTER, a + _RESOLUTION)
        if not judge(control, fmi3_transfer(clock.get_shift, fraction), where, t, _SHIFT_FRACTION):
            return False
        clock.shift, resolution = float(read_u8(a + _COUNTER)), float(read_u8(a + _RESOLUTION))
        if resolution != clock.resolution:
            clock.interval, clock.shift, clock.resolution = clock.interval / clock.resolution, clock.shift / resolution, 1.0
    else:
        decimal = (instance.handle, clock.reference, _ONE, a + _COUNTER)
        if not judge(control, fmi2_transfer(clock.get_shift, decimal), where, t, _SHIFT_DECIMAL):
            return False
        clock.shift = read_f8(a + _COUNTER)
    if not (math.isfinite(clock.shift) and clock.shift >= 0.0):
        return fail(control, of.BAD_INTERVAL, 1, where, number, t)
    return True


@compiled
def start_clocks(address, control):
    """Find out the first ticks, at the end of initialization mode; False if something failed."""
    system = opened(address)
    for i in range(system.clocks.size):
        clock = system.clocks[i]
        clock.active = clock.ticks = 0
        clock.count = 0
        clock.next, clock.ticked = of.NO_EVENT, math.nan
        clock.origin = control.start
        if not _is_timed(clock):
            continue
        qualifier = _CHANGED
        if clock.asked:
            clock.interval, clock.resolution = math.nan, 1.0
            qualifier = _ask_interval(system.instances, control, clock, i, control.start)
            if qualifier == _FAILED:
                return False
            if clock.kind == of.PERIODIC and not _ask_shift(system.instances, control, clock, i):
                return False
        if clock.kind == of.PERIODIC:
            clock.next = _tick_time(clock)
        elif qualifier != _UNKNOWN:
            clock.next = control.start + clock.interval / clock.resolution
        if not _is_kept(control, clock, i, control.start):
            return False
    return True


@compiled
def _is_kept(control, clock, number, t):
    """Whether the next tick can be kept: where steps do not end at events, it has to be at a point of the grid."""
    if not control.on_grid or clock.next > control.stop + control.step:
        return True
    away = abs(clock.next - _grid_point(control, clock.next))
    return away <= rounding(clock.next, control.step) or fail(control, of.OFF_GRID, 0, -1 - clock.instance, number, t)


@compiled
def _grid_point(control, t):
    """The nearest point of the grid."""
    return control.start + math.floor((t - control.start) / control.step + 0.5) * control.step


@compiled
def _activate(instances, control, clock, number, t):
    """Have an input clock tick."""
    instance = instances[clock.instance]
    if clock.ticked != t:
        clock.ticks = 0
    clock.active, clock.ticked = 1, t
    clock.ticks += 1
    if clock.ticks > _MOST_TICKS:
        return fail(control, of.ENDLESS_TICKS, 0, -1 - clock.instance, number, t)
    write_u1(instance.answers, np.uint8(1))
    arguments = (instance.handle, clock.reference, _ONE, instance.answers)
    return judge(control, fmi2_transfer(clock.set, arguments), -1 - clock.instance, t, _SET)


@compiled
def _activate_timed(system, control, t):
    """Have the timed clocks tick that are due."""
    near = rounding(t, control.step)
    for i in range(system.clocks.size):
        clock = system.clocks[i]
        if not _is_timed(clock) or clock.next > t + near:
            continue
        if not _activate(system.instances, control, clock, i, t):
            return False
        if clock.kind == of.PERIODIC:
            clock.count += 1
            clock.next = _tick_time(clock)
            if clock.next <= t + near:
                return fail(control, of.BAD_INTERVAL, 0, -1 - clock.instance, i, t)
            if not _is_kept(control, clock, i, t):
                return False
        else:
            clock.next = of.NO_EVENT
    return True


@compiled
def _can_be_read(system, clock):
    for i in range(clock.within, clock.within + clock.within_count):
        if system.clocks[system.clock_numbers[i]].active:
            return True
    return clock.within_count == 0


@compiled
def _activate_triggered(system, control, t):
    """Ask the output clocks, and have those tick that are connected to them; 1 if there are new ones, 0 if not, or _FAILED."""
    found = 0
    for i in range(system.clocks.size):
        clock = system.clocks[i]
        if clock.kind != of.TRIGGERING or clock.active or not _can_be_read(system, clock):
            continue
        instance = system.instances[clock.instance]
        write_u1(instance.answers, np.uint8(0))
        arguments = (instance.handle, clock.reference, _ONE, instance.answers)
        if not judge(control, fmi2_transfer(clock.get, arguments), -1 - clock.instance, t, _GET):
            return _FAILED
        if not read_u1(instance.answers):
            continue
        clock.active = found = 1
        for k in range(clock.targets, clock.targets + clock.target_count):
            number = system.clock_numbers[k]
            if not _activate(system.instances, control, system.clocks[number], number, t):
                return _FAILED
    return found


@compiled
def _exchange_ticking(system, control, t):
    """Exchange what belongs to the clocks that tick; after it they have sampled (`active` is 2)."""
    if not execute(system, control, system.tick_program, t, 0.0):
        return False
    for i in range(system.clocks.size):
        if system.clocks[i].active:
            system.clocks[i].active = 2
    return True


@compiled
def tick(address, control, t, settled):
    """Have clocks tick in this super-dense instant, the timed ones if all else has settled; False if something failed."""
    system = opened(address)
    if settled and not (_activate_timed(system, control, t) and _exchange_ticking(system, control, t)):
        return False
    for _ in range(system.clocks.size):
        found = _activate_triggered(system, control, t)
        if found <= 0:
            return found == 0
        if not _exchange_ticking(system, control, t):
            return False
    return True


@compiled
def end_ticks(address, control, t):
    """After discrete states were updated: ask for intervals, and tell the instances' next events; 1 if a tick is due at t.

    0 if none is; -1 if something failed.
    """
    system = opened(address)
    due, near = 0, rounding(t, control.step)
    if control.on_grid:
        for i in range(system.instances.size):
            instance = system.instances[i]
            if instance.next_event <= control.stop:
                point = _grid_point(control, instance.next_event)
                instance.next_event = point if point >= instance.next_event - near else point + control.step
    for i in range(system.clocks.size):
        clock = system.clocks[i]
        was_active, clock.active = clock.active, 0
        if not _is_timed(clock):
            continue
        asked = clock.asked == of.ALWAYS and (clock.kind != of.CHANGING or was_active) and clock.next > t + near
        if asked and not _ask_again(system.instances, control, clock, i, t):  # but a tick that is due comes first
            return _FAILED
        if clock.next <= t + near:
            due = 1
        instance = system.instances[clock.instance]
        instance.next_event = min(instance.next_event, clock.next)
    return due


@compiled
def _ask_again(instances, control, clock, number, t):
    """What an instance tells of a clock's next tick in event mode."""
    qualifier = _ask_interval(instances, control, clock, number, t)
    if qualifier == _FAILED:
        return False
    if clock.kind == of.PERIODIC:
        if qualifier == _CHANGED:  # the new interval counts from now on
            clock.origin, clock.shift, clock.count = t, 0.0, 1
            clock.next = _tick_time(clock)
    elif qualifier == _UNKNOWN:
        clock.next = of.NO_EVENT
    elif qualifier == _CHANGED or clock.kind == of.CHANGING:
        clock.next = t + clock.interval / clock.resolution
    return _is_kept(control, clock, number, t)
