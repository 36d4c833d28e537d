"""Accelerometer records of 3D printers with known modes, as Klipper's TEST_RESONANCES makes them: a square wave of acceleration, half a
period of each frequency, which rises with time; samples at uneven times, gravity, noise.

    head acceleration = (1 - sum g) a + sum of g_k (2 zeta w y' + w^2 y),     y'' + 2 zeta w y' + w^2 y = a
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter


def segments(low: float, high: float, rate: float, per_hertz: float) -> tuple[np.ndarray, np.ndarray]:
    """Times at which the acceleration changes, shape (n + 1,), and the accelerations between them, shape (n,)."""
    times, values, f, sign = [0.0], [], low, 1.0
    while f <= high + 1e-6:
        quarter = 0.25 / f
        times += [times[-1] + quarter, times[-1] + 2.0 * quarter]
        values += [sign * per_hertz * f, -sign * per_hertz * f]
        f, sign = f + 2.0 * quarter * rate, -sign
    return np.array(times), np.array(values)


def record_of(
    modes: Sequence[tuple[float, float, float]], *, seed: int = 0, noise: float = 30.0, low: float = 5.0, high: float = 133.33,
    rate: float = 1.0, per_hertz: float = 75.0, sampling: float = 3200.0, before: float = 0.3, after: float = 0.5,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Times [s], and the head's acceleration along the axis [mm/s^2]; modes are (hertz, damping ratio, share g)."""
    rng = np.random.default_rng(seed)
    changes, values = segments(low, high, rate, per_hertz)
    count = round((before + changes[-1] + after) * sampling)
    jitter = 0.02 / sampling * np.cumsum(rng.standard_normal(count)) / math.sqrt(count)
    t = np.arange(count) / sampling + jitter - before
    speed = np.concatenate([[0.0], np.cumsum(values * np.diff(changes))])
    held = np.diff(np.interp(t, changes, speed)) * sampling  # mean acceleration over each sample
    inside = (t >= 0.0) & (t < changes[-1])
    command = np.where(inside, values[np.clip(np.searchsorted(changes, t, "right") - 1, 0, len(values) - 1)], 0.0)
    x = (1.0 - sum(g for *_, g in modes)) * command
    for hertz, zeta, g in modes:
        w = 2.0 * math.pi * hertz
        a = np.array([[0.0, 1.0], [-w * w, -2.0 * zeta * w]])
        step = expm(a / sampling)
        moved = np.linalg.solve(a, (step - np.eye(2)) @ np.array([0.0, 1.0]))  # by an acceleration of 1 over a sample
        b = [moved[0], step[0, 1] * moved[1] - step[1, 1] * moved[0]], [moved[1], step[1, 0] * moved[0] - step[0, 0] * moved[1]]
        denominator = [1.0, -np.trace(step), np.linalg.det(step)]
        y, speed_of_y = (np.asarray(lfilter([0.0, *one], denominator, np.append(held, 0.0))) for one in b)
        x = x + g * (w * w * y + 2.0 * zeta * w * speed_of_y)
    return t, x + noise * rng.standard_normal(count)


def write_record(path: Path, modes: Sequence[tuple[float, float, float]], axis: str = "x", seed: int = 0, **options: float) -> Path:
    """A file as Klipper writes it: `#time,accel_x,accel_y,accel_z`, on the printer's clock, gravity along z."""
    t, x = record_of(modes, seed=seed, **options)
    rng = np.random.default_rng(seed + 1000)
    others = {name: 0.02 * x + 30.0 * rng.standard_normal(len(t)) for name in "xyz"}
    columns = [x if name == axis else others[name] for name in "xyz"]
    columns[2] = columns[2] + 9806.65
    columns[0] = columns[0] + 120.0
    with path.open("w") as file:
        file.write("#time,accel_x,accel_y,accel_z\n")
        np.savetxt(file, np.column_stack([t + 1234.5, *columns]), fmt="%.6f", delimiter=",")
    return path
