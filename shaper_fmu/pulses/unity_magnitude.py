"""UM-ZV and UM-ZVD: on/off switch times 1, -1, 1 (, -1, 1) that leave no vibration (Singhose, Singer and Seering 1997).

UM-ZV solves sum_i A_i exp((zeta w + j wd) t_i) = 0; UM-ZVD also sum_i A_i t_i exp((zeta w + j wd) t_i) = 0, which makes
V flat at the design frequency. Undamped, UM-ZV switches at 1/6 and 1/3 of the period. Newton's method follows the
solution from there to the wanted damping; what remains of the equations is the certificate. Towards critical damping the
last pulses shrink to nothing while the first one's vibration decays by itself: beyond zeta = 0.979 (UM-ZV) or 0.960 (UM-ZVD)
that is reported as no solution.
"""

from __future__ import annotations

import math

from shaper_fmu.pulses.linear import solve_linear

WORK = 32
"""Numbers of scratch room that `unity_magnitude_switches` needs."""
SOLVED = 1e-12
_SAVED = 24  # where in the scratch room the last good solution lies
_LARGEST_STEP = 0.05
_SMALLEST_STEP = 1e-4
_FADED = 1e-9  # where the first term is this small, the equations no longer tell the last two switches apart


def unity_magnitude_switches(switch_time, work, order: int, natural_frequency: float, damping_ratio: float) -> float:
    """Switch times [s] into switch_time: 3 of UM-ZV (order 0) or 5 of UM-ZVD (order 1), natural_frequency in rad/s.

    Returns the certificate: the largest residual of the equations, over the last term's size, times in 1/w; below 1e-12,
    or 1 if no solution was found (damping close to critical).
    """
    count = 3 + 2 * order
    _undamped(switch_time, order)
    certificate = _newton(switch_time, work, order, 0.0)
    reached = 0.0
    step = _LARGEST_STEP
    while reached < damping_ratio:
        for i in range(count):
            work[_SAVED + i] = switch_time[i]
        target = min(damping_ratio, reached + step)
        certificate = _newton(switch_time, work, order, target)
        if certificate < SOLVED:
            reached = target
            step = min(2.0 * step, _LARGEST_STEP)
        else:
            for i in range(count):
                switch_time[i] = work[_SAVED + i]
            step *= 0.5
            if step < _SMALLEST_STEP:
                return 1.0
    if math.exp(-damping_ratio * switch_time[count - 1]) < _FADED:
        return 1.0
    for i in range(count):
        switch_time[i] /= natural_frequency
    return certificate


def _undamped(switch_time, order: int) -> None:
    """Undamped switch times, in 1/w: the closed form of UM-ZV; UM-ZVD to 8 digits."""
    switch_time[0] = 0.0
    if order == 0:
        switch_time[1] = math.pi / 3.0
        switch_time[2] = 2.0 * math.pi / 3.0
    else:
        switch_time[1] = 2.0 * math.pi * 0.08951255
        switch_time[2] = 2.0 * math.pi * 0.36623382
        switch_time[3] = 2.0 * math.pi * 0.6429551
        switch_time[4] = 2.0 * math.pi * 0.73246765


def _newton(time, work, order: int, damping_ratio: float) -> float:
    """Solve for all times but the first, in 1/w, from the times given; returns the certificate, or 1."""
    unknowns = 2 + 2 * order
    for _ in range(40):
        residual = _equations(time, work, order, damping_ratio)
        if residual < 1e-3 * SOLVED:
            return residual
        if not solve_linear(work, unknowns):
            return 1.0
        _move(time, work, unknowns)
    return _equations(time, work, order, damping_ratio)


def _move(time, work, unknowns: int) -> None:
    """Take Newton's step, shortened so that no width shrinks to less than a fifth."""
    share = 1.0
    before = 0.0
    for i in range(1, unknowns + 1):
        change = work[(i - 1) * (unknowns + 1) + unknowns]
        width = time[i] - time[i - 1]
        if change - before < -0.8 * width:
            share = min(share, 0.8 * width / (before - change))
        before = change
    for i in range(1, unknowns + 1):
        time[i] += share * work[(i - 1) * (unknowns + 1) + unknowns]


def _equations(time, work, order: int, damping_ratio: float) -> float:
    """Newton's linear equations into `work`; returns the largest residual, all over exp(zeta w t) of the last switch."""
    unknowns = 2 + 2 * order
    width = unknowns + 1
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    for row in range(unknowns):
        work[row * width + unknowns] = 0.0
    sign = 1.0
    for i in range(unknowns + 1):
        weight = sign * math.exp(damping_ratio * (time[i] - time[unknowns]))
        real = weight * math.cos(damped * time[i])
        imaginary = weight * math.sin(damped * time[i])
        rate_real = damping_ratio * real - damped * imaginary
        rate_imaginary = damping_ratio * imaginary + damped * real
        work[unknowns] -= real
        work[width + unknowns] -= imaginary
        if order == 1:
            work[2 * width + unknowns] -= time[i] * real
            work[3 * width + unknowns] -= time[i] * imaginary
        if i > 0:
            work[i - 1] = rate_real
            work[width + i - 1] = rate_imaginary
            if order == 1:
                work[2 * width + i - 1] = real + time[i] * rate_real
                work[3 * width + i - 1] = imaginary + time[i] * rate_imaginary
        sign = -sign
    residual = 0.0
    for row in range(unknowns):
        residual = max(residual, abs(work[row * width + unknowns]))
    return residual
