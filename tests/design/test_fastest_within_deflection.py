"""Fastest moves whose mode must not deflect by more than a limit on the way: against dense programmes, and by exact peaks."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from shaper_fmu.analysis.deflection import peak_deflection
from shaper_fmu.design.fastest import FastestMove, fastest_move, shortest_move
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.task import duration_with_vibration
from shaper_fmu.errors import ArgumentError

LIMITS: Any = {"max_velocity": 1.0, "max_acceleration": 3.0}
STATIC = 3.0 / 25.0
"""What 3 m/s2 make of a mode of 5 rad/s at rest [m]."""


def peak_of(move: FastestMove, w: float, zeta: float) -> float:
    """The peak that the analysis of piecewise constant commands finds, which the design does not use."""
    levels = [*(np.array(move.controls) / w**2).tolist(), 0.0]
    return peak_deflection(move.switch_times, levels, w, zeta)


def by_cells(distance: float, speed: float, acceleration: float, w: float, zeta: float, limit: float) -> float:
    """Shortest duration [s] of 160 cells of constant acceleration with 1 % of residual vibration and |q| <= limit at the cells'
    ends and middles: bisection over dense linear programmes, made apart from this package. q by the step response
    (1 - exp(-zeta w s)(cos wd s + zeta w/wd sin wd s))/w^2 of q'' + 2 zeta w q' + w^2 q = a."""
    n, damped = 160, w * math.sqrt(1.0 - zeta * zeta)
    pole = complex(-zeta * w, damped)

    def step(s: np.ndarray) -> np.ndarray:
        s = np.maximum(s, 0.0)
        return (1.0 - np.exp(-zeta * w * s) * (np.cos(damped * s) + zeta * w / damped * np.sin(damped * s))) / w**2

    def possible(duration: float) -> bool:
        h = duration / n
        ends, instants = h * np.arange(n + 1), 0.5 * h * np.arange(1, 2 * n + 1)
        sums = h * np.tril(np.ones((n, n)))
        grown = np.exp(pole * (duration - ends)) / pole**2
        residual = np.array([np.real(np.exp(1j * math.pi * k / 16) * (grown[:-1] - grown[1:])) for k in range(32)])
        q = step(np.subtract.outer(instants, ends[:-1])) - step(np.subtract.outer(instants, ends[1:]))
        rows = np.vstack((sums, -sums, residual, q, -q))
        most = np.concatenate((np.full(2 * n, speed), np.full(32, 0.01 * distance), np.full(4 * n, limit)))
        exact = np.array([np.full(n, h), h * (duration - 0.5 * (ends[1:] + ends[:-1]))])
        found = linprog(np.zeros(n), rows, most, exact, [0.0, distance], (-acceleration, acceleration), method="highs")
        return found.status == 0

    short = duration_with_vibration(distance, speed, acceleration, math.inf)
    long = duration_with_vibration(distance, speed, min(acceleration, w * w * limit), math.inf) + 4.0 * math.pi / w
    while long - short > 1e-3 * long:
        middle = 0.5 * (short + long)
        short, long = (short, middle) if possible(middle) else (middle, long)
    return long


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.representatives(seed=[0])
def test_it_is_that_of_independent_dense_programmes(seed):
    rng = random.Random(seed)
    distance, acceleration = rng.uniform(0.05, 3.0), rng.uniform(0.5, 5.0)
    speed = math.sqrt(acceleration * distance) * rng.uniform(0.4, 1.2)
    w = rng.uniform(3.0, 14.0) / duration_with_vibration(distance, speed, acceleration, math.inf)
    zeta, limit = rng.choice([0.0, 0.05]), rng.uniform(0.3, 1.2) * acceleration / w**2
    move = fastest_move(
        distance, max_velocity=speed, max_acceleration=acceleration, modes=[Band(w, w, 0.01, zeta)], deflection_limit=limit
    )
    assert peak_of(move, w, zeta) <= limit * (1.0 + 1e-11)
    assert move.residual_vibration(w, zeta) <= 0.01
    assert move.lower_bound <= move.duration <= 1.003 * move.lower_bound
    found = by_cells(distance, speed, acceleration, w, zeta, limit)
    assert found >= move.lower_bound * (1.0 - 2e-3)
    assert move.duration <= found * 1.002
    assert move.duration == pytest.approx(found, rel=0.015)


def test_above_what_the_free_move_deflects_the_limit_changes_nothing():
    free = fastest_move(1.0, modes=[5.0], **LIMITS)
    loose = fastest_move(1.0, modes=[5.0], deflection_limit=2.0 * STATIC, **LIMITS)
    assert free.peak_deflection(5.0) == pytest.approx(peak_of(free, 5.0, 0.0), rel=1e-12)
    assert free.peak_deflection(5.0) == pytest.approx(0.17764, abs=1e-5)
    assert loose.duration == pytest.approx(free.duration, rel=1e-6)


