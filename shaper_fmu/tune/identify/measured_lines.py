"""Motions that do not decay over a record: hums and lines, which no command excites, and undamped modes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shaper_fmu.analysis.identification import Finding, FreeResponse, Identification, Mode, OtherPole

_FADING = 0.02
"""A mode whose amplitude falls by less than this share over the record may be kept up by something."""
_MAINS = (50.0, 60.0)
_MOST_HARMONICS = 10
_NEAR = 2e-3
"""Distance from a mains frequency, as a share, up to which a line is taken for it."""
_FEWEST_PERIODS = 3.0
_SAME, _ABSENT = 0.35, 0.5
"""What was there before the excitation is the same up to this share; it was not there if it was less than that share."""
_KEPT_UP = (
    "the motion at {:.4g} rad/s does not decay over the record: something may keep it up (a hum, an unbalance, a limit cycle) that "
    "no shaper changes{}. Take a longer record, in which the machine rests except for its vibration, or one that begins at rest"
)
_EXCLUDED = "; it was excluded"
_HUM = "the line at {:.5g} Hz is a hum of the mains or of a drive, {}: it was excluded, since no command excites it"
_EXCITED = (
    "the motion at {:.4g} rad/s does not decay over the record; it was not there before the excitation, and is taken for a mode"
)


def without_lines(found: Identification, before: FreeResponse | None) -> tuple[Identification, list[Finding]]:
    """The identification without lines that no command excites, and findings on all motions that do not decay.

    `before` is the response up to the first sample, at the same distances, if there is any: what was there in the same phase before
    the excitation is a line, what was not there is a mode. Without it a line at a frequency of the mains is taken for a hum; any
    other one is excluded if there are modes besides, but contradicts the identification.
    """
    length = found.step * (found.samples - 1)
    lines: list[Mode] = []
    open_: list[Mode] = []
    findings: list[Finding] = []
    for mode in found.modes:
        if (mode.damping_ratio - 2.0 * mode.damping_ratio_std) * mode.natural_frequency * length >= _FADING:
            continue
        share = _difference(mode, before)
        if share is not None and share[0] < _SAME:
            findings.append(Finding("hum", _HUM.format(mode.frequency, "the same before the excitation")))
            lines.append(mode)
        elif share is not None and share[1] < _ABSENT:
            findings.append(Finding("undamped", _EXCITED.format(mode.natural_frequency)))
        elif _is_of_mains(mode):
            findings.append(Finding("hum", _HUM.format(mode.frequency, "by its frequency")))
            lines.append(mode)
        else:
            open_.append(mode)
    decaying = len(found.modes) - len(lines) - len(open_)
    findings += [Finding("not_decaying", _KEPT_UP.format(mode.natural_frequency, _EXCLUDED if decaying else "")) for mode in open_]
    lines += open_ if decaying else []
    return _without(found, lines), findings


def _difference(mode: Mode, before: FreeResponse | None) -> tuple[float, float] | None:
    """How much the motion before the excitation differs from the line's, and how large it was, as shares; None if unknown."""
    if before is None:
        return None
    n = len(before.values)
    periods = n * before.step / mode.period
    if periods < _FEWEST_PERIODS:
        return None
    count = min(n, math.ceil(max(_FEWEST_PERIODS, 0.5 * periods) * mode.period / before.step))
    time = before.step * (np.arange(count) - n)  # to the first sample of the identification
    output = int(np.argmax(np.abs(mode.residues[0]) / np.maximum(mode.residue_std[0], 1e-300)))
    basis = np.column_stack([np.cos(mode.pole.imag * time), -np.sin(mode.pole.imag * time), np.ones(count), time])
    fitted = np.linalg.lstsq(basis, before.values[:count, output], rcond=None)[0]
    there, here = complex(fitted[0], fitted[1]), complex(mode.residues[0, output])
    return abs(there - here) / abs(here), abs(there) / abs(here)


def _is_of_mains(mode: Mode) -> bool:
    known = [k * mains for mains in _MAINS for k in range(1, _MOST_HARMONICS + 1)]
    deviation = 4.0 * mode.natural_frequency_std / (2.0 * math.pi)
    return any(abs(mode.frequency - line) <= _NEAR * line + deviation for line in known) and deviation < 0.01 * mode.frequency


def _without(found: Identification, lines: list[Mode]) -> Identification:
    """The same with lines as other poles, and the shares of the modes that remain."""
    if not lines:
        return found
    kept = [mode for mode in found.modes if not any(mode is line for line in lines)]
    total = sum((np.abs(mode.residues) for mode in kept), np.zeros_like(found.noise))
    shares = [float(np.max(np.abs(mode.residues) / np.where(total > 0.0, total, 1.0), initial=0.0)) for mode in kept]
    others = [OtherPole("line", line.pole, line.natural_frequency_std, line.residues, line.share) for line in lines]
    modes = tuple(replace(mode, share=share) for mode, share in zip(kept, shares, strict=True))
    return replace(found, modes=modes, others=(*found.others, *others))
