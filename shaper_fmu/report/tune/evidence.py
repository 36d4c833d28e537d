"""The evidence for a tuning's modes: the identified free response, its spectrum, and the quality of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shaper_fmu.analysis.identification import Identification
from shaper_fmu.page.blocks import Block, Table, Text
from shaper_fmu.page.figures import Figure, Line, label
from shaper_fmu.report.sweep.curves import thinned
from shaper_fmu.tune.identify.measured_result import MeasuredIdentification
from shaper_fmu.tune.tuning import Tuning

MOST_OUTPUTS = 12
"""Outputs that are shown."""
POLYNOMIAL = ("offset", "drift", "acceleration")
_DEEPEST = -100.0
"""Where a spectrum ends below [dB]."""
_BEYOND = 3.0
"""Frequencies that are shown, over that of the fastest mode."""
_SPREAD = 6.0
"""Fastest over slowest mode from which on the frequency axis is logarithmic."""
_PADDED = 8
_STRETCHES = 800
"""Of a logarithmic axis, for each of which two points are drawn."""
_MOST_PERIODS = 15.0
"""Of the slowest mode, that are shown of a ring-down."""
_RESOLVED = 4.0
"""Times 1 / duration: below there is nothing to see in a spectrum."""


@dataclass(frozen=True)
class Evidence:
    """The free response of the nominal experiment or of measured data.

    Attributes:
        found: what was identified.
        time: of the samples [s], shape (n,), on the experiment's or the file's clock.
        response: shape (n, m), in the outputs' units.
        outputs, units: short names, and units.
        shown: the outputs to be shown.
        forced: whether a command excites the response throughout.
    """

    found: Identification
    time: np.ndarray
    response: np.ndarray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    shown: tuple[str, ...]
    forced: bool = False

    def column(self, output: str) -> int:
        """Place of an output in the response."""
        return self.outputs.index(output)

    def label(self, output: str) -> str:
        """Label of an output's axis."""
        return label(output, self.units[self.column(output)])

    def swinging(self) -> list[tuple[float, str]]:
        """Frequencies [Hz] of the modes, by their numbers, and of pairs of poles that grow."""
        modes = [(mode.frequency, f"mode {k}") for k, mode in enumerate(self.found.modes, 1)]
        growing = [one for one in self.found.others if one.kind == "unstable"]
        return modes + [(one.pole.imag / (2.0 * np.pi), "unstable") for one in growing]

    def grows(self) -> bool:
        """Whether the response grows, so that its end dominates."""
        return any(one.kind in ("unstable", "growth") for one in self.found.others)

    def fitted(self) -> np.ndarray:
        """The sum of modes and other poles, or what the fit makes of the command, shape (n, m)."""
        if self.forced:
            return self.response - self.found.residual[:, 0]
        return self.found.response(self.time - self.time[0])

    def polynomial(self) -> np.ndarray:
        """The polynomial part: offset, drift and acceleration, shape (n, m)."""
        parts = tuple(one for one in self.found.others if one.kind in POLYNOMIAL)
        return replace(self.found, modes=(), others=parts).response(self.time - self.time[0])


def evidence(tuning: Tuning) -> Evidence:
    """The nominal experiment's free response, or the measured one."""
    if tuning.plant is None:
        assert tuning.measured is not None  # a tuning has either
        seen = tuning.measured
        found = Evidence(seen.identification, seen.time, seen.response, seen.outputs, seen.units, (), seen.forced is not None)
    else:
        seen = tuning.plant.nominal
        names = [tuning.system.short(name) if tuning.system is not None else name for name in seen.outputs]
        found = Evidence(seen.identification, seen.time, seen.response, tuple(names), seen.units, ())
    return replace(found, shown=tuple(liveliest(found, tuning.outputs)))


