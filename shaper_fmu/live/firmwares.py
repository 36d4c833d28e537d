"""What the page knows of firmwares: which of its shapers each one has, its limits, and how it writes its settings."""

from __future__ import annotations

import math
from typing import Any

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.machines.firmware import Firmware, Setting, plain
from shaper_fmu.machines.settings import FIRMWARE

_KINDS = {
    **{name: name for name in ("zv", "zvd", "zvdd", "zvddd", "mzv", "ei")},
    **dict.fromkeys(("2hump_ei", "2hei", "ei2"), "two_hump_ei"),
    **dict.fromkeys(("3hump_ei", "3hei", "ei3"), "three_hump_ei"),
}
"""The page's name of a firmware's shaper, whose name is written in small letters here."""
_FREQUENCY, _DAMPING = 123.457, 0.1234  # stand for the numbers in the settings' text


def firmwares() -> list[dict[str, Any]]:
    """All firmwares, as plain data; `lines` have {frequency} [Hz], {damped} [Hz] and {damping} in place of numbers."""
    return [_described(one) for one in FIRMWARE.values()]


def kind_of(shaper: str) -> str:
    """The page's name of a firmware's shaper."""
    return _KINDS[shaper.lower()]


def _described(firmware: Firmware) -> dict[str, Any]:
    most = {kind_of(name): firmware.most_damped.get(name, firmware.damping[1]) for name in firmware.shapers}
    return {
        "name": firmware.name,
        "title": firmware.title,
        "comment": firmware.comment,
        "how": firmware.how,
        "frequencies": firmware.frequencies,
        "leastDamping": firmware.damping[0],
        "oneForAll": not firmware.axes,
        "shapers": {
            kind_of(name): {"lines": _template(firmware, name), "mostDamping": most[kind_of(name)]} for name in firmware.shapers
        },
    }


def _template(firmware: Firmware, shaper: str) -> str:
    text = firmware.lines("x", Setting(shaper, _FREQUENCY, _DAMPING, ImpulseSequence((1.0,), (0.0,))))
    damped = plain(float(f"{_FREQUENCY * math.sqrt(1.0 - _DAMPING**2):.6g}"))
    for number, name in ((damped, "{damped}"), (plain(_FREQUENCY), "{frequency}"), (plain(_DAMPING), "{damping}")):
        text = text.replace(number, name)
    return text
