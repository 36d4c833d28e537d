"""Marlin: ZV of its standard motion (M593), and the shapers of Fixed-Time Motion (M493)."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import partial

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.machines.definitions import damped_period, left_after, normalised, undamped_ei
from shaper_fmu.machines.firmware import Firmware, Setting, plain

RATE = 1000.0
"""Samples of Fixed-Time Motion a second (FTM_FS): impulses come at whole samples."""


def _zv(frequency: float, zeta: float) -> ImpulseSequence:
    """Amplitudes in 128ths, by a fit in zeta; half a damped period apart, as long as F is the damped frequency."""
    second = 64.0
    if zeta > 0.0:
        second = math.floor(64.44056192 - 99.02008832 * zeta - 7.58095488 * zeta**2 + 43.073216 * zeta**3)
    half = 0.5 / float(_damped(frequency, zeta))
    return ImpulseSequence((1.0 - second / 128.0, second / 128.0), (0.0, half))


def _damped(frequency: float, zeta: float) -> str:
    """F of M593 [Hz]."""
    return plain(float(f"{frequency * math.sqrt(1.0 - zeta * zeta):.6g}"))


def _zv_lines(axis: str, setting: Setting) -> str:
    return f"M593 {axis.upper()} F{_damped(setting.frequency, setting.damping_ratio)} D{plain(setting.damping_ratio)}\nM500\n"


MARLIN = Firmware(
    name="marlin",
    title="Marlin (standard motion)",
    definition="Marlin/src/module/stepper.cpp of 2025",
    shapers={"ZV": _zv},
    axes=("x", "y", "z"),
    lines=_zv_lines,
    how=(
        "Send this to a Marlin that was built with INPUT_SHAPING_X (or _Y, _Z); M500 keeps it.",
        "F is the damped frequency: Marlin takes half of its period between the impulses.",
        "Its amplitudes are multiples of 1/128. If M593 refuses a low frequency, set SHAPING_MIN_FREQ in the configuration.",
        "Fixed-Time Motion has more shapers: --for marlin-ft.",
    ),
)

_NUMBERS = {"ZV": 1, "ZVD": 2, "ZVDD": 3, "ZVDDD": 4, "EI": 5, "2HEI": 6, "3HEI": 7, "MZV": 8}
_UNDAMPED = {
    **{name: tuple(math.comb(n, i) for i in range(n + 1)) for n, name in enumerate(("ZV", "ZVD", "ZVDD", "ZVDDD"), 1)},
    **{name: undamped_ei(humps) for humps, name in enumerate(("EI", "2HEI", "3HEI"), 1)},
    "MZV": (1.0, math.sqrt(2.0), 1.0),
}


def _sampled(shaper: str, frequency: float, zeta: float) -> ImpulseSequence:
    """Times are multiples of the first one, which is rounded to a sample; MZV is weakened as if half a period lay between."""
    k = left_after(1.0, zeta)
    spacing = (0.375 if shaper == "MZV" else 0.5) * damped_period(frequency, zeta)
    step = math.floor(Fraction(spacing * RATE) + Fraction(1, 2)) / RATE
    undamped = _UNDAMPED[shaper]
    return normalised([a * k**i for i, a in enumerate(undamped)], [i * step for i in range(len(undamped))])


def _sampled_lines(axis: str, setting: Setting) -> str:
    number, letter = _NUMBERS[setting.shaper], axis.upper()
    tolerance = " Q0.05" if setting.shaper.endswith("EI") else ""
    return (
        f"M493 S1 {letter} C{number}\nM493 {letter} A{plain(setting.frequency)} I{plain(setting.damping_ratio)}{tolerance}\nM500\n"
    )


MARLIN_FT = Firmware(
    name="marlin-ft",
    title="Marlin (Fixed-Time Motion)",
    definition="Marlin/src/module/ft_motion/shaping.cpp of 2025",
    shapers={name: partial(_sampled, name) for name in _NUMBERS},
    frequencies=(20.0, 500.0),
    damping=(0.01, 0.25),
    axes=("x", "y", "z"),
    lines=_sampled_lines,
    how=(
        "Send this to a Marlin that was built with FT_MOTION; M500 keeps it. S1 turns Fixed-Time Motion on.",
        "Impulses come at whole samples (FTM_FS, 1000 a second): the numbers here are with this rounding.",
        "It takes frequencies from FTM_MIN_SHAPE_FREQ on (20 Hz as it comes).",
    ),
)