@pytest.mark.parametrize(("share", "levels"), [(1.2, {0.0, 3.0}), (0.5, {1.5, 3.0})])
@pytest.mark.representatives(share=[0.5])
def test_within_the_static_deflection_the_fastest_move_holds_it(share, levels):
    """The acceleration that holds half of what 3 m/s2 make of the mode at rest is 1.5 m/s2; above the static one none is held."""
    move = fastest_move(1.0, modes=[5.0], deflection_limit=share * STATIC, **LIMITS)
    assert peak_of(move, 5.0, 0.0) == pytest.approx(share * STATIC, rel=1e-11)
    assert move.residual_vibration(5.0) < 1e-12
    assert {round(abs(a), 9) for a in move.controls} == levels


@pytest.mark.thorough
def test_on_off_commands_keep_the_limit_and_take_longer_the_fewer_pulses_they_have():
    durations = [shortest_move(1.0, modes=[5.0], deflection_limit=0.5 * STATIC, **LIMITS)]
    for pulses in (6, 3, 2):
        move = fastest_move(1.0, modes=[5.0], deflection_limit=0.5 * STATIC, on_off_pulses=pulses, **LIMITS)
        assert {round(abs(a), 9) for a in move.controls} == {0.0, 3.0}
        assert peak_of(move, 5.0, 0.0) <= 0.5 * STATIC * (1.0 + 1e-11)
        assert move.residual_vibration(5.0) < 1e-12
        durations.append(move.duration)
    assert durations == sorted(durations)
    assert durations[-1] < 1.02 * durations[0]


def test_a_free_body_of_two_masses_with_a_force_on_one_of_them():
    """m1 = 2 kg, m2 = 1 kg, k between them: its centre makes the move for F = (m1 + m2) a, and x1 - x2 = q (m1 + m2)/m1, by scipy."""
    m1, m2, k = 2.0, 1.0, 8.0
    w = math.sqrt(k * (m1 + m2) / (m1 * m2))
    most = 0.15
    move = fastest_move(1.0, max_acceleration=1.0, modes=[w], deflection_limit=most * m1 / (m1 + m2))
    state, peak = np.zeros(4), 0.0
    for begin, end, a in zip(move.switch_times[:-1], move.switch_times[1:], move.controls, strict=True):
        force = (m1 + m2) * a

        def rates(_: float, x: np.ndarray, force: float = force) -> list[float]:
            spring = k * (x[1] - x[0])
            return [x[2], x[3], (force + spring) / m1, -spring / m2]

        found = solve_ivp(rates, (begin, end), state, rtol=1e-10, atol=1e-12, max_step=(end - begin) / 200.0)
        peak, state = max(peak, float(np.abs(found.y[1] - found.y[0]).max())), found.y[:, -1]
    assert peak == pytest.approx(most, rel=1e-4)
    assert state == pytest.approx([1.0, 1.0, 0.0, 0.0], abs=1e-8)


def test_only_one_of_two_modes_is_limited_and_the_bound_alone_takes_the_limit():
    move = fastest_move(1.0, modes=[5.0, 14.0], deflection_limit=[STATIC, math.inf], **LIMITS)
    assert peak_of(move, 5.0, 0.0) <= STATIC * (1.0 + 1e-11)
    assert move.residuals == pytest.approx([0.0, 0.0], abs=1e-10)
    assert move.deflection_limits == (STATIC, math.inf)
    first, second = move.to_dict()["modes"]
    assert (first["deflection_limit"], first["peak_deflection"]) == (STATIC, move.peak_deflection(5.0))
    assert "deflection_limit" not in second
    assert shortest_move(1.0, modes=[5.0], deflection_limit=STATIC, **LIMITS) <= move.lower_bound * (1.0 + 1e-3)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"modes": [5.0], "deflection_limit": 0.0}, "deflection_limit = 0"),
        ({"modes": [5.0], "deflection_limit": math.nan}, "deflection_limit = nan"),
        ({"deflection_limit": 0.1}, "1 for 0 modes"),
        ({"modes": [5.0], "deflection_limit": [0.1, 0.2]}, "2 for 1 modes"),
        ({"modes": [Band(4.0, 5.0, 0.05)], "deflection_limit": 0.1}, "single frequencies"),
        ({"modes": [5.0], "deflection_limit": 0.1, "max_jerk": 60.0}, "max_jerk"),
        ({"modes": [5.0], "deflection_limit": 1e-7}, "periods"),
        ({"modes": [5.0], "deflection_limit": 0.1, "on_off_pulses": 13}, "on_off_pulses"),
        ({"modes": [5.0], "on_off_pulses": 2}, "deflection_limit"),
    ],
)
def test_impossible_limits_are_refused_by_name(arguments, word):
    with pytest.raises(ArgumentError, match=word):
        fastest_move(1.0, **LIMITS, **arguments)
