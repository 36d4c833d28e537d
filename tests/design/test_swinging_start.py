"""Shaping from a swinging start: two jumps of the base's speed, against an integrator, ZV, and their limits."""

from __future__ import annotations

import math
import random

import pytest
from scipy.integrate import solve_ivp

from shaper_fmu.design import impulses_from_swing, shaper
from shaper_fmu.errors import ArgumentError, NoSolutionError


def swing_by_scipy(found, w: float, zeta: float, deflection: float, rate: float) -> float:
    """Speed amplitude after the last jump; each jump v of the base's speed is one of -v of the deflection's rate."""
    now = 0.0
    for time, size in zip(found.times, found.sizes, strict=True):
        if time > now:
            slopes = lambda _, y: [y[1], -w * w * y[0] - 2.0 * zeta * w * y[1]]  # noqa: E731
            ran = solve_ivp(slopes, (now, time), [deflection, rate], method="DOP853", rtol=1e-12, atol=1e-14)
            deflection, rate = ran.y[:, -1].tolist()
        now, rate = time, rate - size
    return math.hypot(rate, w * deflection)


@pytest.mark.parametrize("seed", range(30))
def test_the_load_rests_after_the_second_jump(seed):
    rng = random.Random(seed)
    w, zeta, step = rng.uniform(0.5, 9.0), rng.choice([0.0, 0.0, 0.05, 0.3]), rng.choice([0.0, rng.uniform(-1.0, 1.0)])
    deflection, rate = rng.uniform(-1.0, 1.0) / w, rng.uniform(-1.0, 1.0)
    found = impulses_from_swing(step, w, zeta, deflection=deflection, rate=rate)
    scale = 1.0 + max(map(abs, found.sizes))
    assert math.fsum(found.sizes) == pytest.approx(step, abs=1e-14 * scale)
    assert swing_by_scipy(found, w, zeta, deflection, rate) < 1e-10 * scale
    assert found.swing_left(w, zeta, deflection, rate) < 1e-13 * scale
    assert found.times[0] == 0.0


@pytest.mark.parametrize("zeta", [0.0, 0.1])
def test_without_a_swing_it_is_the_zv_shaper(zeta):
    zv, found = shaper("zv", 5.0, zeta), impulses_from_swing(2.0, 5.0, zeta)
    assert found.times == pytest.approx(zv.delays, abs=1e-14)
    assert [v / 2.0 for v in found.sizes] == pytest.approx(list(zv.amplitudes), abs=1e-14)


@pytest.mark.parametrize("phase", [0.0, 0.7, 2.0, 3.0, -1.2])
@pytest.mark.parametrize(("speed", "positive"), [(0.999, True), (1.001, False)])
def test_both_jumps_are_positive_if_the_load_swings_slower_than_the_step(phase, speed, positive):
    found = impulses_from_swing(1.0, 4.0, deflection=speed * math.sin(phase) / 4.0, rate=speed * math.cos(phase))
    assert (min(found.sizes) > 0.0) == positive


def test_a_swing_alone_is_taken_away_by_two_halves_if_there_is_time_to_wait():
    """A rate of 0.3 m/s: jumps of half of that, half a swing apart, are the smallest; a swing straight down asks for no wait."""
    found = impulses_from_swing(0.0, 2.0, deflection=0.15, rate=0.0, largest=0.1501)
    assert max(map(abs, found.sizes)) <= 0.1501
    assert found.times[0] > 0.5
    assert swing_by_scipy(found, 2.0, 0.0, 0.15, 0.0) < 1e-11
    with pytest.raises(NoSolutionError, match=r"no two jumps of at most 0\.14 m/s do; with 0\.15 m/s"):
        impulses_from_swing(0.0, 2.0, deflection=0.15, largest=0.14)


def test_at_rest_there_is_nothing_to_do():
    found = impulses_from_swing(0.0, 2.0)
    assert (found.times, found.sizes, found.duration) == ((), (), 0.0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"step": math.nan, "natural_frequency": 1.0}, "step"),
        ({"step": 1.0, "natural_frequency": 0.0}, "w > 0"),
        ({"step": 1.0, "natural_frequency": 1.0, "damping_ratio": 1.0}, "zeta < 1"),
        ({"step": 1.0, "natural_frequency": 1.0, "rate": math.inf}, "rate"),
        ({"step": 1.0, "natural_frequency": 1.0, "largest": 0.0}, "largest"),
    ],
)
def test_impossible_arguments_are_refused_by_name(arguments, word):
    with pytest.raises(ArgumentError, match=word):
        impulses_from_swing(**arguments)


@pytest.mark.parametrize("deflection", [0.1, -0.1])
def test_a_swing_that_no_jump_at_once_takes_away_is_taken_away_a_little_later(deflection):
    """At its turn: two jumps that add up to nothing would have to be at the same time, and without end."""
    found = impulses_from_swing(0.0, 5.0, deflection=deflection)
    assert 0.0 < found.times[0] < found.times[1] < math.inf
    assert max(map(abs, found.sizes)) < 100.0 * 5.0 * abs(deflection)
    assert swing_by_scipy(found, 5.0, 0.0, deflection, 0.0) < 1e-9


def test_the_size_that_is_named_is_large_enough():
    """The least is 0.50032137..., which may not be rounded down."""
    arguments = {"step": 1.0, "natural_frequency": 0.39395924947350747, "rate": -0.09804403532815224}
    with pytest.raises(NoSolutionError, match=r"with [\d.]+ m/s") as refused:
        impulses_from_swing(**arguments, largest=0.1)
    named = float(str(refused.value).split(" with ")[1].split()[0])
    assert max(impulses_from_swing(**arguments, largest=named).sizes) <= named
