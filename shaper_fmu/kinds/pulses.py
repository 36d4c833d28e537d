"""All pulse designs: the enumeration, and functions that dispatch to a kind's design; generated from the methods' records."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shaper_fmu.methods.discovery import find_methods
from shaper_fmu.methods.dispatch import module_text, run_text
from shaper_fmu.methods.record import Question
from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.workspace import PulseWorkspace

_QUESTIONS = (
    Question("switches_of", "kind, m, room", "switches", "0", "The switches of this kind; see PulseMethod.switches."),
    Question("reference_of", "kind, m, s", "reference", "1.0", "What the carrier modulates at s."),
    Question("jumps_at_start", "kind", "jumps_at_start", "True", "Whether the reference jumps at the start."),
    Question("jumps_at_end", "kind", "jumps_at_end", "False", "Whether the reference jumps at the end of the travel."),
    Question("keeps_width", "kind", "keeps_width", "False", "Whether it heeds the least width itself."),
)
_HOST = (("shaper_fmu.commands.pulse_train",), PulseWorkspace)
_found = find_methods("shaper_fmu.pulses", "shaper_fmu.pulse_designs", PulseMethod, _QUESTIONS, _HOST)

PULSES = {one.record.name: one.record for one in _found}
"""The methods' records by name, by rising number."""
_timed = [name for name, record in PULSES.items() if record.timed]
PACKED_SOURCE = module_text(
    "Design",
    {},
    _found,
    _QUESTIONS,
    {
        "LIST": ";\n    ".join(record.item for record in PULSES.values()),
        "TIMED": f"{', '.join(_timed[:-1])} and {_timed[-1]}",
        "FAILURES": {record.number: record.failure for record in PULSES.values()},
    },
)
"""What this module becomes, and is in an FMU that carries Python."""
run_text(PACKED_SOURCE, globals())

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import IntEnum
    from typing import Any

    from shaper_fmu.component import Variable

    class Design(IntEnum):
        carrier = 1
        carrier_polished = 2
        minimax = 3
        um_zv = 4
        um_zvd = 5
        zv_carrier = 6

    PARAMETERS: Mapping[str, Variable[Any]]
    FURTHER_PARAMETERS: Mapping[str, Variable[Any]]
    LIST: str
    TIMED: str
    FAILURES: Mapping[int, str]

    def switches_of(kind: int, m: PulseWorkspace, room: int) -> int: ...

    def reference_of(kind: int, m: PulseWorkspace, s: float) -> float: ...

    def jumps_at_start(kind: int) -> bool: ...

    def jumps_at_end(kind: int) -> bool: ...

    def keeps_width(kind: int) -> bool: ...
