"""Checks the arguments of commands before their work begins, so that wrong usage exits with 2 at once.

Parsers of numbers, and callbacks for files, which pass on what is right; the rest is a BadParameter, with the option and the value.
"""

from __future__ import annotations

import importlib.util
import inspect
import math
import os
import re
import stat
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from shaper_fmu.cli.paths import absolute
from shaper_fmu.component import Variable
from shaper_fmu.errors import NoSolutionError, ShaperFmuError
from shaper_fmu.methods.announced import OutsidePackageWarning

PAGE = (".html", ".htm")
PICTURE = (".png", ".svg")
STORE = (".sqlite", ".sqlite3", ".db")

_PACKAGES = {
    **dict.fromkeys(PICTURE, (("matplotlib",), "report")),
    ".parquet": (("pyarrow",), "parquet"),
}
"""What is needed to write a file, by its ending, and the extra that installs it."""
_LONGER = 40
"""Letters by which the names of drafts and pictures beside a file are longer than its own."""

Callback = Callable[[Any], Any]


@contextmanager
def wrong_usage(hint: str | None = None) -> Iterator[None]:
    """Errors raised inside are wrong usage: names and values of the option `hint`."""
    try:
        yield
    except NoSolutionError:
        raise
    except ShaperFmuError as error:
        raise typer.BadParameter(str(error), param_hint=hint) from None


def _each(problem: Callable[[Any], str | None], passed: Callback = lambda value: value) -> Callback:
    """A callback that refuses a value, or any of several, for which `problem` returns a message; a single value is passed on as
    `passed`.
    """

    def callback(given: Any) -> Any:
        for value in given if isinstance(given, list | tuple) else [given]:
            message = problem(value) if value is not None else None
            if message:
                raise typer.BadParameter(message)
        return passed(given) if isinstance(given, Path) else given

    return callback


def input_file(*endings: str) -> Callback:
    """A callback for input files: they must exist, be readable, and have one of the `endings`, if any are given."""
    return _each(lambda path: _unreadable(path) or _wrong_ending(path, endings))


def input_system(*endings: str) -> Callback:
    """A callback for systems: files with one of the `endings`, and folders of systems."""
    from shaper_fmu.ssp.names import DESCRIPTION

    def callback(path: Path) -> Path:
        if not os.path.isdir(path):
            return input_file(*endings)(path)
        if not os.path.isfile(path / DESCRIPTION):
            raise typer.BadParameter(f"{path}: not a file but a folder: no {DESCRIPTION} in this folder")
        return path

    return callback


def output_file(*endings: str) -> Callback:
    """Of a file to be written: it ends as what will be in it, and can be written; missing folders are made then.

    Its path becomes absolute.
    """
    return _each(lambda path: _unwritable(path, folder=False) or _wrong_ending(path, endings) or _missing_package(path), absolute)


def output_drawing(path: Path) -> Path:
    """Of a drawing of a system (.svg), which needs no package."""
    return _each(lambda path: _unwritable(path, folder=False) or _wrong_ending(path, (".svg",)), absolute)(path)


output_folder: Callback = _each(lambda path: _unwritable(path, folder=True), absolute)
"""Of a folder to be written to, which is made then if it is missing. Its path becomes absolute."""


def number(
    domain: str, holds: Callable[[float], bool], kind: type = float, units: Mapping[str, float] | None = None, hint: str = ""
) -> Callback:
    """A parser of numbers for which `holds` is true; `domain` describes them in messages, and `hint` is said of others.

    `units` may follow a number, such as "%" or "Hz": it is multiplied by their factors.
    """

    def parse(given: Any) -> Any:
        text = str(given)  # a default of an option comes as a number
        unit = next((unit for unit in units or {} if text.rstrip().casefold().endswith(unit.casefold())), "")
        bare = text.rstrip()[: -len(unit)] if unit else text
        try:
            value = kind(bare) * (units or {}).get(unit, 1)
        except ValueError:
            raise typer.BadParameter(
                f"{text!r} is not a {'whole number' if kind is int else 'number'}{_likely(text, units)}"
            ) from None
        if not holds(value):
            meant = hint.format(text) if hint and not unit and math.isfinite(value) and value > 0.0 else ""
            raise typer.BadParameter(f"{text} is outside its domain: {domain}{meant}")
        return value

    parse.__name__ = {float: "FLOAT", int: "INTEGER"}[kind]  # as the help shows it
    return parse


def _likely(text: str, units: Mapping[str, float] | None) -> str:
    """What a text that is no number was meant as: a comma for a point, several values, a unit that is not taken."""
    if "," in text and all(map(_is_number, text.split(","))):
        return f": a decimal has a point ({text.replace(',', '.', 1)}); an option that takes several values is repeated for each"
    if _is_number(re.sub(r"[a-zA-Z/%]+$", "", text.rstrip())):
        return (
            f" with a unit that is taken here: {', '.join(units)}, or none"
            if units
            else "; its unit is that of the help, and not written"
        )
    return ""


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


_SHARES = {"%": 0.01}
_RATES = {"Hz": 2.0 * math.pi, "rad/s": 1.0}
_HERTZ = {"Hz": 1.0, "rad/s": 0.5 / math.pi}
_TIMES = {"us": 1e-6, "ms": 1e-3, "min": 60.0, "s": 1.0}

