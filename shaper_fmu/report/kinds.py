"""Shapers of several kinds beside each other: one table, and one figure each of their sensitivity and of a shaped step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shaper_fmu.analysis.vibration import insensitivity, sensitivity_curve
from shaper_fmu.design.figures import staircase
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.page.blocks import Block, Table
from shaper_fmu.page.figures import Figure, Line
from shaper_fmu.report.design import Mode

WRONG_BY = (-0.2, -0.1, 0.1, 0.2)
"""Shares by which the actual frequency is another one than the design's."""


def kinds_blocks(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> list[Block]:
    """Blocks of the page: the table, the sensitivity curves over each other, and a unit step shaped by each."""
    return [kinds_table(sequences, mode), *_figures(sequences, mode)]


def kinds_table(sequences: Mapping[str, ImpulseSequence], mode: Mode) -> Table:
    """Delay, robustness, and what a drive must follow, a row for each kind."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    rows = []
    for name, one in sequences.items():
        levels = np.cumsum(one.amplitudes)
        wrong = [f"{100.0 * one.residual_vibration((1.0 + by) * w, zeta):.3g}" for by in WRONG_BY]
        known = f"{100.0 * one.residual_vibration(w, zeta):.2f}"
        robust = f"{100.0 * insensitivity(one, w, zeta, mode.tolerance):.1f}"
        periods = f"{one.duration * w / (2.0 * np.pi):.3f}"
        largest = f"{max(1.0, float(np.abs(levels).max())):.4g}"
        rows.append([name, f"{one.duration:.4g}", periods, str(len(one.delays)), robust, *wrong[:2], known, *wrong[2:], largest])
    head = ["kind", "delay [s]", "periods", "impulses", f"I({100.0 * mode.tolerance:.3g}%) [%]"]
    head += [f"V {by:+.0%} [%]" for by in WRONG_BY[:2]]
    head += ["V [%]", *(f"V {by:+.0%} [%]" for by in WRONG_BY[2:]), "largest"]
    return Table("Kinds of shapers", head, rows)


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
