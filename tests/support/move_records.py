"""Records of machines as users take them: a rest, a move and the ringing after it, with what spoils records; the truth is known.

A plant is a sum of modes, q_k' = p_k q_k + u, y_j = sum_k Re(c_jk q_k); u is the acceleration that the actuator gives. Between
samples of a fine grid u is a straight line, for which the solution is exact: a recursion of first order per mode.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.signal import lfilter

from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning import Tuning

LAWS = ("trapezoid", "cycloid", "s_curve", "fifth_order")
FINE = 16
"""Steps of the solution per sample."""


@dataclass(frozen=True)
class Record:
    """A table, and what is true of it: poles, and each mode's amplitude in each output when the excitation has ended (n, m)."""

    table: Table
    poles: np.ndarray
    amplitudes: np.ndarray
    options: dict[str, Any] = field(default_factory=dict)
    traits: tuple[str, ...] = ()


def acceleration(kind: str, s: np.ndarray) -> np.ndarray:
    """Of a move, over its time from 0 to 1: it comes to rest at the end."""
    inside = (s >= 0.0) & (s < 1.0)
    laws = {
        "trapezoid": np.where(s < 0.25, 1.0, np.where(s < 0.75, 0.0, -1.0)),
        "cycloid": np.sin(2.0 * np.pi * s),
        "s_curve": np.interp(s, [0.0, 0.125, 0.375, 0.5, 0.625, 0.875, 1.0], [0.0, 1.0, 1.0, 0.0, -1.0, -1.0, 0.0]),
        "fifth_order": 4.0 * s * (1.0 - s) * (1.0 - 2.0 * s),
    }
    return np.where(inside, laws[kind], 0.0)


def driven(pole: complex, u: np.ndarray, h: float) -> np.ndarray:
    """q' = pole q + u from rest, u linear between samples at distances h."""
    z = pole * h
    grown = np.exp(z)
    first = (grown - 1.0) / z
    second = (first - 1.0) / z  # of the integral of exp(pole (h - s)) s / h
    drive = np.zeros(len(u), complex)
    drive[1:] = h * ((first - second) * u[:-1] + second * u[1:])
    return np.asarray(lfilter([1.0], [1.0, -grown], drive))


def lagged(u: np.ndarray, h: float, lag: float) -> np.ndarray:
    """Behind an actuator of first order with this time constant."""
    return np.real(driven(complex(-1.0 / lag), u, h)) / lag if lag > 0.0 else u


def stepped(w: float, zeta: float, u: np.ndarray, h: float, friction: float = 0.0, cubic: float = 0.0) -> np.ndarray:
    """x'' + 2 zeta w x' + w^2 (x + cubic x^3) + friction sign(x') = u from rest, by Runge and Kutta's method of fourth order.

    Where the velocity would change its sign and the friction is larger than all other forces, the body sticks.
    """
    x, v = 0.0, 0.0
    found = np.zeros(len(u))

    def force(x: float, v: float, drive: float) -> float:
        return drive - 2.0 * zeta * w * v - w * w * (x + cubic * x**3)

    for i in range(len(u) - 1):
        free = force(x, 0.0, u[i])
        if friction and v == 0.0 and abs(free) <= friction:
            found[i + 1] = x
            continue
        against = friction * (math.copysign(1.0, v) if v else math.copysign(1.0, free))
        middle = 0.5 * (u[i] + u[i + 1]) - against
        k1 = v, force(x, v, u[i] - against)
        k2 = v + 0.5 * h * k1[1], force(x + 0.5 * h * k1[0], v + 0.5 * h * k1[1], middle)
        k3 = v + 0.5 * h * k2[1], force(x + 0.5 * h * k2[0], v + 0.5 * h * k2[1], middle)
        k4 = v + h * k3[1], force(x + h * k3[0], v + h * k3[1], u[i + 1] - against)
        x += h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0])
        after = v + h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1])
        v = 0.0 if friction and v * after < 0.0 else after
        found[i + 1] = x
    return found


KINDS = (
    "trapezoid", "cycloid", "s_curve", "fifth_order", "lag", "two_moves", "two_modes", "two_outputs", "feedthrough", "drift",
    "friction", "cubic", "quantised", "clipped", "filtered",
)  # fmt: skip
"""What `made` knows to put into a record; a law of the move is drawn if none is named."""


