"""Instances that are made later, by a container: what the master's Program asks of an instance, without a library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.instance import EventInfo, Instance

_FUNCTION, _HANDLE = 1 << 62, 1 << 61  # no address is as large
_SYMBOLS = 1 << 20


class Symbols:
    """The names of the functions that a system calls, each with a number."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def number(self, name: str) -> int:
        """The function's number."""
        return self._numbers.setdefault(name, len(self._numbers))

    @property
    def names(self) -> list[str]:
        """The names by number."""
        return list(self._numbers)


class PlannedInstance(Instance):
    """An instance of which everything is known but its addresses, which are numbers that stand for them here."""

    def __init__(self, number: int, name: str, fmu: Fmu, event_mode: bool, values: Mapping[str, Any], symbols: Symbols):
        self.name: str = name
        self.fmu: Fmu = fmu
        self.event_mode: bool = event_mode and fmu.has_event_mode
        self.initialized: bool = False
        self.event_info: EventInfo | None = None
        self.symbols: Symbols = symbols
        self._number, self._values = number, values

    def address(self, function: str) -> int:
        """A number for a function of its library."""
        return _FUNCTION + self._number * _SYMBOLS + self.symbols.number(function)

    @property
    def handle(self) -> int:
        """A number for what its functions are given."""
        return _HANDLE + self._number

    def start_value(self, name: str) -> float | int | bool:
        """The value that an element is set to before its initialization, or its start value."""
        return self._values[name] if name in self._values else super().start_value(name)

    @property
    def _arrays(self) -> dict[Any, Any]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return {}


def function_of(number: int) -> tuple[int, int] | None:
    """The instance and the function that a number stands for; None if it stands for none."""
    return divmod(number - _FUNCTION, _SYMBOLS) if number >= _FUNCTION else None


def instance_of(number: int) -> int | None:
    """The instance that a number stands for; None if it stands for none."""
    return number - _HANDLE if _HANDLE <= number < _FUNCTION else None
