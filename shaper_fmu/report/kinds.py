"""Shapers of several kinds beside each other: two tables, and one figure each of their sensitivity and of a shaped step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shaper_fmu.analysis.vibration import insensitivity, sensitivity_curve
from shaper_fmu.design.figures import staircase
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.page.blocks import Block, Table
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.design import Mode

WRONG_BY = (-0.2, -0.1, 0.0, 0.1, 0.2)
"""Shares by which the actual frequency is another one than the design's."""


def kinds_blocks(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> list[Block]:
    """Blocks of the page: two tables, the sensitivity curves over each other, and a unit step shaped by each."""
    return [_price(sequences, mode), _robustness(sequences, mode), *_figures(sequences, mode)]


def _price(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> Table:
    """Delay, insensitivity, and the largest level of a shaped unit step, which a drive must follow: a row for each kind."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    rows = []
    for name, one in sequences.items():
        robust = f"{100.0 * insensitivity(one, w, zeta, mode.tolerance):.1f}"
        periods = f"{one.duration * w / (2.0 * np.pi):.3f}"
        largest = f"{max(1.0, float(np.abs(np.cumsum(one.amplitudes)).max())):.4g}"
        rows.append([name, f"{one.duration:.4g}", periods, str(len(one.delays)), robust, largest])
    head = ["kind", "delay [s]", "periods", "impulses", f"I({100.0 * mode.tolerance:.3g}%) [%]", "highest level"]
    return Table("Kinds of shapers", head, rows)


def _robustness(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> Table:
    """V at the design's frequency and at others: a row for each kind."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    rows = []
    for name, one in sequences.items():
        left = [100.0 * one.residual_vibration((1.0 + by) * w, zeta) for by in WRONG_BY]
        rows.append([name, *(f"{v:.2f}" for v in left)])
    head = ["kind", *("as designed" if by == 0.0 else f"{by:+.0%}" for by in WRONG_BY)]
    return Table("Residual vibration V [%], where the actual frequency is off by", head, rows)


def _figures(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> list[Figure]:
    w, zeta = mode.natural_frequency, mode.damping_ratio
    ratios = np.linspace(0.5, 1.5, 501)
    curves = [Line(name, ratios, 100.0 * sensitivity_curve(one, w, zeta, ratios)) for name, one in sequences.items()]
    end = 1.05 * max(one.duration for one in sequences.values())
    steps = [
        line
        for name, one in sequences.items()
        for line in staircase("", name, one.delays, np.cumsum(one.amplitudes).tolist(), end or 1.0).lines
    ]
    level = [(100.0 * mode.tolerance, f"{100.0 * mode.tolerance:.3g} %")]
    title = "Residual vibration over a wrong frequency"
    return [
        Figure("sensitivity", title, "actual / design frequency", "residual vibration V [%]", curves, level),
        Figure("steps", "A unit step, shaped", "time [s]", "shaped step", steps),
    ]
