"""The errors of this package, and the suggestion of the nearest known name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class ShaperFmuError(Exception):
    """Base of every error that shaper-fmu raises on purpose; its text is meant for the user."""


class UsageError(ShaperFmuError):
    """A name that the caller gave does not exist, and its file is not at fault; a command exits with 2."""


class ComponentError(ShaperFmuError):
    """A component is declared wrongly, or was given a value or a sequence of calls that it cannot serve."""


class ArgumentError(ComponentError, ValueError):
    """A function was given a value outside of its domain, of another kind or shape, or values that do not go together."""


class NoSolutionError(ComponentError):
    """The values are within their domains, but no command was found that does what they ask for."""


class BuildError(ShaperFmuError):
    """An FMU or an SSP archive cannot be built."""


class ArchiveError(ShaperFmuError):
    """An FMU or SSP archive is missing, damaged or hostile."""


class NotInArchiveError(ArchiveError, UsageError):
    """An archive has no variant or parameter set of the name that is asked for."""


class ModelError(ShaperFmuError):
    """A system is wired wrongly; `problems` lists every finding."""

    def __init__(self, problems: list[str]):
        super().__init__("\n".join(problems))
        self.problems = problems


class SimulationError(ShaperFmuError):
    """A run stopped; the message names the FMU, the time and the FMU's own message.

    Attributes:
        results: what was recorded until then, as `Results`; None if the initialization failed.
    """

    results: Any = None  # every exported FMU carries this module, so it imports nothing of the master's


class StudyError(ShaperFmuError):
    """A study file, or the store of a sweep, cannot be used."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint that names the known name nearest to `name`, or lists the known names; begins with a space or is empty."""
    known = list(known)
    by_folded = {candidate.casefold(): candidate for candidate in known}
    match = difflib.get_close_matches(name.casefold(), by_folded, n=1, cutoff=0.5)
    if match:
        return f" Did you mean {by_folded[match[0]]!r}?"
    if not known:
        return ""
    shown = ", ".join(known[:12]) + (", ..." if len(known) > 12 else "")
    return f" Known: {shown}."
