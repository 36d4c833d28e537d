"""Random plants for the choice of a shaper, and what a command leaves of them, computed without bounds."""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.requirements import NEGATIVE, POSITIVE, Requirements
from shaper_fmu.tune.identify.range import Range


def random_plant(seed: int) -> tuple[list[ModeBox], Requirements]:
    """One or two modes, damped or not, and requirements; offline designs of damped modes take seconds, so only a few ask for them."""
    rng = np.random.default_rng(seed)
    damped, two = bool(seed % 2), seed % 5 == 0
    frequencies = np.exp(rng.uniform(-2.0, 4.0)) * np.array([1.0, rng.uniform(1.3, 5.0)])[: 1 + two]
    weight = rng.uniform(0.01, 1.0, (2, 3))
    boxes = []
    for k, w in enumerate(frequencies):
        low, high = 1.0 - rng.uniform(0.0, 0.15), 1.0 + rng.uniform(0.0, 0.15)
        zeta = float(rng.uniform(0.0, 0.12)) if damped else 0.0
        damping = Range(0.7 * zeta, zeta, 1.3 * zeta)
        boxes.append(ModeBox(Range(low * w, w, high * w), damping, tuple(weight[k])))
    kinds: tuple[str, ...] | None = None
    if damped or two:
        kinds = (*POSITIVE, "si") if seed % 50 == 1 else tuple(str(kind) for kind in rng.permutation(POSITIVE)[:6])
    if two:
        kinds = ("zv", "zvd", "ei", "mzv", "two_hump_ei", *(("direct_zv",) if seed % 20 == 0 else ()))
    negative = seed % 4 == 3
    kinds = (*kinds, *NEGATIVE) if kinds and negative else kinds
    delay = rng.uniform(0.3, 3.0) * 2.0 * math.pi / frequencies[0] if seed % 3 == 0 else math.inf
    return boxes, Requirements(float(rng.uniform(0.02, 0.25)), delay, kinds=kinds, allow_negative=negative)


def dense_maxima(amplitudes, delays, boxes: list[ModeBox]) -> list[float]:
    """The largest |sum A_i exp(p (T - t_i))| on a grid of each box (Singer and Seering 1990)."""
    found = []
    distances = delays[-1] - np.array(delays)
    for box in boxes:
        w, zeta = np.meshgrid(np.linspace(*box.frequencies, 401), np.linspace(*box.dampings, 5 if box.dampings[1] else 1))
        left = sum(a * np.exp(w * (-zeta + 1j * np.sqrt(1 - zeta**2)) * s) for a, s in zip(amplitudes, distances, strict=True))
        found.append(float(np.abs(left).max()))
    return found


def together(levels: list[float], boxes: list[ModeBox]) -> float:
    """The largest, over the outputs, of the sum of amplitude times level over the sum of amplitudes."""
    amplitudes = np.array([box.amplitudes for box in boxes])
    return max(float(column @ levels / column.sum()) for column in amplitudes.T)


def nominal_levels(amplitudes, delays, boxes: list[ModeBox]) -> list[float]:
    """|sum A_i exp(p (T - t_i))| at each box's nominal point."""
    distances = delays[-1] - np.array(delays)
    found = []
    for box in boxes:
        w, zeta = box.natural_frequency.nominal, box.damping_ratio.nominal
        found.append(float(abs(np.exp(w * (-zeta + 1j * math.sqrt(1 - zeta**2)) * distances) @ np.array(amplitudes))))
    return found
