"""A bound on the share of a mode that the noise may hide, which the bounds for the modes found do not cover."""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.analysis.identification import Identification

_SURE = 2.33
"""Standard deviations: such a mode is lost in one of a hundred records."""


def hidden_share(found: Identification) -> float:
    """Amplitude of the largest mode that the noise may hide, over the sum of all modes' amplitudes, in the worst output; 0 to 1.

    The criterion prefers a model with a further mode if twice the log likelihood gains (4 + 2 c) log(n c), with c outputs and n
    samples; the gain is a noncentral chi-squared number of 2 + 2 c degrees, its centre the mode's energy over the noise's variance.
    The mode is taken to decay as quickly as the quickest one found. Outputs that show no more than that themselves are passed over.
    """
    rate = max((-mode.pole.real for mode in found.modes), default=0.0)
    return _hidden(found, 0.5 * float(np.sum(np.exp(-2.0 * max(0.0, rate) * found.time))))


def hidden_of_forced(found: Identification, weakest: float) -> float:
    """The same for the response to a command, where a mode of amplitude 1 after a unit step has this energy at least."""
    return _hidden(found, weakest)


def _hidden(found: Identification, energy: float) -> float:
    n, c = found.samples, len(found.names)
    threshold = (4 + 2 * c) * math.log(n * c)
    centre = max(0.0, threshold - 2 - 2 * c) + 2.0 * _SURE * math.sqrt(threshold)
    amplitudes = np.sum([np.abs(mode.residues[0]) for mode in found.modes], axis=0)
    hidden = found.noise[0] * math.sqrt(centre / energy)
    seen = amplitudes > hidden
    return float(np.max(hidden[seen] / (amplitudes + hidden)[seen], initial=0.0)) if seen.any() else 1.0