positive: Callback = number("a finite number above 0", lambda x: 0.0 < x < math.inf)
not_negative: Callback = number("a finite number of at least 0", lambda x: 0.0 <= x < math.inf)
finite: Callback = number("a finite number", math.isfinite)
rate: Callback = number("a finite number above 0", lambda x: 0.0 < x < math.inf, units=_RATES)
"""An angular frequency [rad/s], or with its unit, such as 0.8Hz."""
hertz: Callback = number("a finite number above 0", lambda x: 0.0 < x < math.inf, units=_HERTZ)
"""A frequency [Hz], or with its unit, such as 5rad/s."""
instant: Callback = number("a finite number", math.isfinite, units=_TIMES)
"""A time [s], or with its unit, such as 500ms."""
time_span: Callback = number("a finite number above 0", lambda x: 0.0 < x < math.inf, units=_TIMES)
longest_time: Callback = number("at least 0", lambda x: x >= 0.0, units=_TIMES)
time_or_none: Callback = number("a finite number of at least 0", lambda x: 0.0 <= x < math.inf, units=_TIMES)
damping_ratio: Callback = number("0 <= zeta < 1", lambda x: 0.0 <= x < 1.0, units=_SHARES, hint="; did you mean {}%?")
share: Callback = number("between 0 and 1", lambda x: 0.0 < x < 1.0, units=_SHARES, hint="; did you mean {}%?")
"""A share, as 0.05 or 5%."""
index: Callback = number("at least 0", lambda n: n >= 0, int)


def pairs(given: Sequence[str] | None, option: str, example: str, empty: bool = False) -> dict[str, str]:
    """The names and values of an option that may be repeated, such as --set mass=2; with `empty` a value may be an empty text.

    A name that is given twice is wrong usage.
    """
    found: dict[str, str] = {}
    for text in given or []:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (equals and name and (value or empty)):
            raise typer.BadParameter(f"{text!r} is not of the form {example}", param_hint=option)
        if name in found:
            raise typer.BadParameter(f"{name} is given twice, as {found[name]} and as {value}; leave one out", param_hint=option)
        found[name] = value
    return found


def add_options(command: Callable[..., None], variables: Mapping[str, Variable[Any]]) -> None:
    """Give a command that takes **parameters an option for each of these, with their descriptions and domains.

    A name that one of the command's own options has cannot be given there; it keeps its start value, with a warning.
    """
    signature = inspect.signature(command, eval_str=True)
    kept = [parameter for parameter in signature.parameters.values() if parameter.kind is not inspect.Parameter.VAR_KEYWORD]
    for name, variable in variables.items():
        if name in signature.parameters:
            text = f"the parameter {name} of another package's method is no option of this command, which has its own --{name}"
            warnings.warn(text, OutsidePackageWarning, stacklevel=2)
            continue
        whole = variable.kind is int and variable.min is not None and variable.max is not None
        message = f"{variable.min:g} to {variable.max:g}" if whole else variable.domain or "a finite number"
        units = {"": _SHARES, "rad/s": _RATES}.get(variable.unit) if variable.kind is float else None
        parser = number(message, lambda value, variable=variable: variable.problem("", value) is None, variable.kind, units)
        option = typer.Option(help=f"{variable.description[:1].upper()}{variable.description[1:]}.", parser=parser)
        annotation = Annotated[variable.kind, option]
        kept.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=variable.start, annotation=annotation))
    command.__signature__ = signature.replace(parameters=kept)  # pyright: ignore[reportFunctionMemberAccess]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in kept}


def _unreadable(path: Path) -> str | None:
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            return f"{path}: not a file but {_folder_words(path) if stat.S_ISDIR(mode) else 'a device or pipe'}"
        with open(path, "rb"):
            return None
    except (OSError, ValueError) as error:
        return f"{path}: {_reason(error)}"


def _folder_words(path: Path) -> str:
    """A folder, and of a system's the command that makes an archive of it."""
    from shaper_fmu.ssp.names import DESCRIPTION

    archive = path.with_name(f"{path.name}.ssp")
    build = f"; its archive is taken: shaper-fmu build {path} makes {archive}"
    return f"a system's folder{build}" if os.path.isfile(path / DESCRIPTION) else "a folder"


def _wrong_ending(path: Path, endings: tuple[str, ...]) -> str | None:
    if not endings or path.suffix.lower() in endings:
        return None
    known = ", ".join(endings[:-1]) + (" or " if endings[:-1] else "") + endings[-1]
    return f"{path.name!r} must end with {known}: the ending decides the format"


def _missing_package(path: Path) -> str | None:
    packages, extra = _PACKAGES.get(path.suffix.lower(), ((), ""))
    for package in packages:
        if importlib.util.find_spec(package) is None:
            return f"{path.name}: files of this ending need the package {package}: pip install 'shaper-fmu[{extra}]'"
    return None


def _unwritable(path: Path, folder: bool) -> str | None:
    """The reason why a file or folder of this path could not be written, judged by what exists of it and its folders."""
    try:
        mode = _mode(path)
        if not folder:
            _mode(path.with_name(path.name + "x" * _LONGER) if path.name else path)  # a name that is too long
        if mode is not None and not folder:
            if not stat.S_ISREG(mode):
                return f"{path}: {'a folder' if stat.S_ISDIR(mode) else 'a device or pipe'}, where a file shall be written"
            if not os.access(path, os.W_OK):
                return f"{path}: this file is write-protected"
        inside = path if folder else path.parent
        nearest = next(place for place in (inside, *inside.absolute().parents) if _mode(place) is not None)
        if not nearest.is_dir():
            return f"{path}: {nearest} is not a folder"
        return None if os.access(nearest, os.W_OK | os.X_OK) else f"{path}: nothing can be written into {nearest.absolute()}"
    except (OSError, ValueError) as error:
        return f"{path}: {_reason(error)}"


def _mode(path: Path) -> int | None:
    """The mode of an existing path; None if there is none."""
    try:
        return os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
