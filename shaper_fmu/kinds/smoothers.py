"""All smoothers: the enumeration, and functions that dispatch to the smoother of a kind; generated from the methods' records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from shaper_fmu.methods.discovery import find_methods
from shaper_fmu.methods.dispatch import module_text, run_text
from shaper_fmu.methods.record import Question
from shaper_fmu.smoothers.method import SmootherMethod
from shaper_fmu.smoothers.workspace import SmootherWorkspace

RESERVED = {"none": 1}
"""The item that is no method: the command is left alone."""

_QUESTIONS = (Question("terms_of", "kind, m, damping_ratio", "kernel", "0", "The kernel of this kind; see SmootherMethod.kernel."),)
_HOST = (("shaper_fmu.commands.smooth_shaper",), SmootherWorkspace)
_found = find_methods("shaper_fmu.smoothers", "shaper_fmu.smoothers", SmootherMethod, _QUESTIONS, _HOST, RESERVED)

SMOOTHERS = {one.record.name: one.record for one in _found}
"""The methods' records by name, by rising number."""
PACKED_SOURCE = module_text(
    "Smoother",
    RESERVED,
    _found,
    _QUESTIONS,
    {
        "LIST": ";\n    ".join(record.item for record in SMOOTHERS.values()),
    },
)
"""What this module becomes, and is in an FMU that carries Python."""
run_text(PACKED_SOURCE, globals())

if TYPE_CHECKING:
    from collections.abc import Mapping
    from enum import IntEnum

    from shaper_fmu.component import Variable

    class Smoother(IntEnum):
        none = 1
        dzv = 2
        dzvd = 3
        ramped_zv = 4
        ramped_zvd = 5
        smoother = 6

    PARAMETERS: Mapping[str, Variable[Any]]
    FURTHER_PARAMETERS: Mapping[str, Variable[Any]]
    LIST: str

    def terms_of(kind: int, m: SmootherWorkspace, damping_ratio: float) -> int: ...
