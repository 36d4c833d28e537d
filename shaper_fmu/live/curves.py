"""Residual vibration over frequency, as kernels for the page: of a shaper's impulses, of a profile and of a pulse train.

Each is a component whose `start` designs the command, and whose `step`, whatever its time and length, computes V (Singer and
Seering 1990) over a row of frequencies and on single modes. V of a shaped profile is the product of both: it is the magnitude
of a convolution's Fourier transform, with the decay since each one's end.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from shaper_fmu.commands.motion_profile import MotionProfile
from shaper_fmu.commands.pulse_train import PulseTrain
from shaper_fmu.component import Component, Output, Parameter, State, Variable
from shaper_fmu.kinds.all_modes import IMPULSES
from shaper_fmu.kinds.profiles import inner_event, inner_events, inner_kink, inner_kinks, span_of, unit_move
from shaper_fmu.methods.record import declare
from shaper_fmu.profiles.fastest import MOST_SEGMENTS
from shaper_fmu.pulses.residual import switch_residual
from shaper_fmu.shapers.sensitivity import insensitivity, residual_vibration

POINTS = 181
"""Frequencies of a curve."""
PROBES = 12
"""Modes on which V is asked for: those that are believed, and those that are true."""
NODES = 4096
PIECES = MOST_SEGMENTS + 16
_ORDER = 16
_found = np.polynomial.legendre.leggauss(_ORDER)
_NODES = tuple(map(float, _found[0]))
_WEIGHTS = tuple(map(float, _found[1]))
_PANEL = 2.0  # radians of the mode in a panel of the quadrature: exact to rounding

CURVE: dict[str, Any] = {
    "asked": Parameter(False, "", "whether a step computes the curve"),
    "lowest": Parameter(1.0, "rad/s", "first frequency of the curve", min=0.0, exclusive=True),
    "highest": Parameter(20.0, "rad/s", "last frequency of the curve", min=0.0, exclusive=True),
    "curve_damping": Parameter(0.0, "", "damping ratio along the curve", min=0.0, max=1.0, exclusive="max"),
    "probes": Parameter(0, "", "number of modes on which V is asked for", min=0, max=PROBES),
    "probe_frequency": Parameter(1.0, "rad/s", "their frequencies", size=PROBES, min=0.0, exclusive=True),
    "probe_damping": Parameter(0.0, "", "their damping ratios", size=PROBES, min=0.0, max=1.0, exclusive="max"),
    "curve_frequency": Output("rad/s", "frequencies of the curve", size=POINTS),
    "curve_vibration": Output("", "V at these frequencies", size=POINTS),
    "probe_vibration": Output("", "V on the modes", size=PROBES),
}


class _Curve:
    """The types of what `CURVE` declares."""

    asked: Variable[bool]
    lowest: Variable[float]
    highest: Variable[float]
    curve_damping: Variable[float]
    probes: Variable[int]
    probe_frequency: Variable[list[float]]
    probe_damping: Variable[list[float]]
    curve_frequency: Variable[list[float]]
    curve_vibration: Variable[list[float]]
    probe_vibration: Variable[list[float]]


class ShaperCurve(Component, _Curve):
    """V of an impulse sequence, which is written into `amplitude` and `delay`."""

    impulses: Variable[int] = Parameter(1, "", "number of impulses", min=1, max=IMPULSES)
    amplitude: Variable[list[float]] = Parameter([1.0] + [0.0] * (IMPULSES - 1), "", "their amplitudes", size=IMPULSES)
    delay: Variable[list[float]] = Parameter(0.0, "s", "their delays", size=IMPULSES, min=0.0)
    bands: Variable[int] = Parameter(0, "", "number of modes, the first ones, whose insensitivity is asked for", min=0, max=PROBES)
    tolerance: Variable[float] = Parameter(0.05, "", "tolerated V", min=0.0, exclusive=True)
    probe_insensitivity: Variable[list[float]] = Output("", "width of the band of w/wn with tolerated V around these", size=PROBES)
    declare(locals(), CURVE)

    def step(self, t: float, h: float) -> None:
        if not self.asked:
            return
        for i in range(self.bands):
            self.probe_insensitivity[i] = insensitivity(
                self.amplitude, self.delay, self.impulses, self.probe_frequency[i], self.probe_damping[i], self.tolerance
            )
        for i in range(POINTS):
            w = self.lowest + (self.highest - self.lowest) * i / (POINTS - 1)
            self.curve_frequency[i] = w
            self.curve_vibration[i] = residual_vibration(self.amplitude, self.delay, self.impulses, w, self.curve_damping)
        for i in range(self.probes):
            self.probe_vibration[i] = residual_vibration(
                self.amplitude, self.delay, self.impulses, self.probe_frequency[i], self.probe_damping[i]
            )


class PulseCurve(PulseTrain, _Curve):
    """V of a pulse train."""

    declare(locals(), CURVE)

    def step(self, t: float, h: float) -> None:
        if not self.asked:
            return
        for i in range(POINTS):
            w = self.lowest + (self.highest - self.lowest) * i / (POINTS - 1)
            self.curve_frequency[i] = w
            self.curve_vibration[i] = switch_residual(self.switch_time, self.switches, self.travel_time, w, self.curve_damping)
        for i in range(self.probes):
            self.probe_vibration[i] = switch_residual(
                self.switch_time, self.switches, self.travel_time, self.probe_frequency[i], self.probe_damping[i]
            )


class MoveCurve(MotionProfile, _Curve):
    """V of a motion profile: V = |integral_0^T y' exp(p (T - t)) dt| / L, by Gauss-Legendre quadrature on its smooth pieces."""

    declare(locals(), CURVE)
    piece: Variable[list[float]] = State(size=PIECES)
    node: Variable[list[float]] = State(size=NODES)
    moved: Variable[list[float]] = State(size=NODES)
    nodes: Variable[int] = State(0)
    span: Variable[float] = State(0.0)
    real: Variable[list[float]] = State(size=POINTS)
    imaginary: Variable[list[float]] = State(size=POINTS)

    def step(self, t: float, h: float) -> None:
        if not self.asked:
            return
        self.span = span_of(self.profile, self, self.duration)
        fastest = self.highest
        for i in range(self.probes):
            fastest = max(fastest, self.probe_frequency[i])
        place_nodes(self, fastest)
        move_curve(self)
        for i in range(self.probes):
            self.probe_vibration[i] = move_residual(self, self.probe_frequency[i], self.probe_damping[i])


