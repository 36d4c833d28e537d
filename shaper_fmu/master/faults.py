"""What went wrong in the compiled loop, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from ctypes import byref, c_int

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2Terminated

from shaper_fmu.errors import SimulationError
from shaper_fmu.master import layout as of
from shaper_fmu.master.functions import standard_name
from shaper_fmu.master.instance import Instance, moment
from shaper_fmu.master.program import Program
from shaper_fmu.master.variables import items_of, shown_items
from shaper_fmu.master.wiring import Port

_DISCARD = 2
_SAME_STEP = 1e-6  # of the FMU's own step
_QUALIFIERS = {0: "fmi3IntervalNotYetKnown", -1: "nothing"}


def fault_error(program: Program, instances: Mapping[str, Instance], control: of.Control, at: str | None) -> SimulationError:
    """The error for the fault that `control` tells of; `at` names the moment where it is not a time."""
    if control.fault >= of.BAD_INTERVAL:
        return SimulationError(clock_fault(program.clocks.ports, program.layout.clocks, control, at))
    where, t = int(control.fault_where), float(control.fault_time)
    when = at if at is not None else t
    if where >= 0:
        name, function, elements = program.labels[where]
    else:
        name, elements = program.names[-1 - where], []
        function = called_name(instances[name], int(control.fault_element))
    instance, fault = instances[name], of.Fault(control.fault)
    if fault == of.CALL_FAILED:
        stepping = function.endswith("DoStep")
        if function == "fmi2DoStep" and control.fault_status == _DISCARD and _has_terminated(instance):
            error = SimulationError(f"{name}{moment(when)}: {function} asked to end the simulation{_said(instance)}")
        else:
            error = instance.failure(function, int(control.fault_status), when)
        return SimulationError(f"{error}{_about_the_step(instance, control)}") if stepping else error
    if fault in (of.NOT_FINITE, of.NOT_IN_RANGE, of.NO_ITEM):
        element = int(control.fault_element)
        input_, value = elements[element], program.layout.bus[program.sources[where][element]]
        variable = instance.fmu.variables[input_]
        words = {
            of.NOT_IN_RANGE: f", which does not fit into its type {variable.type}",
            of.NO_ITEM: f", which is not an item of the enumeration: {shown_items(items_of(variable))}",
        }.get(fault, "")
        shown = f"{value:.0f}" if fault == of.NO_ITEM else f"{value}"
        return SimulationError(
            f"{name}{moment(when)}: the value for input {input_} is {shown}{_source(program, name, input_)}{words}"
        )
    if fault == of.EARLY_RETURN:
        advice = f". Use it without event mode: system.use_event_mode({name!r}, False)" if instance.event_mode else ""
        return SimulationError(
            f"{name}: {function} returned early, at t = {t:.15g} s, from an event that it had not announced, and the step cannot "
            f"be shortened for all{_said(instance)}{advice}"
        )
    if fault in (of.NOT_A_NUMBER, of.SOLVER_FAULT, of.ENDLESS_STATE_EVENTS, of.OPEN_LOOP, of.OTHER_COUNT):
        return SimulationError(
            f"{name}{moment(when)}: {_solver_words(fault, function, int(control.fault_status))}{_said(instance)}"
        )
    if fault == of.TERMINATED:
        return SimulationError(f"{name}{moment(when)}: {function} asked to end the simulation{_said(instance)}")
    return SimulationError(f"{name}{moment(when)}: {function} asked for another update again and again{_said(instance)}")


def called_name(instance: Instance, number: int) -> str:
    """The name of the function of FMI that a fault tells of by its number."""
    version, name = instance.fmu.version, of.Called(number).name
    names = {
        ("GetDerivatives", 3): "GetContinuousStateDerivatives", ("GetNominals", 1): "GetNominalContinuousStates",
        ("GetNominals", 2): "GetNominalsOfContinuousStates", ("GetNominals", 3): "GetNominalsOfContinuousStates",
        ("UpdateDiscreteStates", 2): "NewDiscreteStates", ("UpdateDiscreteStates", 1): "EventUpdate",
        ("Reset", 1): "ResetSlave", ("SetupExperiment", 1): "SetTime",
        ("GetInputs", 3): "GetFloat64", ("SetInputs", 3): "SetFloat64",
    }  # fmt: skip
    names |= {(f"{verb}Inputs", known): f"{verb}Real" for verb in ("Get", "Set") for known in (1, 2)}
    exchange = instance.fmu.exchanges_model
    if name == "EnterInitializationMode" and version == 1:
        name = "Initialize" if exchange else "InitializeSlave"
    if name == "EnterStepMode" and exchange:
        name = "EnterContinuousTimeMode"
    return standard_name(f"fmi{version}{names.get((name, version), name)}")


_SOLVER_FAULTS = {
    -1: "it takes more than a million steps within one communication step",
    -2: "its tolerance is too small for the machine's numbers",
    -3: "the error test fails however short its steps are; the solution may have a singularity there",
    -4: "its equations cannot be solved however short its steps are; the solution may have a singularity there",
}
"""By CVODE's answers."""


