"""The fastest move without vibration: a table of numbers, its proof, independent programmes, and moves that nobody chose."""

from __future__ import annotations

import csv
import io
import json
import math
import random
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import linprog

from shaper_fmu.design.fastest import FastestMove, fastest_move, shortest_move
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.moves.certificate import certificate
from shaper_fmu.design.moves.programme import MoveProgramme
from shaper_fmu.design.moves.task import Task, duration_with_vibration
from shaper_fmu.design.profiles import profile
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ArgumentError

LIMITS: dict[str, Any] = {"max_velocity": 1.0, "max_acceleration": 3.0}
NOMINAL = Band(5.0, 5.0, 0.001)

TABLE = [  # durations [s] by linear programmes of 400 cells of constant acceleration and bisection, made apart from this package
    (1.0, [NOMINAL], 1.459),
    (1.0, [Band(5.0, 5.0, 0.05)], 1.429),
    (1.0, [NOMINAL, Band(14.0, 14.0, 0.001, 0.02)], 1.460),
    (1.0, [Band(4.5, 4.5, 0.05), Band(5.5, 5.5, 0.05), Band(5.0, 5.0, 0.01)], 1.723),
    (0.5, [NOMINAL], 1.205),
    (0.2, [NOMINAL], 0.967),
    (0.1, [NOMINAL], 0.820),
    (0.05, [NOMINAL], 0.695),
]


@pytest.mark.parametrize(("distance", "modes", "duration"), TABLE)
def test_the_table_of_durations(distance, modes, duration):
    move = fastest_move(distance, modes=modes, **LIMITS)
    assert move.duration == pytest.approx(duration, rel=0.003)
    check(move)


def test_a_trapezoid_is_faster_and_vibrates_and_through_zv_it_is_slower():
    law, zv = profile("trapezoid", 1.0, **LIMITS), shaper("zv", 5.0)
    move = fastest_move(1.0, modes=[5.0], **LIMITS)
    assert law.duration == pytest.approx(4.0 / 3.0)
    assert law.residual_vibration(5.0) > 0.2
    assert law.duration + zv.duration == pytest.approx(1.962, abs=5e-4)
    assert move.duration == pytest.approx(1.4585, abs=5e-5)
    assert len(move.segments) == 6
    assert move.residual_vibration(5.0) < 1e-13


def check(move: FastestMove) -> None:
    """Rest at both ends, limits, tolerances, and the proof: at the segments' ends and beside, from the object's own motion."""
    t = np.unique(np.concatenate([np.linspace(0.0, move.duration, 4001), move.switch_times]))
    v, a = move.velocity(t), move.acceleration(t)
    rounding = 1.0 + 1e-11
    assert np.abs(v).max() <= move.max_velocity * rounding
    assert np.abs(a).max() <= move.max_acceleration * rounding
    assert max(abs(one.jerk) for one in move.segments) <= (move.max_jerk if move.order == 3 else 0.0)
    end = np.array([math.nextafter(move.duration, 0.0)])
    assert move.position(end)[0] == pytest.approx(move.distance, rel=1e-10)
    assert abs(move.velocity(end)[0]) <= 1e-10 * np.abs(v).max()
    if move.order == 3:
        assert abs(move.acceleration(end)[0]) <= 1e-8 * np.abs(a).max()
    for band, residual in zip(move.modes, move.residuals, strict=True):
        frequencies = np.linspace(band.low, band.high, 60 if band.high > band.low else 1)
        assert residual <= max(band.tolerance, 1e-10)
        assert all(move.residual_vibration(w, band.damping_ratio) <= residual * rounding + 1e-15 for w in frequencies)
    assert move.duration_with_vibration <= move.lower_bound * rounding
    assert move.lower_bound <= move.duration * rounding


