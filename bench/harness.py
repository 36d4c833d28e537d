"""What the benchmarks share: a pair's row, the interleaving of two measurements, and their comparison."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

REPETITIONS = 7


@dataclass(frozen=True)
class Measured:
    """One measurement: microseconds per step, and the numbers that have to agree with those of the peer."""

    microseconds: float
    results: tuple[float, ...]


@dataclass(frozen=True)
class Row:
    """A benchmark's outcome in microseconds per step.

    Attributes:
        peer: None where there is no peer, or where it cannot be measured here.
        needed: least ratio peer / ours, 0 for none.
        note: why there is no peer.
    """

    name: str
    ours: float
    peer: float | None = None
    needed: float = 0.0
    note: str = ""

    @property
    def ratio(self) -> float | None:
        """How many times longer the peer takes."""
        return None if self.peer is None else self.peer / self.ours

    @property
    def entry(self) -> dict[str, float | str | None]:
        """What results.json tells."""
        return {"ours": self.ours, "peer": self.peer, "unit": "us", "ratio": self.ratio}


def compared(
    name: str, turns: Callable[[], Sequence[Measured]], tolerance: float, needed: float = 0.0, repetitions: int = REPETITIONS
) -> Row:
    """Medians over repetitions of `turns`, which measures ours and the peer in turn.

    Ends the program if their results differ by more than `tolerance` (absolute below 1, relative above).
    """
    runs = []
    for _ in range(repetitions):
        ours, peer = turns()
        for a, b in zip(ours.results, peer.results, strict=True):
            if not abs(a - b) <= tolerance * max(1.0, abs(b)):
                raise SystemExit(f"{name}: the results differ: {ours.results} and {peer.results}, tolerance {tolerance:g}")
        runs.append((ours.microseconds, peer.microseconds))
    return Row(name, median(ours for ours, _ in runs), median(peer for _, peer in runs), needed)


def alone(name: str, turns: Callable[[], Sequence[Measured]], note: str = "") -> Row:
    """The median of one that has no peer."""
    return Row(name, median(turns()[0].microseconds for _ in range(REPETITIONS)), note=note)
