"""A piecewise linear signal, its history, and what a kernel makes of it: exact, whatever the steps.

The signal is kept as edges, each with the time, the value from there on and the slope. An edge that jumps by J and changes
the slope by K adds J S(s) + K R(s) after s seconds, where S is the kernel's step response and R its integral. Edges older than
the kernel add what the base, the youngest of them, adds alone.
"""

from __future__ import annotations

from shaper_fmu.component import NO_EVENT, State, Variable
from shaper_fmu.smoothers.response import (
    duration,
    mean_delay,
    parabola_response,
    piece_at,
    ramp_response,
    step_response,
    step_slope,
)
from shaper_fmu.smoothers.workspace import SmootherWorkspace

EDGES = 4096
_NO_JUMP = 1e-12  # of the values: a linear signal that is given in steps does not jump, but for rounding


class EdgeWorkspace(SmootherWorkspace):
    """Base of components that keep a signal's history."""

    newest: Variable[int] = State(0)  # number of the newest edge
    base: Variable[int] = State(0)  # and of the youngest one that is older than the kernel
    edge_time: Variable[list[float]] = State(size=EDGES)  # in a ring
    edge_value: Variable[list[float]] = State(size=EDGES)
    edge_slope: Variable[list[float]] = State(size=EDGES)


def value_at(m: EdgeWorkspace, number: int, t: float) -> float:
    """The signal at t, as edge `number` leaves it."""
    k = number % EDGES
    if m.edge_slope[k] == 0.0:
        return m.edge_value[k]
    return m.edge_value[k] + m.edge_slope[k] * (t - m.edge_time[k])


def has_room(m: EdgeWorkspace) -> bool:
    """Whether one more edge can be kept."""
    return m.newest - m.base < EDGES - 1


def put_edge(m: EdgeWorkspace, t: float, value: float, slope: float) -> None:
    """The signal has this value and slope from t on; set again at the same time, the last one counts."""
    if m.base >= EDGES:  # numbers stay small
        m.base -= EDGES
        m.newest -= EDGES
    if m.newest == m.base or m.edge_time[m.newest % EDGES] != t:
        m.newest += 1
    k = m.newest % EDGES
    m.edge_time[k] = t
    m.edge_value[k] = value
    m.edge_slope[k] = slope


def drop_old(m: EdgeWorkspace, until: float) -> None:
    """Let the base be the youngest edge that is older than the kernel at `until`."""
    while m.base < m.newest and m.edge_time[(m.base + 1) % EDGES] + duration(m) <= until:
        m.base += 1


def jump_of(m: EdgeWorkspace, number: int) -> float:
    """By how much the signal jumps at an edge that has one before it."""
    k = number % EDGES
    return m.edge_value[k] - value_at(m, number - 1, m.edge_time[k])


def bend_of(m: EdgeWorkspace, number: int) -> float:
    """By how much its slope changes there."""
    return m.edge_slope[number % EDGES] - m.edge_slope[(number - 1) % EDGES]


def smoothed(m: EdgeWorkspace, now: float, until: float) -> float:
    """What the kernel makes of the signal, at `now`; an age counts as reached if it is at `until`."""
    k = m.base % EDGES
    value = value_at(m, m.base, now)
    if m.edge_slope[k] != 0.0:
        value -= m.edge_slope[k] * mean_delay(m)
    for number in range(m.base + 1, m.newest + 1):
        begin = m.edge_time[number % EDGES]
        if begin <= until:
            piece = piece_at(m, until - begin)
            value += jump_of(m, number) * step_response(m, piece, now - begin)
            bend = bend_of(m, number)
            if bend != 0.0:
                value += bend * ramp_response(m, piece, now - begin)
    return value


def smoothed_slope(m: EdgeWorkspace, now: float, until: float) -> float:
    """The derivative of that, without the impulses where it jumps."""
    value = m.edge_slope[m.base % EDGES]
    for number in range(m.base + 1, m.newest + 1):
        begin = m.edge_time[number % EDGES]
        if begin <= until:
            piece = piece_at(m, until - begin)
            value += jump_of(m, number) * step_slope(m, piece, now - begin)
            bend = bend_of(m, number)
            if bend != 0.0:
                value += bend * step_response(m, piece, now - begin)
    return value


def smoothed_mean(m: EdgeWorkspace, t: float, h: float) -> float:
    """The mean of `smoothed` from t to t + h, exact; the base must not have moved since t."""
    k = m.base % EDGES
    value = value_at(m, m.base, t + 0.5 * h)
    if m.edge_slope[k] != 0.0:
        value -= m.edge_slope[k] * mean_delay(m)
    for number in range(m.base + 1, m.newest + 1):
        begin = m.edge_time[number % EDGES]
        last = t + h - begin
        if last > 0.0:
            first = max(0.0, t - begin)
            at_first = piece_at(m, first)
            at_last = piece_at(m, last)
            value += jump_of(m, number) * (ramp_response(m, at_last, last) - ramp_response(m, at_first, first)) / h
            bend = bend_of(m, number)
            if bend != 0.0:
                value += bend * (parabola_response(m, at_last, last) - parabola_response(m, at_first, first)) / h
    return value


def next_breakpoint(m: EdgeWorkspace, until: float) -> float:
    """When the kernel's next piece begins for an edge that jumps, after `until` [s]."""
    due = NO_EVENT
    for number in range(m.base + 1, m.newest + 1):
        begin = m.edge_time[number % EDGES]
        size = abs(m.edge_value[number % EDGES]) + abs(value_at(m, number - 1, begin))
        if abs(jump_of(m, number)) > _NO_JUMP * size:
            piece = piece_at(m, until - begin)
            if piece + 1 < m.pieces:
                due = min(due, begin + m.piece_begin[piece + 1])
    return due
