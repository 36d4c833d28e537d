"""Whole runs, compiled: reset, start values, initialization, and all steps, one run after the other. For batches of short runs."""

from __future__ import annotations

import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import fmi2_setup, fmi3_enter_initialization, simple_call, write_i8
from shaper_fmu.master.clock_loop import start_clocks
from shaper_fmu.master.compiled import FAULT, FINISHED, begin, first_row, initialize, run
from shaper_fmu.master.execution import execute, opened
from shaper_fmu.master.transfers import compiled, judge

_RESET, _SETUP, _ENTER, _EXIT = 5, 6, 7, 8  # as faults.py counts the functions


@compiled
def start_again(address, control, in_event_mode):
    """Bring all instances from wherever they are to the start of a run; False if something failed."""
    system = opened(address)
    for i in range(system.instances.size):
        if not judge(control, simple_call(system.instances[i].reset, (system.instances[i].handle,)), -1 - i, control.start, _RESET):
            return False
    _forget(system)
    for i in range(system.instances.size):
        if system.instances[i].version == 2 and not _set_up(system.instances[i], control, i):
            return False
    if not execute(system, control, system.start_program, control.start, 0.0):
        return False
    for i in range(system.instances.size):
        if not _enter_initialization(system.instances[i], control, i):
            return False
    if not initialize(address, control, control.start):
        return False
    if system.clocks.size and not start_clocks(address, control):
        return False
    for i in range(system.instances.size):
        instance = system.instances[i]
        if not judge(control, simple_call(instance.exit_initialization, (instance.handle,)), -1 - i, control.start, _EXIT):
            return False
    return begin(address, control, control.start, in_event_mode)


@compiled
def _forget(system):
    """Bring what the loop changes back to the state before a run."""
    for i in range(system.tables.size):
        system.tables[i].cursor = system.tables[i].first
    for i in range(system.instances.size):
        system.instances[i].next_event = of.NO_EVENT
    for i in range(system.metrics.size):
        system.metrics[i].time = np.nan
    for i in range(system.slopes.size):
        system.slopes[i].previous_time = np.nan
        system.slopes[i].held_time = np.nan


@compiled
def _set_up(instance, control, number):
    told = np.int32(1 if instance.tolerance > 0.0 else 0)
    arguments = (instance.handle, told, instance.tolerance, control.start, np.int32(1), control.stop)
    return judge(control, fmi2_setup(instance.setup, arguments), -1 - number, control.start, _SETUP)


@compiled
def _enter_initialization(instance, control, number):
    if instance.version == 2:
        status = simple_call(instance.enter_initialization, (instance.handle,))
    else:
        told = np.uint8(1 if instance.tolerance > 0.0 else 0)
        arguments = (instance.handle, told, instance.tolerance, control.start, np.uint8(1), control.stop)
        status = fmi3_enter_initialization(instance.enter_initialization, arguments)
    return judge(control, status, -1 - number, control.start, _ENTER)


@compiled
def _one_run(address, control, in_event_mode, most):
    """A run from its start on, for up to `most` macro steps; answers as `run` does."""
    if not start_again(address, control, in_event_mode):
        return FAULT
    first_row(address, control)
    return run(address, control, most)


@compiled
def whole_runs(address, controls, in_event_mode, most, places, rows, numbers, now, gathered):
    """Runs with the start values `rows`, shape (runs, values), for `places` on the bus; what the metrics gather goes to `gathered`.

    `controls` are the control in use, and a fresh one. The number of the run at work is written to the address `now`, unless that
    is 0. Returns how many runs have finished, and FINISHED, or what `run` answered for the next one.
    """
    system = opened(address)
    for i in range(rows.shape[0]):
        if now:
            write_i8(now, numbers[i])
        controls[0] = controls[1]
        for k in range(places.size):
            system.bus[places[k]] = rows[i, k]
        code = _one_run(address, controls[0], in_event_mode, most)
        if code != FINISHED:
            return i, code
        for k in range(system.metrics.size):
            gathered[i, k] = system.metrics[k]
    return rows.shape[0], FINISHED
