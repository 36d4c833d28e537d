"""All shapers: the enumeration, and functions that dispatch to the shaper of a kind; generated from the methods' records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shaper_fmu.methods.discovery import find_methods
from shaper_fmu.methods.dispatch import module_text, run_text
from shaper_fmu.methods.record import Question
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.workspace import DesignWorkspace

RESERVED = {"none": 1, "custom": 13}
"""Items that are no methods: InputShaper itself leaves the command alone, and takes the user's impulses."""

_QUESTIONS = (
    Question("impulses_of", "kind, m, damping_ratio", "impulses", "0", "The sequence of this kind; see ShaperMethod.impulses."),
    Question("is_solved", "kind", "solved", "False", "Whether this kind solves equations."),
)
_HOST = (("shaper_fmu.commands.input_shaper", "shaper_fmu.commands.limited_shaper"), DesignWorkspace)
_found = find_methods("shaper_fmu.shapers", "shaper_fmu.shapers", ShaperMethod, _QUESTIONS, _HOST, RESERVED)
_solved = [name for one in _found if one.record.solved for name in one.record.parameters]

SHAPERS = {one.record.name: one.record for one in _found}
"""The methods' records by name, by rising number."""
PACKED_SOURCE = module_text(
    "Shaper",
    RESERVED,
    _found,
    _QUESTIONS,
    {
        "LIST": ";\n    ".join(record.item for record in SHAPERS.values()),
        "SOLVED_WITH": tuple(dict.fromkeys(["vibration_tolerance", *_solved])),
    },
)
"""What this module becomes, and is in an FMU that carries Python."""
run_text(PACKED_SOURCE, globals())

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import IntEnum

    from shaper_fmu.component import Variable

    class Shaper(IntEnum):
        none = 1
        zv = 2
        custom = 13

    PARAMETERS: Mapping[str, Variable[Any]]
    FURTHER_PARAMETERS: Mapping[str, Variable[Any]]
    LIST: str
    SOLVED_WITH: tuple[str, ...]

    def impulses_of(kind: int, m: DesignWorkspace, damping_ratio: float) -> int: ...

    def is_solved(kind: int) -> bool: ...
