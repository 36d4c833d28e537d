"""The runs of a sweep: what is to be done, how it ended, and how the store has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec

from shaper_fmu.sweep.plan import Value


class Task(msgspec.Struct, frozen=True, gc=False):
    """A run to be done: its number, the case, and the varied values in the study's order."""

    id: int
    compared: str
    values: tuple[Value, ...]
    attempts: int = 0


class Outcome(msgspec.Struct, frozen=True, gc=False):
    """The outcome of a run: metrics in the study's order if it is done, otherwise the reason.

    `seconds` is how long it took; short runs that were done together share their time evenly.
    """

    id: int
    metrics: tuple[float, ...] | None
    reason: str | None
    seconds: float
    attempts: int = 1


@dataclass(frozen=True)
class Run:
    """One run as the store has it."""

    id: int
    compared: str
    varied: dict[str, Any]
    status: str
    metrics: dict[str, float]
    reason: str | None
    seconds: float | None = None
    attempts: int = 0
