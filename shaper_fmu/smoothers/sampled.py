"""DZV for a sampled command, so that it has an inverse: kernel functions.

y_k = A u_k + c (u_(k-1) + ... + u_(k-N+1)) + c' u_(k-N),    A + (N - 1) c + c' = 1,    0 <= c' <= c < A.

A, c and c' follow from this sum and from y's zero at exp(p h), the mode's pole over a sample, exactly: three linear equations. The
inverse u_k = (y_k - ...)/A has the zeros as its poles; their polynomial's coefficients fall, so all are inside of the unit circle
(Enestroem and Kakeya). The distributed delay is that of Vyhlidal, Kucera and Hromcik 2013, the sampled equations and the proof are
ours.
"""

from __future__ import annotations

import math

from shaper_fmu.smoothers.distributed_delay import distributed_length

MOST_SAMPLES = 4096
FEWEST_SAMPLES = 4
_FIRST_TRIED = -1  # of the counts of samples near the delay of a continuous command
_LAST_TRIED = 3
_SCANNED = 512
_NARROWINGS = 80
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def samples_of(natural_frequency: float, damping_ratio: float, sample_period: float) -> float:
    """How many samples DZV takes for the mode [rad/s]; they need not be whole."""
    return distributed_length(damping_ratio, 1.0) / natural_frequency / sample_period


def sampled_dzv(natural_frequency: float, damping_ratio: float, sample_period: float) -> tuple[int, float, float, float]:
    """N, A, c and c' of the fewest samples for which 0 <= c' <= c.

    With c < A where that can be had: without it the inverse is not stable. All are 0 where no number of samples has such shares.
    """
    near = math.floor(samples_of(natural_frequency, damping_ratio, sample_period))
    growth = math.exp(natural_frequency * damping_ratio * sample_period)
    angle = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio) * sample_period
    back = growth * math.cos(angle), -growth * math.sin(angle)  # the factor exp(-p h) of a delay by a sample, at the pole
    first = 0, 0.0, 0.0, 0.0
    for n in range(max(2, near + _FIRST_TRIED), near + _LAST_TRIED + 1):
        a, c, last = _shares(back, n)
        if 0.0 <= last <= c:
            if c < a:
                return n, a, c, last
            if first[0] == 0:
                first = n, a, c, last
    return first


def _shares(back: tuple[float, float], n: int) -> tuple[float, float, float]:
    """A, c and c' for n samples: their sum is 1, and the shaper is 0 where a sample's delay is the factor `back`."""
    real, imaginary = 1.0, 0.0
    between, beside = 0.0, 0.0
    for k in range(1, n + 1):
        real, imaginary = real * back[0] - imaginary * back[1], real * back[1] + imaginary * back[0]
        if k < n:
            between += real
            beside += imaginary
    # 1 + c (between - (n - 1)) + c' (real - 1) = 0 and c beside + c' imaginary = 0
    determinant = (between - (n - 1)) * imaginary - (real - 1.0) * beside
    if determinant == 0.0:
        return 0.0, 0.0, -1.0
    c = -imaginary / determinant
    last = beside / determinant
    return 1.0 - (n - 1) * c - last, c, last


def gain_at(angle: float, n: int, a: float, c: float, last: float) -> float:
    """By how much the inverse amplifies a sine, angle = w h [rad]: 1/|A + c (z + ... + z^(n-1)) + c' z^n|, z = exp(-j angle)."""
    half = math.sin(0.5 * angle)
    width = (n - 1.0) if half == 0.0 else math.sin(0.5 * (n - 1) * angle) / half  # the middle of the sum is at n/2 samples
    real = a + c * width * math.cos(0.5 * n * angle) + last * math.cos(n * angle)
    imaginary = c * width * math.sin(0.5 * n * angle) + last * math.sin(n * angle)
    return 1.0 / math.sqrt(real * real + imaginary * imaginary)


def largest_gain(n: int, a: float, c: float, last: float) -> float:
    """The most by which the inverse amplifies a sine: it is near the mode, a period of which takes about n samples."""
    apart = 1.5 / _SCANNED
    best, most = 0.0, 0.0
    for k in range(_SCANNED):
        angle = min(math.pi, 2.0 * math.pi / n * (0.25 + apart * k))
        gain = gain_at(angle, n, a, c, last)
        if gain > most:
            best, most = angle, gain
    low, high = best - 2.0 * math.pi / n * apart, best + 2.0 * math.pi / n * apart
    for _ in range(_NARROWINGS):
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if gain_at(left, n, a, c, last) > gain_at(right, n, a, c, last):
            high = right
        else:
            low = left
    return gain_at(0.5 * (low + high), n, a, c, last)
