"""Reports of designed commands: numbers, figures of merit, sensitivity curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shaper_fmu.analysis.vibration import Command, damping_curve, relative_residual, sensitivity_curve, tolerated_band
from shaper_fmu.design.figures import move_figures, staircase
from shaper_fmu.design.floor import distance_to_floor
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.profiles import Profile
from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.errors import ComponentError
from shaper_fmu.page.blocks import Block, Table
from shaper_fmu.page.figures import Figure, Line


@dataclass(frozen=True)
class Mode:
    """The mode for which a command is judged: frequency [rad/s], damping ratio, tolerated V."""

    natural_frequency: float
    damping_ratio: float
    tolerance: float


def shaper_blocks(name: str, sequence: ImpulseSequence, mode: Mode) -> list[Block]:
    """Blocks of the page for a shaper."""
    levels = np.cumsum(sequence.amplitudes)
    impulses = [
        [str(i + 1), f"{t:.10g}", f"{a:.10f}", f"{level:.10f}"]
        for i, (t, a, level) in enumerate(zip(sequence.delays, sequence.amplitudes, levels, strict=True))
    ]
    merits = [*merits_of(sequence, mode), ["above the floor of positive shapers", _floor_text(sequence, mode)]]
    return [
        Table("Impulses", ["impulse", "delay [s]", "amplitude", "level of a step"], impulses),
        Table("Figures of merit", ["what", "value"], [*merits, _certificate(sequence.certificate)]),
        *sensitivity_figures(name, sequence, mode),
        staircase(f"A unit step, shaped by {name}", name, sequence.delays, levels.tolist(), sequence.duration),
    ]


def profile_blocks(name: str, law: Profile, mode: Mode) -> list[Block]:
    """Blocks of the page for a motion profile."""
    merits = [
        ["shortest duration within the limits", f"{law.shortest_duration:.9g} s"],
        ["peak speed", f"{law.peak_velocity:.9g} m/s"],
        ["peak acceleration", f"{law.peak_acceleration:.9g} m/s2"],
        ["jumps at", ", ".join(f"{t:.9g} s" for t in law.jumps) or "none"],
        *merits_of(law, mode),
    ]
    return [Table("Figures of merit", ["what", "value"], merits), *sensitivity_figures(name, law, mode), *move_figures(name, law)]


def pulse_blocks(name: str, pulses: PulseSequence, mode: Mode) -> list[Block]:
    """Blocks of the page for an on/off command."""
    switches = [
        [str(i + 1), f"{t:.10g}", f"{level:g}"] for i, (t, level) in enumerate(zip(pulses.switch_times, pulses.levels, strict=True))
    ]
    merits = [
        ["pulses", str(pulses.pulses)],
        ["shortest pulse or gap", f"{pulses.minimum_pulse_width:.6g} s"],
        *merits_of(pulses, mode),
        _certificate(pulses.certificate),
    ]
    return [
        Table("Switches", ["switch", "time [s]", "level after it"], switches),
        Table("Figures of merit", ["what", "value"], merits),
        *sensitivity_figures(name, pulses, mode),
        staircase(f"The on/off command {name}", name, pulses.switch_times, pulses.levels, pulses.travel_time),
    ]


def merits_of(command: Command, mode: Mode) -> list[list[str]]:
    """Duration, residual by both measures, insensitivity."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    band = tolerated_band(command, w, zeta, mode.tolerance)
    return [
        ["duration", f"{command.duration:.9g} s ({command.duration * w / (2.0 * np.pi):.4f} undamped periods)"],
        ["residual V at the design frequency", f"{command.residual_vibration(w, zeta):.3e}"],
        ["residual relative to the unshaped step's", f"{relative_residual(command, w, zeta):.3e}"],
        [f"insensitivity I({mode.tolerance:.0%})", f"{band[1] - band[0]:.5f}" if band else "0"],
        ["tolerated frequencies w/wn", f"{band[0]:.5f} to {band[1]:.5f}" if band else "none"],
        *([["tolerated frequencies", _band_text(band[0] * w, band[1] * w)]] if band else []),
    ]


def _band_text(low: float, high: float) -> str:
    return f"{low:.5g} to {high:.5g} rad/s ({low / (2.0 * np.pi):.4g} to {high / (2.0 * np.pi):.4g} Hz)"


def _certificate(certificate: float) -> list[str]:
    return ["certificate (residual of the defining equations)", "none" if np.isnan(certificate) else f"{certificate:.1e}"]


def _floor_text(sequence: ImpulseSequence, mode: Mode) -> str:
    try:
        distance = distance_to_floor(sequence, mode.natural_frequency, mode.tolerance, mode.damping_ratio)
    except ComponentError as error:
        return f"not known: {error}"
    return "no floor applies" if distance is None else f"{max(0.0, distance):.2%}"


def sensitivity_figures(name: str, command: Command, mode: Mode) -> list[Figure]:
    """V in percent over the ratio of the actual to the design frequency, and over the actual damping ratio."""
    w, zeta = mode.natural_frequency, mode.damping_ratio
    band = tolerated_band(command, w, zeta, mode.tolerance)
    ratios = np.unique(np.concatenate([np.linspace(0.02, 2.0, 991), [r for r in band or () if r < 2.0]]))
    dampings = np.linspace(0.0, min(0.99, max(0.3, 2.0 * zeta)), 200)
    lines = [Line(name, ratios, 100.0 * sensitivity_curve(command, w, zeta, ratios))]
    damping_lines = [Line(name, dampings, 100.0 * damping_curve(command, w, dampings))]
    marks = [(edge, f"{edge:.3f}") for edge in band or () if edge < 2.0]
    levels, value = [(100.0 * mode.tolerance, f"{mode.tolerance:.0%}")], "residual vibration V [%]"
    title = f"Sensitivity of {name}: residual vibration over a wrong"
    return [
        Figure("sensitivity", f"{title} frequency", "actual / design frequency", value, lines, levels, marks),
        Figure("damping", f"{title} damping ratio", "actual damping ratio", value, damping_lines, levels, [(zeta, "design")]),
    ]