def random_task(seed: int) -> dict:
    """Limits, one or two modes up to five periods in the move, damping up to 0.2, with and without tolerance and width."""
    rng = random.Random(seed)
    distance, acceleration = 10.0 ** rng.uniform(-2.0, 1.0), 10.0 ** rng.uniform(-0.5, 1.0)
    speed = math.sqrt(acceleration * distance) * 10.0 ** rng.uniform(-0.7, 0.3)
    time = duration_with_vibration(distance, speed, acceleration, math.inf)
    jerk = acceleration / (time * 10.0 ** rng.uniform(-1.7, -0.3)) if rng.random() < 0.5 else math.inf
    modes = []
    for _ in range(rng.choice([1, 2])):
        w = 2.0 * math.pi / time * 10.0 ** rng.uniform(-0.4, 0.7)
        tolerance = rng.choice([0.0, 0.0, 0.02, 0.05])
        width = rng.choice([0.0, 0.05]) if tolerance else 0.0
        modes.append(Band(w * (1.0 - width), w * (1.0 + width), tolerance, rng.choice([0.0, 0.02, 0.1, 0.2])))
    return {
        "distance": distance * rng.choice([-1.0, 1.0]),
        "max_velocity": speed,
        "max_acceleration": acceleration,
        "max_jerk": jerk,
        "modes": modes,
    }


@pytest.mark.parametrize("seed", range(100))
@pytest.mark.representatives(seed=range(8))
def test_a_random_move_keeps_everything_and_is_within_half_a_percent_of_what_is_proven(seed):
    move = fastest_move(**random_task(seed))
    check(move)
    assert move.duration <= 1.005 * move.lower_bound


def by_cells(distance: float, speed: float, acceleration: float, w: float, zeta: float, tolerance: float) -> float:
    """Shortest duration [s] of a grid of 200 cells of constant acceleration: bisection over dense linear programmes, which
    ask only whether there is a move; speeds are partial sums, and the residual is in a polygon of 32 sides around the circle."""
    n, pole = 200, w * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
    phases = np.exp(2j * math.pi * np.arange(32) / 32).tolist()

    def possible(duration: float) -> bool:
        h = duration / n
        ends = h * np.arange(n + 1)
        middles = 0.5 * (ends[1:] + ends[:-1])
        grown = np.exp(pole * (duration - ends)) / pole**2
        residual = np.array([np.real(phase * (grown[:-1] - grown[1:])) for phase in phases])
        sums = h * np.tril(np.ones((n, n)))
        rows = np.vstack((sums, -sums, residual))
        most = np.concatenate((np.full(2 * n, speed), np.full(32, tolerance * distance)))
        exact = np.array([np.full(n, h), h * (duration - middles)])
        found = linprog(np.zeros(n), rows, most, exact, [0.0, distance], (-acceleration, acceleration), method="highs")
        return found.status == 0

    short = duration_with_vibration(distance, speed, acceleration, math.inf)
    long = short + 2.0 * math.pi / w
    while long - short > 5e-4 * long:
        middle = 0.5 * (short + long)
        short, long = (short, middle) if possible(middle) else (middle, long)
    return long


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.representatives(seed=range(3))
def test_brute_force_on_a_fine_grid_finds_no_faster_move_and_the_same_one(seed):
    rng = random.Random(1000 + seed)
    distance, acceleration, tolerance = rng.uniform(0.05, 3.0), rng.uniform(0.5, 5.0), 0.01
    speed = math.sqrt(acceleration * distance) * rng.uniform(0.4, 1.2)
    time = duration_with_vibration(distance, speed, acceleration, math.inf)
    w, zeta = rng.uniform(2.0, 16.0) / time, rng.choice([0.0, 0.05])
    move = fastest_move(
        distance, max_velocity=speed, max_acceleration=acceleration, modes=[Band(w, w, tolerance, zeta)]
    )  # fmt: skip
    found = by_cells(distance, speed, acceleration, w, zeta, tolerance)
    assert found >= move.lower_bound * (1.0 - 1e-3)
    assert move.duration <= found * 1.001
    assert move.duration == pytest.approx(found, rel=0.01)


