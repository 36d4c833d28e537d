"""Modes over several recordings of one machine: other axes, places, loads, or repetitions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shaper_fmu.analysis.identification import Mode
from shaper_fmu.tune.choice.boxes import SAME_MODE, ModeBox
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.identify.range import ModeRange, Range


def boxes_of(recordings: Sequence[MeasuredIdentification]) -> list[ModeBox]:
    """A box for each mode of any recording, the first one's modes first: from least to largest, with standard deviations.

    Its amplitudes are those in each recording's outputs, 0 where it was not found.
    """
    followed = _followed(recordings)
    boxes = []
    for modes in followed:
        there = [mode for mode in modes if mode is not None]
        frequencies, dampings = ([getattr(m, name) for m in there] for name in ("natural_frequency", "damping_ratio"))
        found = ModeRange(
            Range(min(frequencies), frequencies[0], max(frequencies)),
            Range(min(dampings), dampings[0], max(dampings)),
            tuple(modes),
        )
        amplitudes = [
            float(a)
            for one, mode in zip(recordings, modes, strict=True)
            for a in (np.abs(mode.residues[0]) if mode is not None else np.zeros(len(one.outputs)))
        ]
        boxes.append(ModeBox.of_range(found, amplitudes))
    return boxes


def _followed(recordings: Sequence[MeasuredIdentification]) -> list[list[Mode | None]]:
    """Each mode in each recording; None where it was not found."""
    found: list[list[Mode | None]] = []
    for number, one in enumerate(recordings):
        known = [next(mode for mode in modes if mode is not None) for modes in found]
        pairs = sorted(
            (abs(math.log(mode.natural_frequency / other.natural_frequency)), i, j)
            for i, other in enumerate(known)
            for j, mode in enumerate(one.identification.modes)
        )
        taken: dict[int, int] = {}
        for distance, i, j in pairs:
            if distance < SAME_MODE and i not in taken and j not in taken.values():
                taken[i] = j
        for i, modes in enumerate(found):
            modes.append(one.identification.modes[taken[i]] if i in taken else None)
        fresh = [mode for j, mode in enumerate(one.identification.modes) if j not in taken.values()]
        found += [[*([None] * number), mode] for mode in fresh]
    return found
