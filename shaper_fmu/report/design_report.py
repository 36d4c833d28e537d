"""The report of a designed shaper: its impulses, its figures of merit, its sensitivity curve."""

from __future__ import annotations

import numpy as np

from shaper_fmu.analysis.vibration import damping_curve, sensitivity_curve, tolerated_band
from shaper_fmu.errors import ComponentError
from shaper_fmu.report.figures import Figure, Line
from shaper_fmu.report.page import Block, Table
from shaper_fmu.shapers.floor import distance_to_floor
from shaper_fmu.shapers.sequence import ImpulseSequence


def impulse_table(sequence: ImpulseSequence) -> Table:
    """The impulses, and the level that a unit step has reached after each."""
    levels = np.cumsum(sequence.amplitudes)
    rows = [
        [str(i + 1), f"{t:.10g}", f"{a:.10f}", f"{level:.10f}"]
        for i, (t, a, level) in enumerate(zip(sequence.delays, sequence.amplitudes, levels, strict=True))
    ]
    return Table("Impulses", ["impulse", "delay [s]", "amplitude", "level of a step"], rows)


def merit_table(sequence: ImpulseSequence, natural_frequency: float, damping_ratio: float, tolerance: float) -> Table:
    """Duration, residual, insensitivity, distance to the floor, certificate."""
    band = tolerated_band(sequence, natural_frequency, damping_ratio, tolerance)
    floor = _floor_text(sequence, natural_frequency, damping_ratio, tolerance)
    periods = sequence.duration * natural_frequency / (2.0 * np.pi)
    rows = [
        ["duration", f"{sequence.duration:.9g} s ({periods:.4f} undamped periods)"],
        ["residual vibration V at the design frequency", f"{sequence.residual_vibration(natural_frequency, damping_ratio):.3e}"],
        [f"insensitivity I({tolerance:.0%})", f"{band[1] - band[0]:.5f}" if band else "0"],
        ["tolerated frequencies w/wn", f"{band[0]:.5f} to {band[1]:.5f}" if band else "none"],
        ["above the floor of positive shapers", floor],
        ["certificate (residual of the defining equations)", f"{sequence.certificate:.1e}"],
    ]
    return Table("Figures of merit", ["what", "value"], rows)


def _floor_text(sequence: ImpulseSequence, natural_frequency: float, damping_ratio: float, tolerance: float) -> str:
    try:
        distance = distance_to_floor(sequence, natural_frequency, tolerance, damping_ratio)
    except ComponentError as error:
        return f"not known: {error}"
    return "no floor applies" if distance is None else f"{max(0.0, distance):.2%}"


def sensitivity_figure(
    name: str, sequence: ImpulseSequence, natural_frequency: float, damping_ratio: float, tolerance: float
) -> Figure:
    """V in percent over the ratio of the actual to the design frequency."""
    band = tolerated_band(sequence, natural_frequency, damping_ratio, tolerance)
    ratios = np.unique(np.concatenate([np.linspace(0.02, 2.0, 991), band or []]))
    curve = 100.0 * sensitivity_curve(sequence, natural_frequency, damping_ratio, ratios)
    marks = [(edge, f"{edge:.3f}") for edge in band] if band else []
    title = f"Sensitivity of {name}: residual vibration over a wrong frequency"
    levels = [(100.0 * tolerance, f"{tolerance:.0%}")]
    return Figure(
        "sensitivity", title, "actual / design frequency", "residual vibration V [%]", [Line(name, ratios, curve)], levels, marks
    )


def damping_figure(
    name: str, sequence: ImpulseSequence, natural_frequency: float, damping_ratio: float, tolerance: float
) -> Figure:
    """V in percent over the actual damping ratio."""
    ratios = np.linspace(0.0, min(0.99, max(0.3, 2.0 * damping_ratio)), 200)
    curve = 100.0 * damping_curve(sequence, natural_frequency, ratios)
    title = f"Sensitivity of {name}: residual vibration over a wrong damping ratio"
    levels, marks = [(100.0 * tolerance, f"{tolerance:.0%}")], [(damping_ratio, "design")]
    return Figure("damping", title, "actual damping ratio", "residual vibration V [%]", [Line(name, ratios, curve)], levels, marks)


def step_figure(name: str, sequence: ImpulseSequence) -> Figure:
    """A unit step as it leaves the shaper."""
    end = 1.15 * sequence.duration or 1.0
    times = np.repeat([0.0, *sequence.delays, end], 2)[1:-1]
    values = np.repeat([0.0, *np.cumsum(sequence.amplitudes)], 2)
    line = Line(name, times, values)
    return Figure("step", f"A unit step, shaped by {name}", "time [s]", "command", [line])


def design_blocks(
    name: str, sequence: ImpulseSequence, natural_frequency: float, damping_ratio: float, tolerance: float
) -> list[Block]:
    """Blocks of the page for a shaper; the figures of merit are for the given mode."""
    arguments = (sequence, natural_frequency, damping_ratio, tolerance)
    figures = [sensitivity_figure(name, *arguments), damping_figure(name, *arguments), step_figure(name, sequence)]
    return [merit_table(*arguments), impulse_table(sequence), *figures]
