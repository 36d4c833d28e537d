"""Impulses that bring a swinging load to a new speed, or to rest: shaping from a swinging start, in closed form.

With the mode's deflection q from the base, q'' + 2 zeta w q' + w^2 q = -a, its pole p = w (-zeta + j sqrt(1 - zeta^2)) and
z = q' - conj(p) q, a jump v of the base's speed changes z by -v. So jumps v_i at the times t_i end at rest if
sum v_i exp(-p t_i) = z(0). Two of them, at t1 and s later, that add up to a step V have with Z = z(0) exp(p t1):

    v2 = (V - Z) / (1 - exp(-p s)),        a real number: Im ((V - Z) (1 - exp(-conj(p) s))) = 0.

Undamped: wd s = 2 atan2(V - Re Z, -Im Z) and v2 = |V - Z|^2 / (2 (V - Re Z)). Both have the sign of V if |Z| < |V|, that is if
the load swings slower than the step. Without a swing this is the ZV shaper (Smith 1958).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.optimize import brentq

from shaper_fmu.errors import ArgumentError, NoSolutionError

_PER_PERIOD = 360
"""Waits, and times between the jumps, that are looked at in a period."""


@dataclass(frozen=True)
class StartImpulses:
    """Jumps of the base's speed.

    Attributes:
        times: their times [s], rising.
        sizes: their sizes [m/s], which add up to the step.
    """

    times: tuple[float, ...]
    sizes: tuple[float, ...]

    @property
    def duration(self) -> float:
        """Time of the last jump [s]."""
        return self.times[-1] if self.times else 0.0

    def swing_left(self, w: float, damping_ratio: float = 0.0, deflection: float = 0.0, rate: float = 0.0) -> float:
        """|z| [m/s] after the last jump, of a mode [rad/s] that began with this deflection [m] and rate [m/s]."""
        p = _pole(w, damping_ratio)
        z = (rate - p.conjugate() * deflection) * cmath.exp(p * self.duration)
        return abs(z - sum(v * cmath.exp(p * (self.duration - t)) for t, v in zip(self.times, self.sizes, strict=True)))


def impulses_from_swing(
    step: float,
    natural_frequency: float,
    damping_ratio: float = 0.0,
    *,
    deflection: float = 0.0,
    rate: float = 0.0,
    largest: float = math.inf,
) -> StartImpulses:
    """Two jumps of the base's speed that add up to a step, after which a mode that swings at the start is at rest.

    Args:
        step: change of the base's speed [m/s]; 0 only takes the swing away.
        natural_frequency, damping_ratio: of the mode [rad/s, -].
        deflection, rate: the mode's deflection from the base at time 0 and its rate [m, m/s]; of a load on a rope, length
            times the swing angle and its rate, positive ahead.
        largest: the largest size of a jump [m/s]. If the first jump at time 0 asks for more, it waits until it does not.

    Raises ArgumentError for values outside their domains, and NoSolutionError, which names the least size, if none is small enough.
    """
    for name, value in (("step", step), ("deflection", deflection), ("rate", rate)):
        if not math.isfinite(value):
            raise ArgumentError(f"{name} = {value}: must be a finite number")
    if not 0.0 < natural_frequency < math.inf or not 0.0 <= damping_ratio < 1.0:
        raise ArgumentError(f"a mode needs w > 0 and 0 <= zeta < 1, not w = {natural_frequency}, zeta = {damping_ratio}")
    if not largest > 0.0:
        raise ArgumentError(f"largest = {largest}: must be greater than 0")
    p = _pole(natural_frequency, damping_ratio)
    z = rate - p.conjugate() * deflection
    if step == 0.0 and z == 0.0:
        return StartImpulses((), ())
    least = math.inf
    period = 2.0 * math.pi / p.imag
    for i in range(_PER_PERIOD + 1):
        wait = i * period / _PER_PERIOD
        found = _after(p, z, step, wait)
        size = max(map(abs, found.sizes))
        least = min(least, size)
        if size <= largest and size < math.inf:
            if i == 0 or largest == math.inf:  # the shorter the wait, the larger the jumps, up to any size
                return found
            return _earliest(p, z, step, wait - period / _PER_PERIOD, wait, largest)
    raise NoSolutionError(f"no two jumps of at most {largest:g} m/s do; with {_not_below(least)} m/s there are some")


def _not_below(value: float) -> str:
    """The value, rounded up to six digits or so, so that it is one that does."""
    text = f"{value:.6g}"
    return text if float(text) >= value else f"{value * (1.0 + 5e-6):.6g}"


def _earliest(p: complex, z: complex, step: float, before: float, after: float, largest: float) -> StartImpulses:
    """The first wait between two at which the jumps are small enough."""
    for _ in range(60):
        middle = 0.5 * (before + after)
        if max(map(abs, _after(p, z, step, middle).sizes)) <= largest:
            after = middle
        else:
            before = middle
    return _after(p, z, step, after)


def _after(p: complex, z: complex, step: float, wait: float) -> StartImpulses:
    """The two jumps, the first one after a wait."""
    later = step - z * cmath.exp(p * wait)
    period = 2.0 * math.pi / p.imag
    if later == 0.0:
        return StartImpulses((wait,), (step,))

    def imaginary(s: float) -> float:
        return (later * (1.0 - cmath.exp(-p.conjugate() * s))).imag

    s = 2.0 * (math.atan2(later.real, later.imag) % math.pi) / p.imag
    if p.real < 0.0:
        grid = period * np.arange(1, 2 * _PER_PERIOD) / _PER_PERIOD
        signs = np.sign((later * (1.0 - np.exp(-p.conjugate() * grid))).imag)
        change = np.flatnonzero(signs[1:] != signs[:-1])
        low, high = grid[change[0] : change[0] + 2].tolist() if len(change) else (0.0, 0.0)
        s = cast(float, brentq(imaginary, low, high, xtol=1e-16 * period)) if len(change) else 0.0
    if s <= 0.0:
        return StartImpulses((wait, wait), (math.inf, math.inf))
    second = (later / (1.0 - cmath.exp(-p * s))).real
    return StartImpulses((wait, wait + s), (step - second, second))


def _pole(w: float, damping_ratio: float) -> complex:
    return w * complex(-damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio))
