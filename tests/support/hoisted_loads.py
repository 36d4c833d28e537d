"""Loads on ropes that change: the shaper's kernel stepped as a master does, and the swing that its output leaves, by scipy."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from compiled_kernels import Kernels, record_of
from scipy.integrate import solve_ivp

from shaper_fmu.commands.hoisting_shaper import HoistingShaper

GRAVITY = 9.81
Jump = tuple[float, float]


class Rope:
    """A rope whose length is linear between these (time, length), and held before and after."""

    def __init__(self, *points: tuple[float, float]):
        self.times, self.lengths = (np.array(column) for column in zip(*points, strict=True))

    def __call__(self, t: float) -> float:
        return float(np.interp(t, self.times, self.lengths))

    def speed(self, start: float, end: float) -> float:
        """The speed between two times with no corner between them."""
        return (self(end) - self(start)) / (end - start)


@cache
def kernels() -> Kernels:
    """The shaper's compiled kernels, whose bits are those of plain Python (test_kernels)."""
    return Kernels(HoistingShaper)


class Shaper:
    """The compiled kernel on its record, stepped from communication point to communication point and to the events between."""

    def __init__(self, length: float, **parameters: Any):
        self.plain = HoistingShaper(rope_length=length, **parameters)
        self.record = record_of(self.plain)
        assert kernels().start(self.record) == 0
        self.jumps: list[Jump] = []
        self.events: list[float] = []
        self.mean = 0.0  # integral of shaped_mean
        self.call(0.0, 0.0)

    def __getitem__(self, name: str) -> float:
        return self.record[name].item()

    def call(self, t: float, h: float) -> None:
        before = self["shaped"]
        status = kernels().step(self.record, t, h)
        assert status == 0, self.plain.messages[status]
        self.mean += h * self["shaped_mean"]
        if self["shaped"] != before:
            self.jumps.append((t + h, self["shaped"] - before))

    def step(self, t: float, end: float, command: float, length: float, speed: float) -> None:
        """One communication step, cut where the shaper announces an event; what is measured is linear over it."""
        self.record["command"] = command
        begin = t
        while t < end:
            self.record["rope_length"] = length + speed * (t - begin)
            self.record["rope_length_slope"] = speed
            self.call(t, 0.0)
            due = self["next_event_time"]
            until = due if t < due < end else end
            self.events += [due] if until == due else []
            self.call(t, until - t)
            t = until


def shaped(rope: Rope, commands: Sequence[Jump], end: float, step: float, **parameters: Any) -> Shaper:
    """The shaper after commands (time, value) at communication points, with the rope's slope known over each step."""
    shaper = Shaper(rope(0.0), **parameters)
    for i in range(round(end / step)):
        t, until = i * step, (i + 1) * step
        command = [value for time, value in [(-1.0, 0.0), *commands] if time <= t + 1e-9][-1]
        shaper.step(t, until, command, rope(t), rope.speed(t, until))
    return shaper


def swing_left(
    rope: Rope, jumps: Sequence[Jump], end: float, *, linear: bool, decay: float = 0.0, tolerance: float = 1e-10
) -> float:
    """The load's speed amplitude [m/s] at `end` after jumps of the trolley's speed, by DOP853.

    l theta'' + 2 l' theta' + 2 sigma l theta' + g sin theta = 0, or the linear equation, between the jumps and the rope's
    corners; a jump v of the speed is an impulse, theta' jumps by -v cos(theta)/l.
    """
    sine: Callable[[float], float] = float if linear else math.sin
    times = sorted({0.0, *(t for t, _ in jumps), *(t for t in rope.times if 0.0 < t < end), end})
    angle, rate = 0.0, 0.0
    for begin, until in itertools.pairwise(times):
        speed, length = rope.speed(begin, until), rope(begin)
        cosine = 1.0 if linear else math.cos(angle)
        rate -= sum(size for t, size in jumps if t == begin) * cosine / length

        def slopes(t, y, begin=begin, speed=speed, length=length):
            pull = GRAVITY * sine(y[0]) + 2.0 * speed * y[1]
            return [y[1], -pull / (length + speed * (t - begin)) - 2.0 * decay * y[1]]

        found = solve_ivp(slopes, (begin, until), [angle, rate], method="DOP853", rtol=tolerance, atol=1e-3 * tolerance)
        angle, rate = found.y[:, -1].tolist()
    return math.hypot(rope(end) * rate, angle * math.sqrt(GRAVITY * rope(end)))
