"""The response of a kernel to a step and its integrals: piecewise polynomials, exact and evaluated from each piece's begin."""

from __future__ import annotations

from shaper_fmu.smoothers.workspace import COEFFICIENTS, SmootherWorkspace


def lay_out(m: SmootherWorkspace) -> None:
    """The pieces of the step response, from the kernel's terms, which are sorted. After the last piece it is 1."""
    m.pieces = 0
    for k in range(m.terms):
        if m.pieces == 0 or m.term_delay[k] > m.piece_begin[m.pieces - 1]:
            m.piece_begin[m.pieces] = m.term_delay[k]
            m.pieces += 1
    for p in range(m.pieces):
        for j in range(COEFFICIENTS):
            m.piece_coefficient[p * COEFFICIENTS + j] = _coefficient(m, m.piece_begin[p], j)
    last = m.pieces - 1
    for j in range(COEFFICIENTS):
        m.piece_coefficient[last * COEFFICIENTS + j] = 1.0 if j == 0 else 0.0
    m.piece_integral[0] = 0.0
    m.piece_second[0] = 0.0
    for p in range(1, m.pieces):
        span = m.piece_begin[p] - m.piece_begin[p - 1]
        m.piece_integral[p] = _integral(m, p - 1, span)
        m.piece_second[p] = _second(m, p - 1, span)


def _coefficient(m: SmootherWorkspace, begin: float, j: int) -> float:
    """Of x^j, at x after `begin`: the terms of order n before contribute (begin - delay + x)^n / n!."""
    total = 0.0
    for k in range(m.terms):
        n = m.term_order[k]
        if m.term_delay[k] <= begin and n >= j:
            value = m.term_amplitude[k]
            for i in range(1, n - j + 1):
                value *= (begin - m.term_delay[k]) / i
            for i in range(1, j + 1):
                value /= i
            total += value
    return total


def duration(m: SmootherWorkspace) -> float:
    """How long the step response takes [s]."""
    return m.piece_begin[m.pieces - 1]


def mean_delay(m: SmootherWorkspace) -> float:
    """How much later a ramp is after the kernel [s]."""
    return duration(m) - m.piece_integral[m.pieces - 1]


def piece_at(m: SmootherWorkspace, s: float) -> int:
    """Number of the piece in which s [s] after the step is; 0 before the step."""
    low = 0
    high = m.pieces
    while high - low > 1:
        middle = (low + high) // 2
        if m.piece_begin[middle] <= s:
            low = middle
        else:
            high = middle
    return low


def step_response(m: SmootherWorkspace, piece: int, s: float) -> float:
    """The response to a unit step, s [s] after it, in that piece."""
    x = max(0.0, s - m.piece_begin[piece])
    value = 0.0
    for j in range(COEFFICIENTS - 1, -1, -1):
        value = value * x + m.piece_coefficient[piece * COEFFICIENTS + j]
    return value


def step_slope(m: SmootherWorkspace, piece: int, s: float) -> float:
    """Its derivative [1/s]: the kernel without its impulses."""
    x = max(0.0, s - m.piece_begin[piece])
    value = 0.0
    for j in range(COEFFICIENTS - 1, 0, -1):
        value = value * x + j * m.piece_coefficient[piece * COEFFICIENTS + j]
    return value


def ramp_response(m: SmootherWorkspace, piece: int, s: float) -> float:
    """Its integral [s]: the response to a unit ramp."""
    return _integral(m, piece, max(0.0, s - m.piece_begin[piece]))


def parabola_response(m: SmootherWorkspace, piece: int, s: float) -> float:
    """The integral of that [s2]."""
    return _second(m, piece, max(0.0, s - m.piece_begin[piece]))


def _integral(m: SmootherWorkspace, piece: int, x: float) -> float:
    value = 0.0
    for j in range(COEFFICIENTS - 1, -1, -1):
        value = value * x + m.piece_coefficient[piece * COEFFICIENTS + j] / (j + 1)
    return m.piece_integral[piece] + value * x


def _second(m: SmootherWorkspace, piece: int, x: float) -> float:
    value = 0.0
    for j in range(COEFFICIENTS - 1, -1, -1):
        value = value * x + m.piece_coefficient[piece * COEFFICIENTS + j] / ((j + 1) * (j + 2))
    return m.piece_second[piece] + (m.piece_integral[piece] + value * x) * x