def _solver_words(fault: of.Fault, function: str, status: int) -> str:
    if fault == of.NOT_A_NUMBER:
        return f"value {status + 1} of {function} is not a finite number, however short the solver's steps are"
    if fault == of.ENDLESS_STATE_EVENTS:
        return (
            "state events follow each other ever faster, or without end, as of a bouncing ball that comes to rest; the model needs "
            "a state in which it stays"
        )
    if fault == of.OPEN_LOOP:
        return "no values were found that close a loop without delay; break it with an FMU that has no direct feedthrough"
    if fault == of.OTHER_COUNT:
        return f"{function} writes more values than the {status} that it is asked for, by its description"
    return f"the solver (CVODE) cannot go on: {_SOLVER_FAULTS.get(status, f'it answers {status}')}"


def clock_fault(ports: Sequence[Port], clocks: np.ndarray, control: of.Control, at: str | None) -> str:
    """What is wrong with a clock, in words."""
    number, status, t = int(control.fault_element), int(control.fault_status), float(control.fault_time)
    clock, name = clocks[number], ".".join(ports[number])
    when = moment(at if at is not None else t)
    interval = float(clock["interval"] / clock["resolution"])
    if control.fault == of.NO_INTERVAL:
        told = _QUALIFIERS.get(status, f"the qualifier {status}")
        return f"clock {name}{when}: asked for its interval, the FMU told {told}; only countdown clocks may leave it open"
    if control.fault == of.BAD_INTERVAL and status == 1:
        return f"clock {name}{when}: its shift {float(clock['shift']):g} s must be a finite number, not below 0"
    if control.fault == of.BAD_INTERVAL:
        return f"clock {name}{when}: its interval {interval:g} s must be a finite number above 0 that times can tell apart"
    if control.fault == of.OFF_GRID:
        return (
            f"clock {name}{when}: it ticks next at t = {float(clock['next']):.15g} s, between two communication points, and steps "
            f"are kept to multiples of {float(control.step):g} s: use steps that divide its ticks, or FMUs that take any steps"
        )
    return f"clock {name}{when}: it ticks again and again at this time, since its interval is 0"


def warning_notes(program: Program, instances: Mapping[str, Instance], control: of.Control) -> list[str]:
    """What a user should know of calls that returned a warning."""
    if not control.warnings:
        return []
    where = int(control.warned)
    name = program.labels[where][0] if where >= 0 else program.names[-1 - where]
    calls = "1 call" if control.warnings == 1 else f"{control.warnings} calls"
    said = list(instances[name].log)[-1:]
    return [f"{calls} returned a warning, the last by {name}{': ' if said else ''}{''.join(said)}"]


def _about_the_step(instance: Instance, control: of.Control) -> str:
    """Advice where the failed step is no multiple of the FMU's own: exports with a fixed solver step take no others."""
    experiment = instance.fmu.description.defaultExperiment
    named = [getattr(experiment, "stepSize", None), getattr(instance.fmu.capabilities, "fixedInternalStepSize", None)]
    step = float(control.target) - float(control.t)
    for own in (float(text) for text in named if text):
        if own > 0.0 and abs(step / own - round(step / own)) > _SAME_STEP:
            return (
                f". This step is of {step:.6g} s, no multiple of the {own:g} s that its description names; if it takes multiples "
                "alone, choose such a step, and end none at events between (exact=False, --grid)"
            )
    return ""


def _source(program: Program, name: str, input_: str) -> str:
    """Where an input's value comes from, as part of a message."""
    source = program.connections.get((name, input_))
    return f", from {'.'.join(source)}" if source is not None else ""


def _has_terminated(instance: Instance) -> bool:
    """Whether an FMI 2.0 instance that has discarded a step wants to end the simulation (FMI 2.0.5, section 4.2.2)."""
    answer = c_int(0)
    try:
        instance.slave.fmi2GetBooleanStatus(instance.slave.component, fmi2Terminated, byref(answer))
    except (FMICallException, SimulationError):  # the latter where the library lacks the function
        return False
    return bool(answer.value)


def _said(instance: Instance) -> str:
    return f": {'; '.join(list(instance.log)[-3:])}" if instance.log else ""
