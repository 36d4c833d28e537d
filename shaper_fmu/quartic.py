"""The modes of a system with two degrees of freedom: its characteristic polynomial as two real quadratic factors.

Kernel-compatible. Ferrari's method: the sum y of the factors' constant terms is a root of the resolvent cubic.
"""

from __future__ import annotations

import math

_BISECTIONS = 120


def quadratic_factors(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    """p1, q1, p2, q2 of s^4 + a s^3 + b s^2 + c s + d = (s^2 + p1 s + q1)(s^2 + p2 s + q2), with q1 <= q2.

    For polynomials with d > 0 and no pole to the right of the imaginary axis. Each complex pair is one factor. Of four
    real poles r1 <= r2 <= r3 <= r4 (magnitudes), r1 goes with r4 and r2 with r3: these are the modes' pairs where the
    damping is proportional to the stiffness.
    """
    scale = math.sqrt(math.sqrt(d))  # of s, so that d becomes 1
    a = a / scale
    b = b / scale / scale
    c = c / scale / scale / scale
    y = _largest_sum(a, b, c)
    spread = math.sqrt(max(0.0, (0.5 * y - 1.0) * (0.5 * y + 1.0)))  # (q2 - q1) / 2
    apart = math.sqrt(max(0.0, 0.25 * a * a - b + y))  # |p2 - p1| / 2
    if spread >= apart and spread > 0.0:
        q2 = 0.5 * y + spread
        q1 = 1.0 / q2
        p1 = (c - a * q1) / (q2 - q1)
        p2 = (a * q2 - c) / (q2 - q1)
    elif apart > 0.0:
        p1 = 0.5 * a - apart
        p2 = 0.5 * a + apart
        q1 = (c - p1 * y) / (p2 - p1)
        q2 = y - q1
    else:
        p1, q1, p2, q2 = 0.5 * a, 1.0, 0.5 * a, 1.0
    if p1 * p1 >= 4.0 * q1 and p2 * p2 >= 4.0 * q2:
        low1, high1 = _real_poles(p1, q1)
        low2, high2 = _real_poles(p2, q2)
        smallest, largest = min(low1, low2), max(high1, high2)
        inner1, inner2 = max(low1, low2), min(high1, high2)
        p1, q1 = inner1 + inner2, inner1 * inner2
        p2, q2 = smallest + largest, smallest * largest
    if q2 < q1:
        p1, q1, p2, q2 = p2, q2, p1, q1
    square = scale * scale
    return p1 * scale, q1 * square, p2 * scale, q2 * square


def _largest_sum(a: float, b: float, c: float) -> float:
    """Largest root y of the resolvent cubic for d = 1, which is q1 + q2 >= 2, and at most b."""
    low, high = 2.0, max(2.0, b)
    square = b * b - 3.0 * (a * c - 4.0)
    if square > 0.0:
        minimum = (b + math.sqrt(square)) / 3.0
        if 2.0 < minimum < b:
            if _resolvent(minimum, a, b, c) <= 1e-13 * b * b * b:  # three real roots, or two that coincide
                low = minimum
            else:
                high = minimum
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if _resolvent(middle, a, b, c) > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _resolvent(y: float, a: float, b: float, c: float) -> float:
    """y^3 - b y^2 + (a c - 4) y - (a^2 - 4 b + c^2), written so that it keeps its accuracy where y is near b."""
    return (y - b) * (y * y - 4.0) + a * c * y - a * a - c * c


def _real_poles(p: float, q: float) -> tuple[float, float]:
    """The magnitudes of the two real poles of s^2 + p s + q."""
    high = 0.5 * (p + math.sqrt(max(0.0, p * p - 4.0 * q)))
    return q / high, high
