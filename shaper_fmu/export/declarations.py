"""Checks a component's declarations before a build, and reports everything that an FMU cannot represent."""

from __future__ import annotations

import enum
import keyword
import math
import re
from collections.abc import Iterator
from typing import Any

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import BuildError, nearest

INTEGERS = (-(2**31), 2**31 - 1)
"""FMI 2.0's Integer, FMI 3.0's Int32, a C int: for start values, bounds, items and status numbers."""
MOST_VARIABLES = 65535
ABOUT = ("author", "version", "copyright", "license")
"""What a component may tell about itself beside its docstring."""
LONGEST_NAME = 128
"""Letters of a component's name: files are called so, with digests, and some file systems end at 255."""

_NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_DEVICES = re.compile(r"(?:con|prn|aux|nul|com\d|lpt\d)$", re.IGNORECASE)
_C_KEYWORDS = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|restrict"
    "|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while"
)


def check_declaration(component: type[Component]) -> None:
    """Raise BuildError that lists everything that is wrong with a component's declaration, each with value and limit."""
    found = [*_of_name(component.__name__), *_of_class(component), *_of_messages(component)]
    for variable in component.variables.values():
        found += [f"{variable.causality} {variable.name!r}: {problem}" for problem in _of_variable(variable)]
    found += _of_enumerations(component)
    if found:
        raise BuildError("\n".join(f"{component.__name__[:LONGEST_NAME]}: {problem}" for problem in found))


def _of_name(name: str) -> Iterator[str]:
    if not (name.isascii() and name.isidentifier()):
        yield "the name of a component must be an ASCII identifier, since the FMU's library is called so"
    elif _C_KEYWORDS.fullmatch(name) or keyword.iskeyword(name):
        yield "the name of a component must be an identifier in C and Python, and this is a keyword; give it another name"
    elif _DEVICES.match(name):
        yield "Windows cannot have files of this name, which is a device's; give the component another name"
    if len(name) > LONGEST_NAME:
        yield f"the name has {len(name)} letters, and files are called so; give the component one of at most {LONGEST_NAME}"


def _of_class(component: type[Component]) -> Iterator[str]:
    yield from _of_text("the docstring", component.__doc__ or "")
    if len(component.variables) > MOST_VARIABLES:
        yield f"{len(component.variables)} variables are more than the {MOST_VARIABLES} that an FMU can have; use arrays"
    for name in ("default_stop_time", "default_step_size", "default_tolerance"):
        value: Any = getattr(component, name)
        if not (_is_number(value) and 0.0 < value < math.inf):
            yield f"{name} is {value!r}; it must be a positive, finite number"
    yield from _of_about(component.about)
    yield from _of_terminals(component)


def _of_about(about: Any) -> Iterator[str]:
    if not isinstance(about, dict):
        yield f"about is {about!r}; it must be a dictionary of texts"
        return
    for name, text in about.items():
        if name not in ABOUT:
            yield f"about tells {name!r}, which a model description has no place for; it has for {', '.join(ABOUT)}"
        yield from _of_text(f"the {name} in about", text)


def _of_terminals(component: type[Component]) -> Iterator[str]:
    """Of terminals: their names are texts, and their members inputs, outputs or parameters."""
    known = [v.name for v in component.variables.values() if v.causality not in ("local", "state")]
    told: Any = component.terminals
    if not (isinstance(told, dict) and all(isinstance(members, dict) for members in told.values())):
        yield f"terminals is {told!r}; it must be a dictionary of dictionaries: for each terminal, variables by members' names"
        return
    for terminal, members in component.terminals.items():
        yield from _of_text("the name of terminal", terminal)
        if not members:
            yield f"terminal {terminal!r} has no members; leave it out"
        for member, name in members.items():
            yield from _of_text(f"a member of terminal {terminal!r},", member)
            if name not in known:
                near = nearest(name, known)
                yield f"terminal {terminal!r} has {name!r} as {member!r}, which is no input, output or parameter.{near}"


def _of_text(what: str, text: Any) -> Iterator[str]:
    """Findings of a text that goes into XML and C."""
    if not isinstance(text, str):
        yield f"{what} is {text!r}; it must be a text"
    elif match := _NOT_IN_XML.search(text):
        character = f"U+{ord(match[0]):04X} (character {match.start() + 1})"
        yield f"{what} {text!r:.80} has {character}, which XML cannot hold; leave it out"


def _of_messages(component: type[Component]) -> Iterator[str]:
    for status, text in component.messages.items():
        what = f"the message of status {status!r}"
        if not isinstance(status, int) or not INTEGERS[0] <= status <= INTEGERS[1] or status == 0:
            yield f"{what} cannot be returned: a status is a whole number from {INTEGERS[0]} to {INTEGERS[1]}, and 0 is none"
        wrong = list(_of_text(what, text))
        yield from wrong
        for name in [] if wrong else re.findall(r"\{(\w+)\}", text):
            if name not in component.variables:
                yield f"{what} names {{{name}}}, which is not a variable.{nearest(name, component.variables)}"


