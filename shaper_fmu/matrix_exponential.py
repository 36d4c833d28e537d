"""Exact propagation of a linear system over a step: the matrix exponential and its integrals, in scalar loops.

For x' = A x + b(s) with b(s) = b0 + b1 s over [0, h] (Higham 2008, Functions of Matrices, section 10.7.4):

    x(h) = phi0(A h) x(0) + h phi1(A h) b0 + h^2 phi2(A h) b1,    phi_k(Z) = sum_j Z^j / (j + k)!

so phi0 is the exponential, and singular matrices such as those of rigid bodies need no care. Kernel-compatible.
"""

from __future__ import annotations

import math

from shaper_fmu.variable import Array

MOST_SQUARINGS = 40
_TERMS = 16  # of the series: at a norm of 1/2 the first one left out is below 1e-18


def phi_functions(z: Array, n: int, phi0: Array, phi1: Array, phi2: Array, work: Array) -> int:
    """Write phi0, phi1 and phi2 of the n by n matrix z, by scaling and squaring.

    All arrays hold n^2 numbers, row by row; z is scaled in place. Returns the number of squarings, or -1 without a result where
    the norm of z is beyond 2^MOST_SQUARINGS / 2 (or no number): nothing would be left of the accuracy, which is about
    1e-16 times the norm of z.
    """
    norm = 0.0
    total = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            row += abs(z[i * n + j])
        norm = max(norm, row)
        total += row
    if not (total < math.inf and norm <= 0.5 * 2.0**MOST_SQUARINGS):  # the total tells a NaN
        return -1
    squarings = 0
    while norm > 0.5:
        norm *= 0.5
        squarings += 1
    factor = 0.5**squarings
    for i in range(n * n):
        z[i] *= factor
        phi2[i] = 0.0
    for term in range(_TERMS, 0, -1):  # Horner's scheme: phi2 = (1 + z / 3 (1 + z / 4 (...))) / 2
        _product(z, phi2, n, work)
        for i in range(n * n):
            phi2[i] = work[i] / (term + 2.0)
        for i in range(n):
            phi2[i * n + i] += 1.0
    for i in range(n * n):
        phi2[i] *= 0.5
    _next(z, phi2, n, phi1)
    _next(z, phi1, n, phi0)
    for _ in range(squarings):
        _double(n, phi0, phi1, phi2, work)
    return squarings


def _double(n: int, phi0: Array, phi1: Array, phi2: Array, work: Array) -> None:
    """From the functions of Z to those of 2 Z."""
    _product(phi0, phi2, n, work)
    for i in range(n * n):
        phi2[i] = 0.25 * (work[i] + phi1[i] + phi2[i])
    _product(phi0, phi1, n, work)
    for i in range(n * n):
        phi1[i] = 0.5 * (work[i] + phi1[i])
    _product(phi0, phi0, n, work)
    for i in range(n * n):
        phi0[i] = work[i]


def _next(z: Array, phi: Array, n: int, result: Array) -> None:
    """phi_(k - 1) = 1 / (k - 1)! + z phi_k, for k = 1 and 2."""
    _product(z, phi, n, result)
    for i in range(n):
        result[i * n + i] += 1.0


def _product(a: Array, b: Array, n: int, result: Array) -> None:
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += a[i * n + k] * b[k * n + j]
            result[i * n + j] = total


def power_of_two(x: float) -> float:
    """The power of two that is next to x > 0, or 1 where x is not a positive number: a scale that rounds nothing."""
    if not 1e-300 < x < 1e300:
        return 1.0
    return 2.0 ** math.floor(math.log2(x) + 0.5)