def made(rng: np.random.Generator, told: str, start: str, kinds: Collection[str], noise: float = 1e-3) -> Record:
    """A record of few samples, of a machine drawn at random, with these kinds of trouble in it.

    Args:
        told: "no" end of the excitation, the right one ("end"), one "late" or "early", or the command's column ("input").
        start: of the record: at "rest", with the move ("begin"), amid it ("move"), at its end ("end"), in the ringing ("ring").
        noise: its deviation, as a share of the ringing's peak.
    """
    modes, outputs = (2 if "two_modes" in kinds else 1), (2 if "two_outputs" in kinds else 1)
    w, zeta = 6.0 * np.array([1.0, rng.uniform(1.7, 2.8)])[:modes], np.exp(rng.uniform(math.log(0.006), math.log(0.1), modes))
    poles = w * (-zeta + 1j * np.sqrt(1.0 - zeta * zeta))
    period, step = 2.0 * math.pi / w[0], 2.0 * math.pi / w[-1] / rng.choice([10, 14, 20])
    law = next((one for one in LAWS if one in kinds), str(rng.choice(LAWS)))
    rest, duration, h = 0.5 * period, period * rng.uniform(0.6, 3.0), step / FINE
    gap = duration + period * rng.uniform(0.2, 2.0) if "two_moves" in kinds else 0.0
    end = rest + gap + duration
    t = h * np.arange(FINE * int((end + period * rng.uniform(5.0, 10.0)) / step))
    command = acceleration(law, (t - rest) / duration) - (acceleration(law, (t - rest - gap) / duration) if gap else 0.0)
    lag = period * rng.uniform(0.05, 1.2) if "lag" in kinds else 0.0
    u = lagged(command, h, lag)
    states = np.array([driven(pole, u, h) for pole in poles])
    last = int(np.searchsorted(t, end))
    size = rng.uniform(0.4, 1.0, (modes, outputs)) * np.exp(-1j * rng.uniform(0.0, 2.0 * math.pi, (modes, outputs)))
    # what a lag still gives after the end is u exp(-t / lag): the states' part with their own poles is left
    free = states[:, last] + (u[last] / (poles + 1.0 / lag) if lag else 0.0)
    y = np.real(np.einsum("km,kn->nm", size, states))
    if {"friction", "cubic"} & set(kinds):
        size, free = np.ones((1, 1)), np.ones(1)
        peak = np.abs(stepped(w[0], zeta[0], u, h)[last:]).max()
        friction = w[0] ** 2 * peak * rng.uniform(0.01, 0.06) if "friction" in kinds else 0.0
        cubic = rng.uniform(0.05, 0.3) / peak**2 if "cubic" in kinds else 0.0
        y = stepped(w[0], zeta[0], u, h, friction, cubic)[:, None]
        a = np.abs(y[last:]).max()
        poles = poles[0].real + 1j * poles[0].imag * np.array([1.0, 1.0 + 0.375 * cubic * a * a])  # at small swings, at large ones
        size, free = np.ones((2, 1)), np.array([1.0, 0.0])
    if "feedthrough" in kinds:
        y = y + command[:, None] * rng.uniform(0.2, 1.0) * np.abs(y).max()
    t, y, command = t[::FINE], y[::FINE], command[::FINE]
    y = _spoilt(rng, t, y, np.abs(y[t > end]).max(axis=0), kinds, noise)
    begin = {"rest": 0.0, "begin": rest, "move": end - duration * rng.uniform(0.02, 0.95), "end": end, "ring": end + 0.3 * period}[
        start
    ]
    kept = t >= begin
    columns = {"time": t[kept], **{f"y{j + 1}": y[kept, j] for j in range(outputs)}}
    options: dict[str, Any] = {}
    if told == "input":
        columns["command"] = command[kept]
        options["input"] = "command"
    elif told != "no":
        off = {"end": 0.0, "late": 0.5 * period, "early": -duration * rng.uniform(0.1, 0.9)}[told]
        options = {"excitation_end": max(float(t[kept][0]), end + off)}
    since = max(begin, end, float(options.get("excitation_end", 0.0))) - end
    return Record(
        Table(columns), poles, np.abs(size * (free * np.exp(poles.real * since))[:, None]), options, (told, start, *kinds)
    )


def _spoilt(
    rng: np.random.Generator, t: np.ndarray, y: np.ndarray, peak: np.ndarray, kinds: Collection[str], noise: float
) -> np.ndarray:
    """What sensors add; the peak is that of the ringing in each output."""
    if "drift" in kinds:
        y = y + peak * rng.uniform(0.2, 2.0) * (t / t[-1])[:, None]
    if "filtered" in kinds:
        y = np.asarray(lfilter([0.25, 0.5, 0.25], [1.0], y, axis=0))
    y = y + noise * peak * rng.standard_normal(y.shape)
    if "clipped" in kinds:
        y = np.clip(y, -0.8 * peak, 0.8 * peak)
    if "quantised" in kinds:
        y = peak / 100.0 * np.round(100.0 * y / peak)
    return y


def left(found: Tuning, record: Record) -> float:
    """What the recommended shaper leaves on the true plant: the share of the sum of amplitudes, in the worst output.

    V by Singer and Seering 1990. Of a plant with two poles for one mode (small and large swings) the worse one.
    """
    assert found.choice is not None
    assert found.choice.recommended is not None
    sequence = found.choice.recommended.sequence
    terms = np.exp(np.multiply.outer(record.poles, sequence.duration - np.array(sequence.delays)))
    v = np.abs(terms @ np.array(sequence.amplitudes))
    if "cubic" in record.traits:
        return float(v.max())
    shares = record.amplitudes / record.amplitudes.sum(axis=0)
    return float((shares * v[:, None]).sum(axis=0).max())
