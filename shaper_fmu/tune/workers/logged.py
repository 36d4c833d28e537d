"""What a worker process writes down of its work, so that the caller can count it in the order of a tuning without workers."""

from __future__ import annotations

from dataclasses import dataclass

from shaper_fmu.tune.meter import Budget, BudgetError, Entry, Meter, Part


class LoggedMeter(Meter):
    """A meter that keeps what it was asked and told, for `Meter.replay`.

    Attributes:
        log: in its order.
        refused: whether its budget did not allow something.
    """

    def __init__(self, budget: Budget):
        super().__init__(budget)
        self.log: list[Entry] = []
        self.refused: bool = False

    def allow(self, steps: float, what: str = "the next run") -> None:
        """See `Meter`."""
        self.log.append(Entry(None, steps, 0.0, what))
        try:
            super().allow(steps, what)
        except BudgetError:
            self.refused = True
            raise

    def add(self, steps: int, stepping: float = 0.0) -> None:
        """See `Meter`."""
        if self.at_work is not None:
            self.log.append(Entry(self.at_work, steps, stepping, ""))
        super().add(steps, stepping)

    def times(self) -> dict[Part, float]:
        """Wall time of each part [s]."""
        return {name: one.seconds for name, one in self.efforts.items()}


@dataclass(frozen=True)
class Done:
    """What has become of a call.

    Attributes:
        result: of the function; None where it has raised an error.
        error: which, in words; "" for none.
        log: see `LoggedMeter`.
        times: of each part of the work [s].
        refused: whether its share of the budget was too small.
        longest_step: `Plant.longest_step` before and after it [s].
        runs: keys of the plant's runs that it has made.
        ended: how its process has ended, where an FMU has ended it; "" if not.
    """

    result: object = None
    error: str = ""
    log: tuple[Entry, ...] = ()
    times: tuple[tuple[Part, float], ...] = ()
    refused: bool = False
    longest_step: tuple[float, float] = (0.0, 0.0)
    runs: tuple[str, ...] = ()
    ended: str = ""