RUCKIG = [  # distance, limits of speed, acceleration and jerk, and the duration [s] that ruckig 0.19.4 gives for rest to rest
    (0.106, 0.603, 4.58, math.inf, 0.307447117),
    (0.674, 0.595, 5.19, 14.3, 1.540735812),
    (2.2, 1.444, 2.45, 146.4, 2.129668434),
    (0.342, 1.609, 6.77, 264.5, 0.475843256),
    (0.068, 1.054, 5.26, math.inf, 0.227400586),
    (0.448, 2.321, 6.06, 34.6, 0.746445804),
    (1.473, 2.0, 4.93, 18.7, 1.405815877),
    (2.536, 4.788, 4.05, 214.5, 1.601615416),
    (0.052, 0.166, 1.52, 88.2, 0.439697098),
    (0.288, 0.908, 5.2, 163.4, 0.523619747),
]


@pytest.mark.parametrize(("distance", "speed", "acceleration", "jerk", "duration"), RUCKIG)
def test_without_modes_it_is_the_time_optimal_move_of_a_trajectory_generator(distance, speed, acceleration, jerk, duration):
    """ruckig (Berscheid and Kroeger 2021): time-optimal moves within limits, without a word on vibration."""
    assert duration_with_vibration(distance, speed, acceleration, jerk) == pytest.approx(duration, abs=1e-9)
    move = fastest_move(distance, max_velocity=speed, max_acceleration=acceleration, max_jerk=jerk)
    assert move.duration == pytest.approx(duration, rel=5e-5)
    assert move.lower_bound == pytest.approx(duration, rel=1e-3)
    check(move)


@pytest.mark.parametrize("jerk", [math.inf, 60.0])
def test_the_certificate_is_a_bound_by_quadrature_too(jerk):
    """D <= U int |phi| + sum |m| X, with the integral by scipy; and every move that is tried is below it."""
    task = Task((1.2, 5.0, jerk), (Band(6.0, 6.0, 0.0, 0.05),))
    duration = 1.1
    move = MoveProgramme(task).farthest(np.linspace(0.0, 1.0, 241), duration)
    proof = certificate(task, move)
    bound = proof.farthest(duration)
    points = (proof.grid * duration)[1:-1:4]
    size = quad(
        lambda t: abs(float(proof.switching_function(np.array([t]), duration)[0])), 0.0, duration, points=points, limit=4000
    )
    costs = sum(
        task.limits[one.derivative - 1] * np.abs(one.values[one.times < 1.0]).sum() for one in proof.states if one.times.size
    )
    assert bound == pytest.approx(task.largest_control * size[0] + costs, rel=1e-4)
    assert move.distance <= bound <= move.distance * 1.002


def test_a_move_is_the_same_in_other_units_and_in_the_other_direction():
    move = fastest_move(1.0, modes=[(5.0, 0.02)], **LIMITS)
    other = fastest_move(-1000.0, max_velocity=1000.0, max_acceleration=3000.0, modes=[(5.0, 0.02)])
    assert other.duration == pytest.approx(move.duration, rel=1e-9)
    assert np.array(other.controls) == pytest.approx(-1000.0 * np.array(move.controls), abs=1e-6)
    assert other.position(0.7) == pytest.approx(-1000.0 * move.position(0.7), rel=1e-7)


def test_the_lower_bound_alone_is_that_of_the_move():
    assert shortest_move(1.0, modes=[5.0], **LIMITS) == fastest_move(1.0, modes=[5.0], **LIMITS).lower_bound


