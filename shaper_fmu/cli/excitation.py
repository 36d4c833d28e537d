"""What `shaper-fmu run --input` understands: a step, a sine, a number, or the column of a table."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from shaper_fmu.cli.arguments import input_file, wrong_usage
from shaper_fmu.console import err
from shaper_fmu.errors import nearest

if TYPE_CHECKING:
    from shaper_fmu.master.system import System

OPTION = "--input"
EXAMPLES = "F=step:1@0.5, F=sine:0.2@1.5Hz, F=2.5 or F=table.csv"
HELP = (
    "What drives an input; may be repeated. F=step:1@0.5 adds 1 to the start value at 0.5 s (without numbers: 1 at 0 s). "
    "F=sine:0.2@1.5Hz adds a sine of amplitude 0.2 (or @9.4rad/s; @1.5Hz@2 begins at 2 s). F=2.5 holds a value. F=table.csv is the "
    "table's column F over its time column, straight between the rows; F=table.csv:speed is its column speed, and @hold at the "
    "end holds each value until the next row."
)
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_STEP = re.compile(rf"step(?::({_NUMBER}))?(?:@({_NUMBER})s?)?")
_SINE = re.compile(rf"sine(?::({_NUMBER}))?@({_NUMBER})(Hz|rad/s)(?:@({_NUMBER})s?)?", re.IGNORECASE)
_TABLE = re.compile(r"(.+?\.(?:csv|tsv|txt|parquet))(?::(.+?))?(?:@(hold|linear))?", re.IGNORECASE)
_KINDS = ("step", "sine")


@dataclass(frozen=True)
class Excitation:
    """What drives an input: from its value at rest and its unit, the source for `System.drive`, and words for people.

    Attributes:
        source: (value at rest) -> a number, a function of time, or a table.
        words: (value at rest, unit) -> text.
        held: whether the values are taken at the beginning of each step, and held over it.
        end: of a table [s]; infinite for all else.
    """

    source: Callable[[float], Any]
    words: Callable[[float, str], str]
    held: bool = False
    end: float = math.inf


def excitation(name: str, text: str) -> Excitation:
    """The excitation that a text describes, of the input `name`. Raises BadParameter."""
    if match := re.fullmatch(_NUMBER, text):
        return _constant(float(match[0]))
    if match := _STEP.fullmatch(text):
        return _step(float(match[1] or 1.0), float(match[2] or 0.0))
    if match := _SINE.fullmatch(text):
        return _sine(float(match[1] or 1.0), float(match[2]), match[3].casefold() == "hz", float(match[4] or 0.0))
    if match := _TABLE.fullmatch(text):
        return _table(name, Path(match[1]), match[2], (match[3] or "linear").casefold() == "linear")
    raise typer.BadParameter(f"{name}={text}: {_why(text)}", param_hint=OPTION)


def _why(text: str) -> str:
    kind = re.split(r"[:@]", text)[0]
    if kind.casefold() == "sine":
        return "a sine is written sine:AMPLITUDE@FREQUENCY with the frequency's unit, such as sine:0.2@1.5Hz or sine:0.2@9.4rad/s"
    if kind.casefold() == "step":
        return "a step is written step:HEIGHT@TIME, such as step:1@0.5"
    hint = nearest(kind, _KINDS) if "Did you mean" in nearest(kind, _KINDS) else ""
    return f"neither a number, a step, a sine nor a table.{hint} Write {EXAMPLES}"


def _constant(value: float) -> Excitation:
    return Excitation(lambda _: value, lambda _, unit: f"held at {_amount(value, unit)}")


def _step(height: float, at: float) -> Excitation:
    return Excitation(
        lambda rest: ([min(0.0, at), at], [rest, rest + height]),
        lambda rest, unit: f"step from {rest:g} to {_amount(rest + height, unit)} at {at:g} s",
    )


def _sine(amplitude: float, frequency: float, in_hertz: bool, begin: float) -> Excitation:
    if not 0.0 < frequency < math.inf:
        raise typer.BadParameter(f"a sine's frequency must be a finite number above 0, not {frequency:g}", param_hint=OPTION)
    rate = 2.0 * math.pi * frequency if in_hertz else frequency

    def source(rest: float) -> Callable[[float], float]:
        return lambda t: rest + (amplitude * math.sin(rate * (t - begin)) if t > begin else 0.0)

    def words(rest: float, unit: str) -> str:
        return (
            f"sine of amplitude {_amount(amplitude, unit)} about {rest:g}, {rate / (2.0 * math.pi):.6g} Hz ({rate:.6g} rad/s), "
            f"from {begin:g} s on"
        )

    return Excitation(source, words, held=True)


def _table(name: str, path: Path, column: str | None, linear: bool) -> Excitation:
    from shaper_fmu.master.signals import make_signal
    from shaper_fmu.tune.identify.measured_clock import time_column
    from shaper_fmu.tune.identify.measured_table import read_table

    try:
        input_file()(path)
    except typer.BadParameter as error:
        raise typer.BadParameter(error.message, param_hint=OPTION) from None
    with wrong_usage(OPTION):
        table = read_table(path)
        clock, times, findings = time_column(table, None, table.units)
    others = [one for one in table.names if one != clock]
    column = column or (name if name in others else others[0] if len(others) == 1 else None)
    if column not in others:
        wanted = column or name
        message = f"{path} has no column {wanted!r}.{nearest(wanted, others)} Write {name}={path}:COLUMN"
        raise typer.BadParameter(message, param_hint=OPTION)
    for finding in (*table.notes, *findings):
        err.print(f"note: {finding.text}")
    interpolation = "linear" if linear else "hold"
    with wrong_usage(OPTION):
        source = make_signal((times, table[column]), interpolation, f"{path}, column {column}")
    how = "straight between the rows" if linear else "each value held until the next row"
    text = f"column {column} of {path}, {times[0]:g} to {times[-1]:g} s, {how}; before and after, its first and last value"
    return Excitation(lambda _: source, lambda _, unit: f"{text}{f' [{unit}]' if unit else ''}", linear, float(times[-1]))


def _amount(value: float, unit: str) -> str:
    return f"{value:g} {unit}".rstrip()


def drive_inputs(system: System, given: Mapping[str, str], prefix: str, stop: float, step: float) -> None:
    """Drive inputs of a system as the texts say, and print what each of them gets; `prefix` is that of the inputs' names.

    Raises BadParameter for a text that is wrong, or an input that does not exist.
    """
    from shaper_fmu.master.alone import drive

    for name, text in given.items():
        found = excitation(name, text)
        with wrong_usage(OPTION):
            port = system.split(f"{prefix}{name}")
            rest = float(system.start_values[port[0]].get(port[1], 0.0))
            drive(system, f"{prefix}{name}", found.source(rest))
        held = f"; held over each step of {step:g} s" if found.held else ""
        err.print(f"input {name}: {found.words(rest, system.unit(port))}{held}")
        if found.end < stop * (1.0 - 1e-12):
            err.print(f"note: {name}: the table ends at {found.end:g} s, and the run at {stop:g} s")
