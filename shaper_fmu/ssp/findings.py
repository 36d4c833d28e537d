"""The findings of an archive: message, file and line, and their weight."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from enum import IntEnum

from shaper_fmu.renamed import warn_renamed

Key = tuple[str, int, str]
"""File, line (0: the file as a whole) and message."""


class Weight(IntEnum):
    """The consequence of a finding."""

    DEVIATION = 0
    """It is not as the standard wants it, but does not stop a run, nor is anything ignored."""
    NOTE = 1
    """Something has no effect, or is not as it seems: each run notes it."""
    RUN = 2
    """The system can be read, but not be run as it is."""
    LOAD = 3
    """The system cannot be read."""


@dataclass(frozen=True)
class Finding:
    """One finding."""

    file: str
    line: int
    message: str
    weight: Weight

    @property
    def words(self) -> str:
        """The old name of `message`."""
        warn_renamed("Finding.words", "message")
        return self.message

    @property
    def stops(self) -> bool:
        """Whether it stops a run."""
        return self.weight >= Weight.RUN

    def __str__(self) -> str:
        if not self.file:
            return self.message
        return f"{self.file}, line {self.line}: {self.message}" if self.line else f"{self.file}: {self.message}"


@dataclass
class Findings:
    """All findings, each once, with its highest weight; `lost` are (file, line) whose meaning could not be read."""

    lost: set[tuple[str, int]] = field(default_factory=set)
    _weights: dict[Key, Weight] = field(default_factory=dict)

    def report(self, file: str, line: int, message: str, weight: Weight) -> Key:
        """Add a finding, unless the meaning of its line is lost, which is reported already."""
        key = file, line, message
        if (file, line) not in self.lost:
            self._weights[key] = max(weight, self._weights.get(key, weight))
        return key

    def weigh(self, keys: Iterable[Key], weight: Weight) -> None:
        """Make findings graver, which may be those of other findings."""
        for file, line, message in keys:
            self.report(file, line, message, weight)

    def add(self, others: Iterable[Finding], at_most: Weight = Weight.LOAD) -> None:
        """Take over findings, as far as they are not here."""
        for one in others:
            key, weight = (one.file, one.line, one.message), min(one.weight, at_most)
            self._weights[key] = max(weight, self._weights.get(key, weight))

    def __iter__(self) -> Iterator[Finding]:
        return (Finding(*key, weight) for key, weight in self._weights.items())

    def texts(self, weight: Weight, upto: Weight = Weight.LOAD) -> list[str]:
        """Findings of this weight, or from one weight up to another, as texts, sorted by file and line."""
        found = sorted((one for one in self if weight <= one.weight <= upto), key=lambda one: (one.file, one.line))
        return [str(one) for one in found]