def test_json_and_csv_hold_every_number():
    move = fastest_move(1.0, modes=[5.0], **LIMITS)
    read = json.loads(move.to_json())
    assert read["duration"] == move.duration
    assert read["max_jerk"] is None
    assert [tuple(one.values()) for one in read["segments"]] == [tuple(vars(one).values()) for one in move.segments]
    header, *rows = csv.reader(io.StringIO(move.to_csv()))
    assert header[4] == "acceleration [m/s2]"
    assert [list(map(float, row)) for row in rows] == [list(vars(one).values()) for one in move.segments]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"distance": 0.0, "max_acceleration": 1.0}, "distance"),
        ({"distance": math.nan, "max_acceleration": 1.0}, "distance"),
        ({"distance": 1.0}, "max_jerk"),
        ({"distance": 1.0, "max_velocity": 1.0}, "max_acceleration"),
        ({"distance": 1.0, "max_acceleration": -1.0}, "max_acceleration"),
        ({"distance": 1.0, "max_acceleration": math.nan}, "max_acceleration"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [0.0]}, "frequencies"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [(5.0, 1.0)]}, "damping"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [Band(4.0, 5.0, 0.0)]}, "tolerance"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [5.0], "tolerance": 1.0}, "tolerance"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [5000.0]}, "periods"),
        ({"distance": 1.0, "max_acceleration": 1.0, "modes": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]}, "limit: 6"),
    ],
)
def test_impossible_arguments_are_refused_by_name(arguments, word):
    with pytest.raises(ArgumentError, match=word):
        fastest_move(**arguments)


@pytest.mark.parametrize("jerk", [60.0, 20.0])
def test_with_a_limited_jerk_it_is_that_of_independent_programmes_in_which_the_acceleration_is_zero_at_both_ends(jerk):
    """One metre at 1 m/s and 3 m/s2, 0.1 % at 5 rad/s: bisection over dense programmes of 120 cells of constant jerk.

    With a limit of the jerk at the beginning alone, so that the acceleration may jump at the end, it would be 1.482 and 1.535 s.
    """
    n = 120

    def possible(duration: float) -> bool:
        h, one = duration / n, np.tril(np.ones((n, n)))
        acceleration = h * one
        speed = h * (one @ acceleration) - 0.5 * h * acceleration  # trapezoids of the acceleration, which is linear in each cell
        way = np.array([(duration - (k + 0.5) * h) ** 2 / 2.0 * h + h**3 / 24.0 for k in range(n)])
        ends = h * np.arange(n + 1)
        grown = np.exp(5j * (duration - ends)) / 5j**3
        residual = [np.real(np.exp(2j * math.pi * k / 32) * (grown[:-1] - grown[1:])) for k in range(32)]
        rows = np.vstack((speed, -speed, acceleration, -acceleration, residual))
        most = np.concatenate((np.ones(2 * n), np.full(2 * n, 3.0), np.full(32, 0.001)))
        exact = np.array([acceleration[-1], speed[-1], way])
        found = linprog(np.zeros(n), rows, most, exact, [0.0, 0.0, 1.0], (-jerk, jerk), method="highs")
        return found.status == 0

    short, long = 1.4, 1.8
    while long - short > 5e-4:
        middle = 0.5 * (short + long)
        short, long = (short, middle) if possible(middle) else (middle, long)
    move = fastest_move(1.0, max_jerk=jerk, modes=[NOMINAL], **LIMITS)
    assert move.duration == pytest.approx(long, rel=0.003)
    check(move)


def test_slow_modes_and_hard_jerks():
    """A mode of a hundredth of a radian per second; a jerk so hard that its ramps take a thousandth of the move."""
    slow = fastest_move(1.0, modes=[0.02], **LIMITS)
    check(slow)
    assert slow.duration <= 1.001 * slow.lower_bound
    soft = fastest_move(1.0, modes=[5.0], **LIMITS)
    for jerk in (300.0, 3000.0):
        hard = fastest_move(1.0, modes=[5.0], max_jerk=jerk, **LIMITS)
        check(hard)
        assert soft.duration < hard.duration < soft.duration + 3.5 * LIMITS["max_acceleration"] / jerk  # ramps instead of jumps
        assert hard.duration <= 1.002 * hard.lower_bound