def liveliest(found: Evidence, outputs: tuple[str, ...], most: int = MOST_OUTPUTS) -> list[str]:
    """The outputs that vibrate most, in their order: by amplitude over the largest one of any output of the same unit."""
    if len(outputs) <= most:
        return list(outputs)
    modes = found.found.modes
    size = np.sum([np.abs(mode.residues[0]) for mode in modes], axis=0) if modes else np.ptp(found.response, axis=0)
    units = np.array(found.units)
    largest = np.array([size[units == unit].max() for unit in found.units])
    relative = {name: size[found.column(name)] / max(1e-300, largest[found.column(name)]) for name in outputs}
    kept = sorted(outputs, key=lambda name: -relative[name])[:most]
    return [name for name in outputs if name in kept]


def spectrum_blocks(found: Evidence) -> list[Block]:
    """Amplitude spectra of the free response and of the fit."""
    kept = "end" if found.grows() else "beginning"
    text = (
        f"Amplitude spectra (half of a Hann window, which keeps the {kept}) of the free response and of the fit, less offset and "
        "drift, relative to the largest amplitude of the response."
    )
    if found.swinging():
        text += " Vertical lines: damped frequencies of the modes."
    return [Text(text), *(spectrum_figure(found, number, output) for number, output in enumerate(found.shown, 1))]


