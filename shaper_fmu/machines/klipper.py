"""Klipper, and Kalico, which keeps the definitions that Klipper had until February 2024."""

from __future__ import annotations

from shaper_fmu.machines.definitions import (
    MZV,
    THREE_HUMPS,
    TWO_HUMPS,
    fitted,
    fitted_ei,
    weakened_ei,
    zero_derivatives,
)
from shaper_fmu.machines.firmware import Firmware, Setting, plain


def _lines(axis: str, setting: Setting) -> str:
    return (
        f"[input_shaper]\nshaper_type_{axis}: {setting.shaper}\n"
        f"shaper_freq_{axis}: {plain(setting.frequency)}\ndamping_ratio_{axis}: {plain(setting.damping_ratio)}\n"
    )


_HOW = (
    "Put these lines into printer.cfg (both axes share the one section [input_shaper]) and restart.",
    "To try it without a restart, on the console: SET_INPUT_SHAPER with SHAPER_TYPE_X, SHAPER_FREQ_X, DAMPING_RATIO_X (or _Y).",
    "Lines under SAVE_CONFIG at the end of printer.cfg go before these; delete them there.",
)
_COMMON = {"zv": zero_derivatives(0), "mzv": MZV, "zvd": zero_derivatives(1)}

KLIPPER = Firmware(
    name="klipper",
    title="Klipper",
    definition="klippy/extras/shaper_defs.py since February 2024",
    shapers={
        **_COMMON,
        "ei": fitted_ei,
        "2hump_ei": fitted(TWO_HUMPS, damped=False),
        "3hump_ei": fitted(THREE_HUMPS, damped=False),
    },
    most_damped={"ei": 0.4, "2hump_ei": 0.3, "3hump_ei": 0.2},
    axes=("x", "y", "z"),
    lines=_lines,
    how=_HOW,
    comment="#",
    suffix=".cfg",
)
KALICO = Firmware(
    name="kalico",
    title="Kalico",
    definition="klippy/extras/shaper_defs.py of 2021, unchanged since",
    shapers={**_COMMON, "ei": weakened_ei(1), "2hump_ei": weakened_ei(2), "3hump_ei": weakened_ei(3)},
    lines=_lines,
    how=_HOW,
    comment="#",
    suffix=".cfg",
)
