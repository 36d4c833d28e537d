"""The live panel of a report: a design loaded, its modes as sliders within the ranges that were identified."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from shaper_fmu.errors import BuildError
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.live.identified_modes import MOST, IdentifiedModes
from shaper_fmu.live.page import page_of, panel_data
from shaper_fmu.live.plants import Plant, Slider
from shaper_fmu.page.blocks import Block, Live, Text
from shaper_fmu.tune.choice.boxes import UNDAMPED, shares
from shaper_fmu.tune.tuning import Tuning

Range = tuple[float, float, float]
"""Least, nominal and largest value."""
_FREQUENCIES, _DAMPINGS, _TOLERANCES = (0.3, 300.0), (0.0, 0.5), (0.005, 0.3)
"""Of the page's sliders, LIMITS in state.js."""
_BEYOND = 1.5
"""How far a slider goes over the ends of its range."""
TITLE = "Try it: move the modes, and see what is left"
NO_COMPILER = "The live panel needs a compiler where the page is written: pip install 'shaper-fmu[native]'."


def live_panel(
    kind: str,
    believed: Sequence[tuple[float, float]],
    tolerance: float,
    frequencies: Sequence[Range],
    dampings: Sequence[Range],
    parts: Sequence[float] = (),
) -> list[Block]:
    """The panel for a shaper of this kind, or a sentence where there is no compiler; [] where the page's sliders do not reach.

    Args:
        kind: of the shaper, such as "zvd".
        believed: natural frequency [rad/s] and damping ratio of each mode that it is designed for.
        tolerance: of V.
        frequencies, dampings: of the plant's modes [rad/s].
        parts: share of each mode in the response; equal ones by default.
    """
    within = [(w, _FREQUENCIES) for w, _ in believed] + [(z, _DAMPINGS) for _, z in believed] + [(tolerance, _TOLERANCES)]
    if kind not in SHAPERS or not 0 < len(frequencies) <= MOST or len(believed) > MOST:
        return []
    if not all(low <= value <= high for value, (low, high) in within):
        return []
    plant = modes_plant(frequencies, dampings, parts or [1.0 / len(frequencies)] * len(frequencies))
    start: dict[str, Any] = {
        "shaper": kind, "tolerance": _rounded(tolerance), "frequency": [_rounded(w) for w, _ in believed],
        "damping": [_rounded(z) for _, z in believed],
    }  # fmt: skip
    try:
        return [Live(TITLE, page_of(panel_data(plant, start)))]
    except BuildError:
        return [Text(NO_COMPILER)]


def _words(what: str, i: int, low: float, high: float) -> str:
    return f"{what} {i + 1}" + (f", range {_rounded(low):.4g} to {_rounded(high):.4g}" if _rounded(low) < _rounded(high) else "")


def _rounded(value: float) -> float:
    """As the page's numbers show it; a damping ratio that is rounding is none."""
    return float(f"{value:.6g}") if value > UNDAMPED else 0.0


def modes_plant(frequencies: Sequence[Range], dampings: Sequence[Range], parts: Sequence[float]) -> Plant:
    """Modes with sliders around their ranges, which begin at the nominal values."""
    sliders = []
    for i, ((low, nominal, high), (light, damping, heavy)) in enumerate(zip(frequencies, dampings, strict=True)):
        words = _words("natural frequency", i, low, high)
        sliders.append(Slider("natural_frequency", i, words, "rad/s", _rounded(nominal), low / _BEYOND, high * _BEYOND, log=True))
        words = _words("damping ratio", i, light, heavy)
        sliders.append(
            Slider("damping_ratio", i, words, "", _rounded(damping), 0.0, min(0.95, max(0.2, _BEYOND * heavy)), log=False)
        )
    return Plant(
        IdentifiedModes, "the modes", "command", "position", (("response", 0, "response", ""),), tuple(sliders),
        modes=len(frequencies),
        values={"modes": len(frequencies), "share": [*parts, *[0.0] * (MOST - len(parts))]},
        note="The modes of this report; a slider goes beyond the range, where nothing is promised.",
    )  # fmt: skip


def tuning_panel(tuning: Tuning) -> list[Block]:
    """The panel of a tuning: its shaper, and the modes within the ranges that it is for; [] for a shaper that has no kind."""
    choice, candidate = tuning.choice, tuning.candidate
    if choice is None or candidate is None or not candidate.design.by_kind or candidate.profile is not None:
        return []
    values, boxes = candidate.start_values(), choice.boxes
    count = int(values.get("modes", 1))
    frequencies, dampings = (list(values[name])[:count] for name in ("natural_frequency", "damping_ratio"))
    parts = shares(boxes).max(axis=1)
    return live_panel(
        str(values["shaper"]),
        list(zip(frequencies, dampings, strict=True)),
        float(values.get("vibration_tolerance", choice.requirements.tolerance)),
        [(box.natural_frequency.low, box.natural_frequency.nominal, box.natural_frequency.high) for box in boxes],
        [(box.damping_ratio.low, box.damping_ratio.nominal, box.damping_ratio.high) for box in boxes],
        [float(part) for part in parts / parts.sum()],
    )