def amplitude_spectrum(values: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies above 0 [Hz], shape (k,), and amplitudes, shape (k, m), of values of shape (n, m).

    The window is the falling half of Hann's: fast decays are seen as large as they begin, which a whole window hides, and the end
    of the record leaves no trace. Padded with zeros to several times the length, so that what is between the bins is seen.
    """
    n = len(values)
    window = np.cos(0.5 * np.pi * np.arange(n) / n) ** 2
    length = 2 ** int(np.ceil(np.log2(_PADDED * n)))
    found = np.abs(np.fft.rfft(values * window[:, None], length, axis=0)) * 2.0 / window.sum()
    return np.fft.rfftfreq(length, step)[1:], found[1:]


def spectrum_figure(found: Evidence, number: int, output: str) -> Figure:
    """One output's spectrum [dB] over frequency [Hz], with the modes marked."""
    j, rest = found.column(output), found.polynomial()
    both = np.column_stack([(one - rest)[:, j] for one in (found.response, found.fitted())])
    frequency, amplitude = amplitude_spectrum(both[::-1] if found.grows() else both, found.found.step)
    marks = found.swinging()
    ends = shown_frequencies([value for value, _ in marks], float(frequency[-1]), found.found.step * len(both))
    shown = (frequency >= ends[0]) & (frequency <= ends[1])
    frequency, amplitude = frequency[shown], amplitude[shown]
    level = 20.0 * np.log10(np.maximum(amplitude, 1e-300) / max(1e-300, float(amplitude[:, 0].max())))
    level[level < _DEEPEST] = np.nan
    thin = thinned if ends[0] == 0.0 else thinned_by_octave
    lines = [Line(name, *thin(frequency, level[:, k])) for k, name in enumerate(("response", "fit"))]
    return Figure(
        f"spectrum_{number}",
        f"Amplitude spectrum of {output}",
        "frequency [Hz]",
        "amplitude [dB of the largest]",
        lines,
        marks=[(value, text) for value, text in marks if ends[0] <= value <= ends[1]],
        log_x=ends[0] > 0.0,
    )


def thinned_by_octave(frequency: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for a logarithmic axis: of each of many stretches of it the least and the greatest value, shapes (k,)."""
    edges = np.searchsorted(frequency, np.geomspace(frequency[0], frequency[-1], _STRETCHES)[1:-1])
    kept = {0, len(frequency) - 1}
    for stretch in np.split(np.arange(len(frequency)), edges):
        inside = stretch[~np.isnan(level[stretch])]
        if len(inside):
            kept |= {int(inside[np.argmin(level[inside])]), int(inside[np.argmax(level[inside])])}
    order = sorted(kept)
    return frequency[order], level[order]


def shown_frequencies(modes: list[float], highest: float, duration: float) -> tuple[float, float]:
    """Least and largest frequency [Hz] of a spectrum; the least is above 0 for a logarithmic axis."""
    if not modes:
        return 1.0 / duration, highest
    least = min(modes) / _SPREAD**0.5
    logarithmic = max(modes) > _SPREAD * min(modes)
    return (max(least, min(_RESOLVED / duration, 0.7 * min(modes))) if logarithmic else 0.0), min(highest, _BEYOND * max(modes))


def recording_blocks(measured: MeasuredIdentification | None, shown: Sequence[str]) -> list[Block]:
    """A recording of which a part was cut out, with the place where that begins."""
    if measured is None or measured.recording is None:
        return []
    time, values = measured.recording
    begin, end = measured.span
    text = f"Of the recording from {time[0]:.5g} to {time[-1]:.5g} s the part from {begin:.5g} to {end:.5g} s was taken as free."
    marks = [(begin, "free from here on")]
    if measured.parts:
        told = "; ".join(f"{first:.5g} to {last:.5g} s" for first, last in measured.parts)
        text = (
            f"Of the recording from {time[0]:.5g} to {time[-1]:.5g} s {len(measured.parts)} ring-downs were cut out, and each was "
            f"identified: {told}. The first one is shown below."
        )
        marks = [(first, f"ring-down {number}") for number, (first, _) in enumerate(measured.parts, 1)]
        marks += [(last, "its end") for _, last in measured.parts]
    if measured.law is not None:
        text = (
            f"The recording lasts from {time[0]:.5g} to {time[-1]:.5g} s. From {begin:.5g} to {end:.5g} s it sweeps from "
            f"{measured.law.first:.4g} to {measured.law.last:.4g} Hz. The response below is that to an impulse, within the band of "
            "the sweep, which the recording divided by the spectrum of the sweep gives."
        )
        marks = [(begin, f"{measured.law.first:.3g} Hz"), (end, f"{measured.law.last:.3g} Hz")]
    blocks: list[Block] = [Text(text)]
    for number, output in enumerate(shown, 1):
        j = measured.outputs.index(output)
        line = Line(output, *thinned(time, values[:, j]))
        title, y_label = f"The whole recording of {output}", label(output, measured.units[j])
        blocks.append(Figure(f"recording_{number}", title, "time [s]", y_label, [line], marks=marks))
    return blocks


def ring_down_blocks(found: Evidence) -> list[Block]:
    """The free response, its fit, and the residual over time."""
    rows = []
    for output in found.shown:
        j, unit = found.column(output), found.units[found.column(output)]
        left, signal = float(np.sqrt(np.mean(found.found.residual[:, 0, j] ** 2))), float(found.found.signal[0, j])
        share = f"{left / signal:.2g}" if signal > 0.0 else "-"
        rows.append([output, f"{signal:.5g} {unit}".rstrip(), f"{left:.3g} {unit}".rstrip(), share])
    table = Table("What the fit leaves", ["output", "RMS of the response", "RMS of the residual", "share"], rows)
    return [table, *(ring_down_figure(found, number, output) for number, output in enumerate(found.shown, 1))]


def ring_down_figure(found: Evidence, number: int, output: str) -> Figure:
    """One output's response and the fit."""
    j, periods = found.column(output), [mode.period for mode in found.found.modes]
    duration = float(found.time[-1] - found.time[0])
    shown = min(duration, _MOST_PERIODS * max(periods, default=duration))
    first = found.time <= found.time[0] + shown * (1.0 + 1e-9)
    lines = [
        Line(name, *thinned(found.time[first], values[first, j]))
        for name, values in (("response", found.response), ("fit", found.fitted()))
    ]
    few = f", the first {shown:.3g} of {duration:.3g} s" if shown < duration else ""
    return Figure(
        f"ring_down_{number}",
        f"{'Response' if found.forced else 'Free response'} of {output}, and the fit{few}",
        "time [s]",
        found.label(output),
        lines,
    )
