"""RepRapFirmware (Duet): one shaper for all axes, set by M593."""

from __future__ import annotations

from shaper_fmu.machines.definitions import MZV, THREE_HUMPS, TWO_HUMPS, fitted, zero_derivatives
from shaper_fmu.machines.firmware import Firmware, Setting, plain


def _lines(axis: str, setting: Setting) -> str:
    return f'M593 P"{setting.shaper}" F{plain(setting.frequency)} S{plain(setting.damping_ratio)}\n'


REPRAPFIRMWARE = Firmware(
    name="reprapfirmware",
    title="RepRapFirmware",
    definition="src/Movement/AxisShaper.cpp of October 2024",
    shapers={
        "zvd": zero_derivatives(1),
        "zvdd": zero_derivatives(2),
        "zvddd": zero_derivatives(3),
        "mzv": MZV,
        "ei2": fitted(TWO_HUMPS, damped=True),
        "ei3": fitted(THREE_HUMPS, damped=True),
    },
    frequencies=(7.2, 1000.0),  # half a period is counted in 16 bits of a clock of 937.5 kHz, or slower
    axes=(),
    lines=_lines,
    how=(
        "Put this line into config.g, or send it. RepRapFirmware has one shaper for all axes.",
        "It shapes accelerations that last long enough only; L sets how much it may slow a move for that.",
    ),
)
