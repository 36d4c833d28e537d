"""Motion profiles as Python objects: derivatives, jumps, peaks."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from profile_cases import (
    DISTANCE,
    DURATION,
    FORMULAS,
    JUMPING,
    ZETA,
    W,
    laws,
    pieces,
    profile_at,
)

from shaper_fmu.design.profiles import profile


def integral(values, begin, end, panels=6):
    """Gauss-Legendre over smooth `values`."""
    nodes, weights = np.polynomial.legendre.leggauss(30)
    edges = np.linspace(begin, end, panels + 1)
    return sum((b - a) / 2 * np.sum(weights * values((a + b) / 2 + (b - a) / 2 * nodes)) for a, b in pairwise(edges))


@settings(max_examples=80, deadline=None)
@given(laws)
def test_velocity_and_acceleration_are_derivatives_on_every_piece(law):
    """Their integrals over each smooth piece are the changes of position and velocity, just inside the piece's ends."""
    fastest = np.abs(law.velocity(np.linspace(0.0, law.duration, 400))).max()
    for begin, end in pieces(law):
        last = np.nextafter(end, 0.0)
        moved = law.position(last) - law.position(begin)
        assert integral(law.velocity, begin, last) == pytest.approx(moved, abs=2e-13 * fastest * law.duration)
        gained = law.velocity(last) - law.velocity(begin)
        hardest = np.abs(law.acceleration(np.linspace(begin, last, 100))).max()
        assert integral(law.acceleration, begin, last) == pytest.approx(gained, abs=2e-13 * (fastest + hardest * law.duration))


@settings(max_examples=80, deadline=None)
@given(laws, st.floats(-0.1, 1.1))
def test_all_is_continuous_away_from_the_declared_jumps(law, fraction):
    step = 1e-9 * law.duration
    samples = np.linspace(0.0, law.duration, 500)
    for t in [fraction * law.duration, *(end - step / 2 for end in law.pieces)]:
        if any(t - step <= jump <= t + 2 * step for jump in law.jumps):
            continue
        for values in (law.position, law.velocity, law.acceleration):
            assert abs(values(t + step) - values(t)) <= 1e-5 * np.abs(values(samples)).max() + 1e-12


@settings(max_examples=60, deadline=None)
@given(laws)
def test_what_is_declared_a_jump_is_one(law):
    for jump in law.jumps:
        before, after = np.nextafter(jump, -1.0), jump
        leap = [
            abs(v(after) - v(before)) / max(1e-300, np.abs(v(np.linspace(0.0, law.duration, 300))).max())
            for v in (law.velocity, law.acceleration)
        ]
        assert max(leap) > 1e-5


@settings(max_examples=60, deadline=None)
@given(laws)
def test_the_distance_is_reached_exactly(law):
    assert law.position(law.duration) == law.distance
    assert law.position(np.nextafter(law.duration, 0.0)) == pytest.approx(
        law.distance, abs=1e-13 * (abs(law.distance) + law.peak_velocity * law.duration)
    )
    assert (law.position([-1.0, 0.0]) == 0.0).all()
    assert (law.velocity([-1.0, law.duration]) == 0.0).all()


@settings(max_examples=60, deadline=None)
@given(laws)
def test_peaks_are_those_of_a_dense_sampling(law):
    t = np.unique(np.concatenate([np.linspace(a, np.nextafter(b, 0.0), 1501) for a, b in pieces(law)]))
    assert np.abs(law.velocity(t)).max() == pytest.approx(law.peak_velocity, rel=2e-4)
    assert np.abs(law.velocity(t)).max() <= law.peak_velocity * (1 + 1e-12)
    if math.isfinite(law.peak_acceleration):
        assert np.abs(law.acceleration(t)).max() == pytest.approx(law.peak_acceleration, rel=2e-4)
        assert np.abs(law.acceleration(t)).max() <= law.peak_acceleration * (1 + 1e-12)
    else:
        assert law.kind in JUMPING


@pytest.mark.parametrize("kind", FORMULAS)
def test_the_object_is_the_component(kind):
    law = profile(kind, DISTANCE, DURATION, W, ZETA)
    t = np.linspace(-0.02, DURATION + 0.02, 47)
    expected = profile_at(t + 0.02, profile=kind, start_time=0.02)
    for values, row in zip((law.position, law.velocity, law.acceleration), expected, strict=True):
        assert values(t) == pytest.approx(row, rel=1e-9, abs=1e-9)


def test_a_step_as_an_object():
    law = profile("step", 3.0)
    assert (law.duration, law.jumps, law.peak_velocity, law.peak_acceleration) == (0.0, (0.0,), math.inf, math.inf)
    assert law.position([-1e-9, 0.0, 1.0]).tolist() == [0.0, 3.0, 3.0]
    assert law.residual_vibration(5.0, 0.3) == law.relative_residual(5.0, 0.3) == 1.0
