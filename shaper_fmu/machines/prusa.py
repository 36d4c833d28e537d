"""Prusa's Buddy firmware: Klipper's shapers as they were before 2024, set by M593."""

from __future__ import annotations

from shaper_fmu.machines.definitions import MZV, weakened_ei, zero_derivatives
from shaper_fmu.machines.firmware import Firmware, Setting, plain

_NUMBERS = {"ZV": 0, "ZVD": 1, "MZV": 2, "EI": 3, "2HUMP_EI": 4, "3HUMP_EI": 5}


def _lines(axis: str, setting: Setting) -> str:
    number = _NUMBERS[setting.shaper]
    tolerance = " R20" if setting.shaper.endswith("EI") else ""
    return f"M593 {axis.upper()} T{number} F{plain(setting.frequency)} D{plain(setting.damping_ratio)}{tolerance} W\n"


PRUSA = Firmware(
    name="prusa",
    title="Prusa Buddy",
    definition="lib/Marlin/Marlin/src/feature/input_shaper/input_shaper.cpp of March 2025",
    shapers={
        "ZV": zero_derivatives(0),
        "ZVD": zero_derivatives(1),
        "MZV": MZV,
        "EI": weakened_ei(1),
        "2HUMP_EI": weakened_ei(2),
        "3HUMP_EI": weakened_ei(3),
    },
    frequencies=(10.0, 100.0),
    axes=("x", "y", "z"),
    lines=_lines,
    how=(
        "Send this to the printer; W keeps it. M593 without parameters tells what is set.",
        "It takes 10 to 100 Hz (some models 150 Hz), and changes other frequencies to the next of these without an error.",
    ),
)
