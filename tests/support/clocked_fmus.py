"""FMUs with clocks of FMI 3.0 (see fmus/clocked3.c): their model descriptions, for each kind of clock."""

from __future__ import annotations

import hashlib
import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
from faulty_fmus import library

KINDS = {"constant": 0, "fixed": 1, "calculated": 1, "tunable": 2, "changing": 3, "countdown": 4}
_FAULTS = "none not_known not_a_number zero negative set_fails get_fails interval_fails shift_fails odd_qualifier"
FAULTS = {name: number for number, name in enumerate(_FAULTS.split())}  # as in clocked3.c
_REALS = {  # name -> value reference, causality, variability, clock
    "u": (10, "input", "discrete", 1), "y": (11, "output", "discrete", 1), "last": (12, "output", "discrete", 0),
    "v": (13, "output", "discrete", 3), "w": (14, "input", "discrete", 2), "z": (15, "output", "discrete", 2),
    "interval": (16, "parameter", "fixed", 0), "shift": (17, "parameter", "fixed", 0), "period": (18, "parameter", "fixed", 0),
    "held": (19, "output", "discrete", 0),
}  # fmt: skip
_INTEGERS = {
    "count": (40, "output", "discrete", 0), "every": (41, "parameter", "fixed", 0), "heard": (42, "output", "discrete", 0),
    "kind": (43, "parameter", "fixed", 0), "fault": (44, "parameter", "fixed", 0),
}  # fmt: skip
_STARTS = {"interval": "0.1", "period": "1e300", "every": "1"}
_DEPENDS = {"y": (1, 10), "v": (3,), "z": (2, 14), "last": (1,), "held": (1,), "count": (1,), "heard": (2,)}


def _variable(kind: str, name: str, reference: int, causality: str, variability: str, clock: int) -> str:
    start = f' start="{_STARTS.get(name, 0)}"' if causality != "output" else ""
    clocks = f' clocks="{clock}"' if clock else ""
    return (
        f'<{kind} name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}"{start}{clocks}/>'
    )


def _description(clock: str, trig: bool, declared: bool, interface: str) -> str:
    clocks = {
        1: f'<Clock name="c" valueReference="1" causality="input" {clock}/>' if clock else "",
        2: '<Clock name="trig" valueReference="2" causality="input" intervalVariability="triggered"/>' if trig else "",
        3: '<Clock name="out" valueReference="3" causality="output" intervalVariability="triggered" clocks="1"/>' if clock else "",
    }
    there = {0, *(number for number, element in clocks.items() if element)}
    everything = {"Float64": _REALS, "Int32": _INTEGERS}
    chosen = [(kind, name, rest) for kind, part in everything.items() for name, rest in part.items() if rest[3] in there]
    variables = "".join(_variable(kind, name, *rest) for kind, name, rest in chosen)
    structure = '<Output valueReference="3" dependencies="1"/>' if clock else ""
    for _, name, rest in chosen:
        if rest[1] == "output":
            known = [reference for reference in _DEPENDS[name] if reference >= 10 or reference in there]
            told = f' dependencies="{" ".join(map(str, known))}"' if declared else ""
            structure += f'<Output valueReference="{rest[0]}"{told}/>'
    structure += "".join(f'<InitialUnknown valueReference="{r[0]}"/>' for _, _, r in chosen if r[1] == "output" and not r[3])
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<fmiModelDescription fmiVersion="3.0" modelName="clocked" instantiationToken="{{clocked}}">{interface}<ModelVariables>'
        '<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>'
        f"{''.join(clocks.values())}{variables}</ModelVariables><ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


@lru_cache
def clocked_fmu(
    clock: str = "", *, trig: bool = False, free: bool = True, event_mode: bool = True, declared: bool = True, interface: str = ""
) -> Path:
    """The FMU with the attributes `clock` of its clock `c`, such as 'intervalVariability="constant" intervalDecimal="0.1"'.

    Without them it has the triggered clock `trig` alone. `free`: it takes steps of any length. `declared`: dependencies are told.
    """
    made = library("clocked3")
    flags = f'hasEventMode="{str(event_mode).lower()}" canHandleVariableCommunicationStepSize="{str(free).lower()}"'
    interface = interface or f'<CoSimulation modelIdentifier="clocked" canGetAndSetFMUState="true" {flags}/>'
    text = _description(clock, trig or not clock, declared, interface)
    path = made.with_name(f"clocked_{hashlib.sha256(text.encode()).hexdigest()[:16]}.fmu")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{fmpy.platform_tuple}/clocked{fmpy.sharedLibraryExtension}")
    return path


def constant(interval: float, shift: float = 0.0) -> str:
    """The attributes of a constant clock."""
    return f'intervalVariability="constant" intervalDecimal="{interval!r}" shiftDecimal="{shift!r}"'


def of_kind(kind: str, fraction: bool = False) -> str:
    """The attributes of a clock that is asked for its intervals."""
    return f'intervalVariability="{kind}" supportsFraction="{str(fraction).lower()}"'
