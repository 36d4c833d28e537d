"""Finds the records of methods: in the files of a package, and in the modules that entry points name."""

from __future__ import annotations

import importlib
import keyword
import pkgutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from types import ModuleType
from typing import Generic, TypeVar

from shaper_fmu.errors import ComponentError
from shaper_fmu.methods.record import FIRST_FOREIGN, Method

M = TypeVar("M", bound=Method)


@dataclass(frozen=True)
class Found(Generic[M]):
    """A record, and where it is: the name of its module, and its own name there."""

    record: M
    module: str
    attribute: str


def find_methods(package: str, group: str, kind: type[M], reserved: Mapping[str, int]) -> list[Found[M]]:
    """All methods of a kind by rising number: those in the modules of `package`, and those that entry points of `group` name.

    `reserved` are items of the enumeration that are no methods. Raises
    ComponentError for a module that cannot be loaded, and for names and numbers that are used twice.
    """
    own = [one for module in modules_of(package) for one in _records(module, kind)]
    foreign = [one for module in announced_modules(group) for one in _records(module, kind)]
    methods = {id(one.record): one for one in reversed([*own, *foreign])}  # once each, where it was found first
    found = sorted(methods.values(), key=lambda one: one.record.number)
    own_records = {id(one.record) for one in own}
    for one in found:
        _check(one.record, one.module, id(one.record) not in own_records)
    taken = [(name, number, package) for name, number in reserved.items()]
    for name, number, where in [*taken, *((one.record.name, one.record.number, one.module) for one in found)]:
        for other, its_number, place in taken:
            if (other, its_number, place) != (name, number, where) and (other == name or its_number == number):
                raise ComponentError(f"{package}: {name} = {number} in {where} and {other} = {its_number} in {place} are one item")
        taken.append((name, number, where))
    return found


def modules_of(package: str) -> Iterator[ModuleType]:
    """The modules in a package's folder."""
    for entry in pkgutil.iter_modules(importlib.import_module(package).__path__, f"{package}."):
        yield importlib.import_module(entry.name)


def announced_modules(group: str) -> Iterator[ModuleType]:
    """The modules that entry points of a group name. Raises ComponentError for one that cannot be loaded."""
    for point in sorted(entry_points(group=group), key=lambda p: (p.name, p.value)):
        try:
            yield importlib.import_module(point.module)
        except Exception as error:
            raise ComponentError(f"entry point {point.name} = {point.value} of {group} cannot be loaded: {error}") from error


def _records(module: ModuleType, kind: type[M]) -> Iterable[Found[M]]:
    return [Found(value, module.__name__, name) for name, value in vars(module).items() if isinstance(value, kind)]


def _check(record: Method, module: str, foreign: bool) -> None:
    name, number = record.name, record.number
    if not name.isidentifier() or keyword.iskeyword(name):
        raise ComponentError(f"{module}: the name {name!r} must be one word of letters, digits and underscores")
    if foreign and number < FIRST_FOREIGN:
        raise ComponentError(f"{module}: {name} = {number}; numbers below {FIRST_FOREIGN} are kept for shaper-fmu itself")
