"""The inverse of a shaper with a distributed delay, for the feedback path of a sampled loop.

With the shaper S outside of a loop nothing that the loop does by itself is shaped: a disturbance makes it move, and the mode
swings. With 1/S in the feedback path (Vyhlidal, Hromcik, Kucera and Anderle 2016), u = C (reference - y/S), the plant G meets

    u + disturbance = S (C reference + disturbance)/(S + C G),

so that the zeros of S are those of all that moves the plant: neither set points nor disturbances at its input excite the mode. The
shaper is the sampled DZV of smoothers/sampled.py.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ArgumentError, NoSolutionError
from shaper_fmu.smoothers.sampled import FEWEST_SAMPLES, MOST_SAMPLES, largest_gain, sampled_dzv, samples_of


@dataclass(frozen=True)
class InverseShaper:
    """A distributed-delay shaper of a sampled command, and its inverse.

    Attributes:
        sample_period: of the loop [s].
        amplitudes: of the command now, and one, two, ... samples ago; their sum is 1.
    """

    sample_period: float
    amplitudes: tuple[float, ...]

    @property
    def direct(self) -> float:
        """A, the share at once: the inverse passes a jump on enlarged by 1/A, at once (a direct feedthrough)."""
        return self.amplitudes[0]

    @property
    def shaper(self) -> ImpulseSequence:
        """The shaper itself, as impulses a sample apart."""
        return ImpulseSequence(self.amplitudes, tuple(self.sample_period * k for k in range(len(self.amplitudes))))

    @property
    def largest_pole(self) -> float:
        """The largest magnitude of the inverse's poles: less than 1, it is stable."""
        return float(np.abs(np.roots(self.amplitudes)).max())

    @property
    def peak_gain(self) -> float:
        """The most by which the inverse amplifies a sine, near the mode; where C G is below 1/this, the loop's gain is below 1."""
        return largest_gain(len(self.amplitudes) - 1, self.amplitudes[0], self.amplitudes[1], self.amplitudes[-1])

    def response(self, w: np.ndarray) -> np.ndarray:
        """S(exp(j w h)) of the shaper at the frequencies w [rad/s]; that of the inverse is one over it."""
        return np.polynomial.polynomial.polyval(np.exp(-1j * self.sample_period * np.asarray(w)), np.array(self.amplitudes))

    def running(self, initial: float = 0.0) -> Callable[[float], float]:
        """The inverse as a function to be called once a sample: takes y_k, returns u_k. Before the first call all was `initial`."""
        before = deque([initial] * (len(self.amplitudes) - 1), len(self.amplitudes) - 1)
        weights = self.amplitudes[1:]

        def step(value: float) -> float:
            found = (value - math.fsum(a * u for a, u in zip(weights, before, strict=True))) / self.direct
            before.appendleft(found)
            return found

        return step


def inverse_shaper(natural_frequency: float, damping_ratio: float, sample_period: float) -> InverseShaper:
    """The inverse of DZV for a mode [rad/s], with a zero exactly on it, for a loop that is sampled every `sample_period` [s].

    Raises ArgumentError for impossible arguments, and NoSolutionError where the share at once is so small that the inverse is not
    stable or does not exist: without damping it is 0.
    """
    w, zeta, h = natural_frequency, damping_ratio, sample_period
    if not (0.0 < w < math.inf and 0.0 <= zeta < 1.0):
        raise ArgumentError(f"a mode needs w > 0 and 0 <= zeta < 1, not w = {w}, zeta = {zeta}")
    if not 0.0 < h < math.inf:
        raise ArgumentError(f"sample_period = {h}: must be greater than 0 and finite [s]")
    if zeta == 0.0:
        raise NoSolutionError("damping_ratio = 0: nothing of the command passes at once, and there is no inverse; it needs damping")
    samples = samples_of(w, zeta, h)
    if not FEWEST_SAMPLES <= samples <= MOST_SAMPLES:
        raise ArgumentError(
            f"sample_period = {h:g} s: the shaper takes {samples * h:.4g} s, {samples:.3g} samples; "
            f"limits: {FEWEST_SAMPLES} to {MOST_SAMPLES}"
        )
    n, share, other, last = sampled_dzv(w, zeta, h)
    if n and other < share:
        return InverseShaper(h, (share, *[other] * (n - 1), last))
    raise NoSolutionError(
        f"the share at once is A = {share:.4g}, that of each sample after it {other:.4g}: A must be larger for a stable inverse; "
        f"sample faster than every {h:g} s, or damp the mode (zeta = {zeta:g})"
    )
