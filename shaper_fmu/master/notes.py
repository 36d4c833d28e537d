"""Notes on a run: events on the grid, loops, values that are a step late, open inputs, faulty model descriptions."""

from __future__ import annotations

from collections.abc import Collection

from shaper_fmu.master.algorithms import Algorithm, Coupling
from shaper_fmu.master.clocks import is_clocked
from shaper_fmu.master.events import Treatment
from shaper_fmu.master.fmu import event_output
from shaper_fmu.master.loops import loop_text
from shaper_fmu.master.structure import SystemStructure
from shaper_fmu.master.variables import TRANSFERABLE, kind_of
from shaper_fmu.master.wiring import Loop, Port

_LONGEST = 200


def coupling_notes(
    system: SystemStructure,
    treatment: Treatment,
    algorithm: Algorithm,
    recorded: Collection[Port] = (),
    coupling: Coupling = "monolithic",
) -> tuple[str, ...]:
    """The notes of a run with this treatment of events and algorithm, where these variables are recorded."""
    late = _late_notes(system, treatment, recorded) if algorithm == "jacobi" else []
    return (*treatment.notes, *_loop_notes(system, coupling), *late)


def _loop_notes(system: SystemStructure, coupling: Coupling) -> list[str]:
    notes = []
    for loop in system.signal_order()[1]:
        if coupling == "monolithic" and all(system.fmus[name].exchanges_model for name, _ in loop):
            continue  # closed in every evaluation
        late = next((port for port in _sources(system, loop) if not system.readable_after_set(port[0])), None)
        behind = f"{'.'.join(late)} is a step late" if late else f"{'.'.join(loop[0])} is an exchange behind"
        notes.append(f"{loop_text(loop)}: solved at the start, later {behind}")
    return notes


def _sources(system: SystemStructure, loop: Loop) -> list[Port]:
    return [system.connections[port] for port in loop[:-1]]


def _late_notes(system: SystemStructure, treatment: Treatment, recorded: Collection[Port]) -> list[str]:
    """Outputs with direct feedthrough whose value a master gets only from the end of the last step.

    Clocked ones move in events, which allow reading.
    """
    notes = []
    for name, fmu in system.fmus.items():
        if system.readable_after_set(name):
            continue
        fed = [port[1] for port in [*system.connections, *system.signals] if port[0] == name and not is_clocked(fmu, port[1])]
        targets: dict[str, list[str]] = {}
        for target, (source, output) in treatment.connections.items():
            if source == name and not is_clocked(fmu, output) and not set(fed).isdisjoint(fmu.inputs_of(output)):
                targets.setdefault(output, []).append(".".join(target))
        announced = event_output(fmu)
        if treatment.exact and announced and not set(fed).isdisjoint(fmu.inputs_of(announced)):
            targets.setdefault(announced, []).append("the times of its events")
        shown = [output for instance, output in recorded if instance == name and fmu.variables[output].causality == "output"]
        shown = [output for output in shown if not is_clocked(fmu, output)]
        declared = [o for o in shown if fmu.declares_inputs_of(o) and not set(fed).isdisjoint(fmu.inputs_of(o))]
        if targets:
            notes.append(_late_note(system, treatment, name, targets))
        elif declared:
            notes.append(f"{name}: {_listed(declared)} of a point of time follow the inputs held over the step before it")
    return notes


def _late_note(system: SystemStructure, treatment: Treatment, name: str, targets: dict[str, list[str]]) -> str:
    fmu = system.fmus[name]
    between = treatment.exact and fmu.has_event_mode and name not in system.without_event_mode
    declared = [output for output in targets if fmu.declares_inputs_of(output)]
    condition = "" if declared else f"where it follows an input at once (which {fmu.name} does not declare), "
    what = _listed([f"{output} to {', '.join(targets[output])}" for output in declared or targets])
    return (
        f"{name}: {condition}{what} is a step late{' between events' if between else ''}, since FMI allows no reading between set "
        f"and step: take smaller steps or algorithm='gauss_seidel', or system.read_after_set({name!r}) if it is known to allow it"
    )


def _listed(items: list[str], most: int = 4) -> str:
    more = f" and {len(items) - most} more" if len(items) > most else ""
    return "; ".join(items[:most]) + more


def system_notes(system: SystemStructure) -> tuple[str, ...]:
    """Notes on FMUs whose descriptions have findings, and on all open inputs."""
    return (*_description_notes(system), *_open_input_notes(system))


def _description_notes(system: SystemStructure) -> list[str]:
    fmus = {fmu.digest: fmu for fmu in system.fmus.values() if fmu.findings}
    notes = []
    for fmu in fmus.values():
        first = " ".join(fmu.findings[0].split())
        first = first if len(first) <= _LONGEST else f"{first[:_LONGEST]}..."
        count = f"{len(fmu.findings)} findings, the first: " if len(fmu.findings) > 1 else ""
        notes.append(f"{fmu.name} deviates from the standard, but can be run ('shaper-fmu check' lists all): {count}{first}")
    return notes


def _open_input_notes(system: SystemStructure) -> list[str]:
    fed = {*system.connections, *system.signals}
    names = [
        f"{name}.{variable.name}"
        for name, fmu in system.fmus.items()
        for variable in fmu.variables.values()
        if variable.causality == "input"
        and (name, variable.name) not in fed
        and variable.name not in system.start_values[name]
        and kind_of(variable) in TRANSFERABLE
    ]
    if not names:
        return []
    return [f"nothing feeds {_listed(names)}: left at the FMU's own start value"]
