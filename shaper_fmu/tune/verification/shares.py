"""Shares of the unshaped vibration that a shaper leaves, and by how much two measurements of them differ."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

QUIET = 1e-9
"""Share of the liveliest output's residual below which an output does not vibrate."""
_FIRST_ORDER = 0.4, 0.6
"""Change by halving the step, over the change before, of a solver of the first order: what remains is as much again."""


@dataclass(frozen=True)
class Measured:
    """Residuals at one set of parameters.

    Attributes:
        values: of the parameters that were varied, by name.
        before, after: residual of each output without and with the shaper, in its unit.
        share: the largest after / before, of the outputs that vibrate.
        rest: the same without a step; all but 0 for a plant at rest.
        doubt: what noise may hide of the share.
    """

    values: Mapping[str, float]
    before: tuple[float, ...]
    after: tuple[float, ...]
    share: float
    rest: tuple[float, ...] = ()
    doubt: float = 0.0

    @property
    def shares(self) -> list[float]:
        """after / before of each output; 0 for one that does not vibrate."""
        least = QUIET * max(self.before)
        return [b / a if a > least else 0.0 for a, b in zip(self.before, self.after, strict=True)]


def is_first_order(changes: Sequence[float]) -> bool:
    """Whether each change is about half the one before: of a solver of the first order."""
    low, high = _FIRST_ORDER
    return all(low * a <= b <= high * a for a, b in itertools.pairwise(changes))


def unshaped_moved(coarse: Measured, fine: Measured) -> float:
    """The largest relative change of an output's residual after the unshaped command."""
    pairs = [(a, b) for a, b in zip(coarse.before, fine.before, strict=True) if b > QUIET * max(fine.before)]
    return max((abs(b - a) / b for a, b in pairs), default=0.0)


def moved(coarse: Measured, fine: Measured) -> float:
    """By how much an output's residuals have changed, in what each change alone makes of the share; of the worst output."""
    least = QUIET * max(fine.before)
    changes = (
        abs(fine_after - after) / fine_before + fine_after / fine_before * abs(fine_before - before) / fine_before
        for before, fine_before, after, fine_after in zip(coarse.before, fine.before, coarse.after, fine.after, strict=True)
        if fine_before > least
    )
    return max(changes, default=0.0)