def sorted_pieces(m: MoveCurve) -> int:
    """The ends of the pieces on which the motion is smooth, rising, into m.piece; returns how many."""
    m.piece[0] = 0.0
    m.piece[1] = m.span
    count = 2
    for i in range(inner_events(m.profile, m)):
        count = sorted_in(m, count, inner_event(m.profile, m, i, m.span, m.ramp))
    for i in range(inner_kinks(m.profile, m)):
        count = sorted_in(m, count, inner_kink(m.profile, m, i, m.span, m.ramp))
    return count


def sorted_in(m: MoveCurve, count: int, time: float) -> int:
    """Put a time in its place among the first `count` pieces, unless it is outside of the move or there already."""
    if not 0.0 < time < m.span or count >= PIECES:
        return count
    k = count
    while k > 0 and m.piece[k - 1] > time:
        k -= 1
    if k > 0 and m.piece[k - 1] == time:
        return count
    for j in range(count - k):
        m.piece[count - j] = m.piece[count - j - 1]
    m.piece[k] = time
    return count + 1


def place_nodes(m: MoveCurve, highest: float) -> None:
    """Nodes of all pieces and the unit move's velocity times the weights there; without room for more, the panels get longer."""
    pieces = sorted_pieces(m)
    panel = _PANEL / highest
    panel = max(panel, m.span / (NODES // _ORDER - 4 * pieces))
    m.nodes = 0
    for k in range(pieces - 1):
        length = m.piece[k + 1] - m.piece[k]
        count = max(2, math.ceil(length / panel))
        width = length / count
        for i in range(count):
            for j in range(_ORDER):
                s = m.piece[k] + width * (i + 0.5 + 0.5 * _NODES[j])
                _position, velocity, _acceleration = unit_move(
                    m.profile, m, s, m.duration, m.ramp, m.natural_frequency, m.damping_ratio
                )
                m.node[m.nodes] = s
                m.moved[m.nodes] = 0.5 * width * _WEIGHTS[j] * velocity
                m.nodes += 1


def move_curve(m: MoveCurve) -> None:
    """V at all frequencies of the curve: they are equally spaced, so that each node's part turns and shrinks by one factor."""
    spacing = (m.highest - m.lowest) / (POINTS - 1)
    share = math.sqrt(1.0 - m.curve_damping * m.curve_damping)
    for i in range(POINTS):
        m.curve_frequency[i] = m.lowest + (m.highest - m.lowest) * i / (POINTS - 1)
        m.curve_vibration[i] = 1.0
        m.real[i] = 0.0
        m.imaginary[i] = 0.0
    if m.span <= 0.0:
        return
    for k in range(m.nodes):
        decay = m.curve_damping * (m.span - m.node[k])
        turn = share * m.node[k]
        weight = m.moved[k] * math.exp(-decay * m.lowest)
        x = weight * math.cos(turn * m.lowest)
        y = weight * math.sin(turn * m.lowest)
        left = math.exp(-decay * spacing)
        cosine = left * math.cos(turn * spacing)
        sine = left * math.sin(turn * spacing)
        for i in range(POINTS):
            m.real[i] += x
            m.imaginary[i] += y
            x, y = x * cosine - y * sine, x * sine + y * cosine
    for i in range(POINTS):
        m.curve_vibration[i] = math.sqrt(m.real[i] * m.real[i] + m.imaginary[i] * m.imaginary[i])


def move_residual(m: MoveCurve, natural_frequency: float, damping_ratio: float) -> float:
    """V on this mode [rad/s]; 1 of a step."""
    if m.span <= 0.0:
        return 1.0
    decay = damping_ratio * natural_frequency
    damped = natural_frequency * math.sqrt(1.0 - damping_ratio * damping_ratio)
    real = 0.0
    imaginary = 0.0
    for i in range(m.nodes):
        weight = m.moved[i] * math.exp(-decay * (m.span - m.node[i]))
        real += weight * math.cos(damped * m.node[i])
        imaginary += weight * math.sin(damped * m.node[i])
    return math.sqrt(real * real + imaginary * imaginary)
