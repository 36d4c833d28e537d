"""Reports of moves: the fastest one without vibration, and how far others are above it."""

from __future__ import annotations

import math

from shaper_fmu.design.fastest import FastestMove
from shaper_fmu.design.figures import move_figures
from shaper_fmu.design.floor_of_moves import move_floor
from shaper_fmu.design.profiles import Profile
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.shapers import SHAPERS
from shaper_fmu.page.blocks import Block, Table
from shaper_fmu.report.design import Mode, merits_of, sensitivity_figures


def fastest_blocks(move: FastestMove, mode: Mode) -> list[Block]:
    """Blocks of the page for the fastest move; the sensitivity is that to its first mode."""
    rows = [
        [str(i + 1), *(f"{value:.10g}" for value in (s.start, s.duration, s.position, s.velocity, s.acceleration, s.jerk))]
        for i, s in enumerate(move.segments)
    ]
    heads = ["segment", "start [s]", "duration [s]", "position [m]", "velocity [m/s]", "acceleration [m/s2]", "jerk [m/s3]"]
    merits = [
        ["proven: no move is shorter than", f"{move.lower_bound:.9g} s ({move.duration / move.lower_bound - 1.0:.3%} less)"],
        ["fastest move with vibration", f"{move.duration_with_vibration:.9g} s"],
        ["peak speed", f"{move.peak_velocity:.9g} m/s"],
        ["peak acceleration", f"{move.peak_acceleration:.9g} m/s2"],
        *merits_of(move, mode),
    ]
    modes = [
        [
            _span(band.low, band.high, "g"),
            _span(band.low / (2.0 * math.pi), band.high / (2.0 * math.pi), ".4g"),
            f"{band.damping_ratio:g}",
            f"{100.0 * band.tolerance:g} %",
            f"{100.0 * v:.3g} %",
            f"{move.peak_deflection(band.low, band.damping_ratio):.6g}" if band.low == band.high else "",
        ]
        for band, v in zip(move.modes, move.residuals, strict=True)
    ]
    return [
        Table("Segments", heads, rows),
        Table("Modes", ["frequency [rad/s]", "[Hz]", "damping ratio", "tolerated V", "largest V", "peak deflection [m]"], modes),
        Table("Figures of merit", ["what", "value"], merits),
        *sensitivity_figures("fastest", move, mode),
        *move_figures("fastest", move),
    ]


def _span(low: float, high: float, digits: str) -> str:
    return f"{low:{digits}}" if low == high else f"{low:{digits}} to {high:{digits}}"


def floor_blocks(law: Profile, mode: Mode) -> list[Block]:
    """How far a profile is above the floor of moves, alone and through every shaper that keeps its limits."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    rows, floor = [], 0.0
    for name in ("none", *(name for name, method in SHAPERS.items() if not method.negative)):
        try:
            behind = None if name == "none" else shaper(name, w, zeta)
            v = law.residual_vibration(w, zeta) * (behind.residual_vibration(w, zeta) if behind else 1.0)
            found = move_floor(law, w, zeta, behind, mode.tolerance) if v <= mode.tolerance else None
        except ComponentError:  # no such shaper at this damping ratio, or no exact floor
            continue
        duration = law.duration + (behind.duration if behind else 0.0)
        if found is not None:
            floor = found.floor
        above = f"{max(0.0, found.above):.2%}" if found is not None else "leaves more"
        rows.append([name, f"{duration:.6g} s", f"{100.0 * v:.3g} %", above])
    if floor == 0.0:
        return []
    title = f"Floor of moves: within these limits none with V <= {mode.tolerance:.0%} is shorter than {floor:.6g} s"
    return [Table(title, ["shaper", "duration", "V", "above the floor"], rows)]