def _of_variable(variable: Variable[Any]) -> Iterator[str]:
    if not variable.name.isascii():
        yield "the name has letters that are not ASCII, which FMI's structured names cannot have; write it with a to z"
    for what, text in (("description", variable.description), ("unit", variable.unit), ("display_unit", variable.display_unit)):
        yield from _of_text(f"the {what}", text)
    if not (variable.kind in (float, int, bool) or issubclass(variable.kind, enum.IntEnum)):
        yield f"values of type {variable.kind.__name__} are not known to FMI; use float, int, bool or an IntEnum"
        return
    for label, start in zip(variable.scalar_names, variable.starts, strict=True):
        yield from _of_number(f"the start value of {label}", start)
    bounds = [("min", variable.min), ("max", variable.max)]
    wrong = [problem for side, bound in bounds if bound is not None for problem in _of_bound(variable, side, bound)]
    yield from wrong or _of_domain(variable)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _of_number(what: str, value: Any) -> Iterator[str]:
    if isinstance(value, float) and not math.isfinite(value):
        yield f"{what} is {value}; it must be a finite number"
    elif isinstance(value, int) and not INTEGERS[0] <= value <= INTEGERS[1]:
        low, high = INTEGERS
        yield f"{what} is {_shown(value)}; an Integer of FMI is from {low} to {high}. Declare kind=float, or give a smaller number"


def _shown(value: int) -> str:
    return str(value) if abs(value) < 10**30 else f"an integer of {value.bit_length()} bits"


def _of_bound(variable: Variable[Any], side: str, bound: Any) -> Iterator[str]:
    if variable.kind not in (float, int):
        yield f"{side} = {bound!r}: a Boolean or an enumeration has no bounds; leave it out"
    elif not _is_number(bound):
        yield f"{side} is {bound!r}; it must be a number"
    elif isinstance(bound, float) and not math.isfinite(bound):
        yield f"{side} is {bound}; it must be a finite number. Leave it out where there is no bound"
    elif variable.kind is int and bound != int(bound):
        yield f"{side} is {bound}; the bound of an Integer must be a whole number"
    elif variable.kind is int:
        yield from _of_number(side, int(bound))
    elif abs(bound) >= 2**1023:
        yield f"{side} is {bound:.3g}, which a double can hardly hold; leave it out where there is no bound"


def _of_domain(variable: Variable[Any]) -> Iterator[str]:
    """Of bounds that are numbers: there is something between them, and the start value is."""
    if variable.exclusive not in (False, True, "min", "max"):
        yield f"exclusive is {variable.exclusive!r}; it must be True, 'min' or 'max'"
        return
    wrong = list(_of_published(variable))
    if wrong:
        yield from wrong
        return
    published = variable.published_bounds if variable.kind in (float, int) else {}
    if published.get("min", -math.inf) > published.get("max", math.inf):
        low, high = variable.published or (variable.min, variable.max)
        excluded = " and excluded" if variable.exclusive and not variable.published else ""
        yield f"no value is between min = {low} and max = {high}{excluded}; exchange or widen them"
        return
    if variable.causality in ("parameter", "input"):
        found = (variable.problem(label, start) for label, start in zip(variable.scalar_names, variable.starts, strict=True))
        yield from (f"the start value is outside of its bounds: {problem}" for problem in found if problem)


def _of_published(variable: Variable[Any]) -> Iterator[str]:
    """Problems of published bounds: they must be a pair of numbers, or None, within the domain."""
    published: Any = variable.published
    if published is None:
        return
    if not (isinstance(published, tuple) and len(published) == 2):
        yield f"published is {published!r}; it must be a pair (min, max), with None for a bound that is not published"
        return
    for side, bound in zip(("min", "max"), published, strict=True):
        found = [] if bound is None else list(_of_bound(variable, side, bound))
        if bound is not None and not found and (outside := variable.problem(f"published {side}", bound)):
            found = [outside]
        yield from (f"published {problem}" if not problem.startswith("published") else problem for problem in found)


def _of_enumerations(component: type[Component]) -> Iterator[str]:
    kinds: dict[str, type[enum.IntEnum]] = {}
    for kind in dict.fromkeys(v.kind for v in component.variables.values() if issubclass(v.kind, enum.IntEnum)):
        if kinds.setdefault(kind.__name__, kind) is not kind:
            yield f"two enumerations are called {kind.__name__}; give one of them another name"
        yield from _of_text("the name of enumeration", kind.__name__)
        for item in kind:
            yield from _of_text(f"an item of enumeration {kind.__name__},", item.name)
            yield from _of_number(f"item {item.name!r} of enumeration {kind.__name__}", int(item))
