"""What went wrong in the compiled loop, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shaper_fmu.errors import SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.instance import Instance, moment
from shaper_fmu.master.program import Program


def fault_error(program: Program, instances: Mapping[str, Instance], control: Any, at: str | None) -> SimulationError:
    """The error for the fault that `control` tells of; `at` names the moment where it is not a time."""
    where, t = int(control.fault_where), float(control.fault_time)
    when = at if at is not None else t
    if where >= 0:
        name, function, elements = program.labels[where]
    else:
        name, elements = program.names[-1 - where], []
        function = f"fmi{instances[name].fmu.version}DoStep"
    instance, fault = instances[name], int(control.fault)
    if fault == of.CALL_FAILED:
        return instance.failure(function, int(control.fault_status), when)
    if fault in (of.NOT_FINITE, of.NOT_IN_RANGE):
        element = int(control.fault_element)
        transfer = program.layout.transfers[where]
        value = program.layout.bus[program.layout.places[transfer["elements"] + element]]
        words = (
            "" if fault == of.NOT_FINITE else f", which does not fit into its type {instance.fmu.variables[elements[element]].type}"
        )
        return SimulationError(f"{name}{moment(when)}: the value for input {elements[element]} is {value}{words}")
    if fault == of.EARLY_RETURN:
        return SimulationError(
            f"{name}: returned early, at t = {t:.15g} s, from an event that it had not announced; the others have gone on. "
            f"Use it without event mode: system.use_event_mode({name!r}, False)"
        )
    if fault == of.TERMINATED:
        return SimulationError(f"{name}{moment(when)}: asked to end the simulation{_said(instance)}")
    return SimulationError(f"at t = {t:.15g} s the discrete states of the instances do not settle")


def _said(instance: Instance) -> str:
    return f": {'; '.join(list(instance.log)[-3:])}" if instance.log else ""
