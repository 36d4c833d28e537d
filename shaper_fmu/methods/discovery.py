"""Finds the records of methods: in the files of a package, and in the modules that entry points name."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import keyword
import pkgutil
from collections.abc import Collection, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any, Generic, TypeVar

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ComponentError
from shaper_fmu.methods.announced import announced, leave_out
from shaper_fmu.methods.record import FIRST_FOREIGN, Found, Method, Question
from shaper_fmu.syntax import parse

M = TypeVar("M", bound=Method)


def find_methods(
    package: str,
    group: str,
    kind: type[M],
    questions: Collection[Question],
    host: tuple[Sequence[str], type[Component]],
    reserved: Mapping[str, int] | None = None,
) -> list[Found[M]]:
    """All methods of a kind by rising number: those in the modules of `package`, and those that entry points of `group` name.

    `host` are the components whose parameters theirs become: their modules, which import what is found here, and their base.
    `reserved` are items of the enumeration that are no methods. Raises ComponentError for a method of shaper-fmu's own that
    cannot be used; another package's is left out with a warning.
    """
    declared = set[str]().union(*map(declared_names, host[0]))
    known = _Known(package, questions, declared | set(dir(host[1])), reserved or {})
    for module in modules_of(package):
        for one in _records(module, kind):
            known.add(one, foreign=False)
    for point, module, target in announced(group):
        records = _records(module, kind) if inspect.ismodule(target) or isinstance(target, kind) else []
        if not records:
            leave_out(point, f"it names no {kind.__name__}, and no module with one")
        for one in records:
            try:
                known.add(one, foreign=True)
            except ComponentError as error:
                leave_out(point, error)
    return sorted(known.found.values(), key=lambda one: one.record.number)


def modules_of(package: str) -> Iterator[ModuleType]:
    """The modules in a package's folder."""
    for entry in pkgutil.iter_modules(importlib.import_module(package).__path__, f"{package}."):
        yield importlib.import_module(entry.name)


def declared_names(module: str) -> set[str]:
    """The names that the classes in a module's source declare, without loading it."""
    spec = importlib.util.find_spec(module)
    source = spec.loader.get_source(module) if spec and spec.loader else None  # pyright: ignore[reportAttributeAccessIssue]
    bodies = [statement.body for statement in parse(source or "").body if isinstance(statement, ast.ClassDef)]
    statements = [statement for body in bodies for statement in body]
    targets = [target for statement in statements if isinstance(statement, ast.Assign) for target in statement.targets]
    targets += [statement.target for statement in statements if isinstance(statement, ast.AnnAssign)]
    return {target.id for target in targets if isinstance(target, ast.Name)}


def _records(module: ModuleType, kind: type[M]) -> list[Found[M]]:
    return [Found(value, module.__name__, name) for name, value in vars(module).items() if isinstance(value, kind)]


class _Known(Generic[M]):
    """The methods found so far; each is checked against the others."""

    def __init__(self, package: str, questions: Collection[Question], variables: set[str], reserved: Mapping[str, int]):
        self.package, self.questions, self.variables = package, questions, variables
        self.found: dict[int, Found[M]] = {}
        """By the identity of the record: once each, where it was found first."""
        self.items = [(name, number, package) for name, number in reserved.items()]
        self.parameters: dict[str, Variable[Any]] = {}

    def add(self, one: Found[M], foreign: bool) -> None:
        """Take a method in. Raises ComponentError for one that cannot be used beside the others."""
        if id(one.record) in self.found:
            return
        self._check_item(one, foreign)
        for name, variable in one.record.parameters.items():
            self._check_parameter(one, name, variable)
        for question in self.questions:
            question.asked_of(one)
        self.items.append((one.record.name, one.record.number, one.module))
        self.parameters |= one.record.parameters
        self.found[id(one.record)] = one

    def _check_item(self, one: Found[M], foreign: bool) -> None:
        name, number, where = one.record.name, one.record.number, one.module
        if not _is_word(name):
            raise ComponentError(f"{where}: the name {name!r} must be one word of letters, digits and underscores")
        if type(number) is not int or not 0 < number < 2**31:
            raise ComponentError(f"{where}: {name} = {number!r}; the number must be a whole one from 1 to 2147483647")
        if foreign and number < FIRST_FOREIGN:
            raise ComponentError(f"{where}: {name} = {number}; numbers below {FIRST_FOREIGN} are kept for shaper-fmu itself")
        for other, its_number, place in self.items:
            if other == name or its_number == number:
                raise ComponentError(
                    f"{self.package}: {name} = {number} in {where} and {other} = {its_number} in {place} are one item"
                )

    def _check_parameter(self, one: Found[M], name: str, variable: Variable[Any]) -> None:
        if not _is_word(name):
            raise ComponentError(f"{one.module}: the parameter {name!r} must be one word of letters, digits and underscores")
        if name in self.variables:
            raise ComponentError(f"{one.module}: the component has a variable {name!r}; a method's parameter needs another name")
        if self.parameters.get(name, variable) is not variable:
            raise ComponentError(f"{one.module}: another method has a parameter {name!r}, too; share it, or call it otherwise")


def _is_word(name: object) -> bool:
    return isinstance(name, str) and name.isidentifier() and not keyword.iskeyword(name)
