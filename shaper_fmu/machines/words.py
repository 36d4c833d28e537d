"""What a machine's file says at its top: what it is, what it leaves, what it loses against the shaper that was recommended."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

from shaper_fmu.machines.firmware import Firmware
from shaper_fmu.machines.fit import Fitted
from shaper_fmu.tune.choice.reasons import percent, percent_beside
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.version import __version__

_WIDTH = 110


def header(words: str, caveat: str, more: Sequence[str]) -> list[str]:
    """Lines of at most `_WIDTH` characters."""
    said = [caveat and f"{caveat}.", f"Made by shaper-fmu {__version__}: {words}", *more]
    return [line for text in said if text for line in textwrap.wrap(text, _WIDTH)]


def lost(firmware: Firmware, best: Fitted, holds: bool, choice: Choice) -> str:
    """What the firmware's impulses leave, and how that compares with the recommended shaper."""
    one, wanted = best.candidate, choice.requirements
    setting = best.setting
    at = f"{setting.frequency:.6g} Hz ({setting.frequency * 2.0 * math.pi:.5g} rad/s), damping ratio {setting.damping_ratio:.4g}"
    text = (
        f"{setting.shaper} at {at}: it leaves at most {percent_beside(one.worst_case, wanted.tolerance)} of the unshaped vibration "
        f"over the modes' ranges, nominally {percent_beside(one.nominal, wanted.nominal_tolerance)}, and lasts {one.delay:.4g} s "
        "(bounds for the modes; this setting itself was not tried)."
    )
    if not holds:
        missed = [
            f"{name} of {percent(limit)}"
            for name, limit, value in (
                ("tolerance", wanted.tolerance, one.worst_case),
                ("nominal tolerance", wanted.nominal_tolerance, one.nominal),
            )
            if value > limit
        ]
        if one.delay > wanted.longest_delay:
            missed.append(f"longest delay of {wanted.longest_delay:.4g} s")
        text = f"NOT HELD: no shaper of {firmware.title} keeps the {' and the '.join(missed)}. The nearest is {text}"
    other = choice.recommended
    if other is not None:
        text += f" The recommended shaper, {other.name}, leaves {percent(other.worst_case)} and lasts {other.delay:.4g} s."
    return text
