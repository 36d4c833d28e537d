"""The common part of every method's record."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from types import FunctionType
from typing import Any, Generic, TypeVar

from shaper_fmu.component import Variable
from shaper_fmu.errors import ComponentError

FIRST_FOREIGN = 100
"""Numbers below belong to shaper-fmu's own methods, so that those to come take none of another package's."""


@dataclass(frozen=True, kw_only=True)
class Method:
    """Base class of the records.

    Attributes:
        name: in the enumeration, as users write it.
        number: in the enumeration; it is in people's files and never changes. Other packages begin with 100.
        summary: what it is, in a line: for the documentation's tables and the FMU's page.
        paper: where it comes from, such as "Smith 1958".
        title: its usual name, "ZVD"; without one, the name without underscores.
        parameters: parameters of its own, by name, which become the component's.
    """

    name: str
    number: int
    summary: str
    paper: str = ""
    title: str = ""
    parameters: Mapping[str, Variable[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, variable in self.parameters.items():
            if (
                variable.causality != "parameter"
                or variable.size is not None
                or variable.kind not in (float, int)
                or variable.tunable
            ):
                raise ComponentError(f"{self.name}: {name} must be a Parameter: a single number, real or whole, and not tunable")

    @property
    def label(self) -> str:
        """Its usual name."""
        return self.title or self.name.replace("_", " ")

    @property
    def described(self) -> str:
        """Summary and paper."""
        return self.summary + (f" ({self.paper})" if self.paper else "")

    @property
    def item(self) -> str:
        """An item of a list: its name and its summary."""
        return f"- {self.name}: {self.described}"


M = TypeVar("M", bound=Method)


@dataclass(frozen=True)
class Found(Generic[M]):
    """A record, and where it is: the name of its module, and its own name there."""

    record: M
    module: str
    attribute: str


@dataclass(frozen=True)
class Question:
    """A function to generate: `name`(`arguments`) returns the method's `field`, or `otherwise` if that is None."""

    name: str
    arguments: str
    field: str
    otherwise: str
    summary: str

    def asked_of(self, one: Found[Any]) -> list[str] | None:
        """The arguments for which a method's function asks, None where the answer is no function.

        Raises ComponentError for a function that kernels cannot call, and for no function where there must be one.
        """
        answer, where = getattr(one.record, self.field), f"{one.module}: {self.field} of {one.record.name}"
        needed = any(known.name == self.field and known.default is MISSING for known in fields(one.record))
        if not needed and not callable(answer):
            if answer is not None and type(answer) not in (bool, int, float):
                raise ComponentError(f"{where} is {answer!r:.60}; it must be a number, true or false")
            return None
        if not isinstance(answer, FunctionType) or getattr(sys.modules[answer.__module__], answer.__name__, None) is not answer:
            raise ComponentError(f"{where} must be a plain function at the top of its module")
        known = [name.strip() for name in self.arguments.split(",") if name.strip() != "kind"]
        wanted = list(inspect.signature(answer).parameters)
        for name in wanted:
            if name not in known:
                raise ComponentError(f"{where} asks for {name!r}; it may ask for {', '.join(known)}")
        return wanted


def declare(body: dict[str, Any], parameters: Mapping[str, Variable[Any]]) -> None:
    """Declare methods' parameters among the variables in the body of a component's class, `body` = locals()."""
    for name, variable in parameters.items():
        if name in body:
            raise ComponentError(f"{body['__qualname__']} has a variable {name!r}; a method's parameter needs another name")
        body[name] = variable
