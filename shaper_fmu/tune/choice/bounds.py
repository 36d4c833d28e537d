"""The residual vibration of a command in a mode's box: a proven bound, and values of F at some points."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from shaper_fmu.design.guarantees import Guarantee, guarantee
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ComponentError
from shaper_fmu.tune.choice.boxes import ModeBox

_PROOF_TOLERANCES = (1e-7, 1e-6, 1e-5, 1e-4)
"""How far a proven bound may be above the largest V: the first one that rounding allows."""


@lru_cache(maxsize=1024)
def proven(sequence: ImpulseSequence, box: ModeBox) -> Guarantee:
    """A bound of V over a box. Raises ArgumentError for a command so long that its phase is lost in rounding."""
    for tolerance in _PROOF_TOLERANCES[:-1]:
        try:
            return guarantee(sequence, box.frequencies, box.dampings, tolerance=tolerance)
        except ComponentError:  # finer than rounding allows, or too many cells
            continue
    return guarantee(sequence, box.frequencies, box.dampings, tolerance=_PROOF_TOLERANCES[-1])


def remaining(sequence: ImpulseSequence, box: ModeBox) -> np.ndarray:
    """F = sum A_i exp(p (T - t_i)), V = |F|, at some points of the box's boundary and at its nominal point, the last one.

    Complex, shape (37,).
    """
    w = np.concatenate([np.linspace(*box.frequencies, 9), np.linspace(*box.frequencies, 9), np.repeat(box.frequencies, 9)])
    light, heavy = box.dampings
    zeta = np.concatenate([np.full(9, light), np.full(9, heavy), np.tile(np.linspace(light, heavy, 9), 2)])
    w, zeta = np.append(w, box.natural_frequency.nominal), np.append(zeta, box.damping_ratio.nominal)
    poles = w * (-zeta + 1j * np.sqrt(1.0 - zeta * zeta))
    return np.exp(np.multiply.outer(poles, sequence.duration - np.array(sequence.delays))) @ np.array(sequence.amplitudes)
