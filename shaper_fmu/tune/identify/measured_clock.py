"""The time column of a table: which one it is, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from shaper_fmu.analysis.identification import Finding, IdentificationError
from shaper_fmu.errors import nearest
from shaper_fmu.tune.identify.measured_table import Table

SECONDS = {
    "": 1.0, "s": 1.0, "sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "millis": 1e-3,
    "milliseconds": 1e-3, "us": 1e-6, "usec": 1e-6, "micros": 1e-6, "microseconds": 1e-6, "\u00b5s": 1e-6, "\u03bcs": 1e-6,
    "ns": 1e-9, "nanoseconds": 1e-9, "min": 60.0, "minutes": 60.0, "h": 3600.0,
}  # fmt: skip
"""Units of time, casefolded [s]."""
_NAMES = r"elapsed[ _]?time|sample[ _]?time|print[ _]?time|time[ _]?stamp|time|zeit|temps|tempo|tiempo|millis|micros|t"
_TIME = re.compile(rf"^(?P<base>{_NAMES})(?:\s*(?P<mark>[_/,.:\- ]|\bin\b)\s*(?:in\s+)?(?P<unit>\S+))?$", re.IGNORECASE)
_SPECTRUM = re.compile(
    r"^(freq|frequency|frequenc(y|ies)|frequenz|f|hz|khz|omega|bin)([_/ ,.\-\[(]*(hz|khz|rad/s|1/s)[\])]?)?$", re.IGNORECASE
)
_OF_SPECTRA = ("hz", "khz", "rad/s", "1/s", "rpm", "1/min")


def time_column(
    table: Table, wanted: str | None, units: Mapping[str, str], unit: str | None = None
) -> tuple[str, np.ndarray, list[Finding]]:
    """The time column's name, its values [s], and what was assumed.

    Units are those given, that in the header's brackets, or that in the name: "time_ms", "Time/ms", "t us". Without a name that
    says time the first column is taken, unless it is a frequency: a spectrum is refused. Raises IdentificationError.
    """
    name = wanted if wanted is not None else _by_name(table)
    if name is not None and name not in table.names:
        raise IdentificationError(f"the table has no column {name!r}.{nearest(name, table.names)}")
    findings: list[Finding] = []
    if name is None:
        name = table.names[0]
        _refuse_spectrum(name, units.get(name, ""), table)
        text = f"no column is called time: the first one, {name!r}, is taken as the time in {unit or units.get(name) or 's'}"
        findings.append(Finding("assumed_time", text))
    unit = (unit or units.get(name, "")).strip() or _unit_in(name)
    if unit.casefold() not in SECONDS:
        raise IdentificationError(f"the time column {name!r} is in {unit!r}; s, ms, us, ns, min and h are understood")
    values = table[name]
    if not unit and len(values) > 2 and (values == np.round(values)).all():
        text = f"the times in {name!r} are whole numbers without a unit, and were taken as seconds: tell the unit (--time-unit)"
        findings.append(Finding("time_unit", text))
    return name, values * SECONDS[unit.casefold()], findings


def _by_name(table: Table) -> str | None:
    """The first column whose name says time: by a word, else with a unit, else by a "t" alone, which may be a temperature."""
    matches = [(name, _TIME.match(name.strip())) for name in table.names]
    plain = [name for name, match in matches if match and not match["unit"]]
    known = [
        n
        for n, match in matches
        if match and match["unit"] and (match["mark"] == "/" or match["unit"].strip("()[]").casefold() in SECONDS)
    ]
    words = [name for name in plain if len(name.strip()) > 1]
    return next(iter([*words, *known, *plain]), None)


def _unit_in(name: str) -> str:
    match = _TIME.match(name.strip())
    if match is None:
        return ""
    if match["base"].casefold() in ("millis", "micros"):
        return match["base"]
    unit = (match["unit"] or "").strip("()[]")
    return unit if unit.casefold() in SECONDS or match["mark"] == "/" else ""


def _refuse_spectrum(name: str, unit: str, table: Table) -> None:
    """Raise IdentificationError for a table over frequency."""
    if _SPECTRUM.match(name.strip()) or unit.casefold() in _OF_SPECTRA:
        others = ", ".join(table.names[1:4])
        raise IdentificationError(
            f"this is no response over time: its first column is {name!r}, so that {others or 'its values'} seem to be a spectrum, "
            "which does not tell damping and phase. Give the recording that it was computed from, with a time column"
        )
