"""Moves: the fastest one through shapers, and profiles that leave less vibration."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.design.fastest import shortest_move
from shaper_fmu.design.profiles import profile
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.choice import choose
from shaper_fmu.tune.choice.requirements import Move, Requirements
from shaper_fmu.tune.identify.range import Range

W = 4.65


def test_a_move_that_is_slow_anyway_needs_no_shaper():
    boxes = [ModeBox.around(5.0, amplitudes=(1.0,)), ModeBox.around(12.0, amplitudes=(0.0,))]
    long = Move(1.0, max_velocity=0.01, max_acceleration=0.05)
    choice = choose(boxes, Requirements(move=long, kinds=("zv",)))
    assert choice.recommended is not None
    assert choice.recommended.delay == 0.0
    assert "no shaper is needed" in choice.reason
    # two ramps of 0.2 s, of which the beginnings are 100 s apart: V = (sin(0.5) / 0.5) |sin(250)| / 250 at 5 rad/s
    assert choice.recommended.worst_case == pytest.approx(math.sin(0.5) / 0.5 * abs(math.sin(250.0)) / 250.0, abs=1e-6)


def test_moves_are_compared_with_the_fastest_one():
    move = Move(1.0, max_velocity=1.0, max_acceleration=3.0)
    boxes = [ModeBox.around(W, 0.01, 0.1)]
    choice = choose(boxes, Requirements(move=move, kinds=("zv", "zvd", "s_curve", "cycloid", "two_part")))
    fastest = profile("trapezoid", 1.0, max_velocity=1.0, max_acceleration=3.0)
    assert {one.name for one in choice.left_out} == {"two part"}  # its velocity jumps
    assert choice.recommended is not None
    assert choice.recommended.worst_case <= 0.05
    grid = [(a, b) for a in np.linspace(*boxes[0].frequencies, 41) for b in (0.01,)]
    for one in choice.candidates:
        assert one.profile is not None
        assert one.delay == pytest.approx(one.profile.duration - fastest.duration + one.sequence.duration, abs=1e-12)
        assert one.profile.peak_velocity <= 1.0 + 1e-12
        assert one.profile.peak_acceleration <= 3.0 + 1e-9
        seen = max(one.profile.residual_vibration(a, b) * one.sequence.residual_vibration(a, b) for a, b in grid)
        assert seen <= one.worst_case
        if not one.design.factors:
            assert one.worst_case <= seen + 1e-3
    assert {one.profile.kind.name for one in choice.candidates if one.profile} == {"trapezoid", "s_curve", "cycloid"}


@pytest.mark.representatives(gap=[0.02])
@pytest.mark.parametrize(
    ("box", "wanted", "gap"),
    [
        (ModeBox.around(5.0), {}, 1e-3),  # 1.429 s in reference numbers of linear programmes on a fine grid
        (ModeBox.around(5.0, 0.02, 0.1), {"nominal_tolerance": 0.01}, 1e-3),
        (ModeBox(Range(4.6, 5.0, 5.3), Range(0.01, 0.02, 0.1)), {}, 0.02),  # the floor knows the least damping alone
    ],
)
def test_the_fastest_move_without_vibration_is_recommended_and_lies_on_the_floor(box, wanted, gap):
    """Its V by the exact integral over each segment (Duhamel), at every corner and between; limits by its pieces."""
    move = Move(1.0, max_velocity=1.0, max_acceleration=3.0)
    choice = choose([box], Requirements(move=move, **wanted))
    best, fastest = choice.recommended, 4.0 / 3.0
    assert best is not None
    assert best.profile is not None
    assert best.profile.kind.name == "fastest"
    assert choice.floor is not None
    assert choice.floor <= best.delay <= choice.floor + gap * (choice.floor + fastest)
    assert best.delay < 0.75 * min(one.delay for one in choice.candidates if one is not best and one.worst_case <= 0.05)
    assert best.profile.peak_velocity <= 1.0 + 1e-9
    assert best.profile.peak_acceleration <= 3.0 + 1e-9
    (low, high), (light, heavy) = box.frequencies, box.dampings
    for zeta in np.linspace(light, heavy, 3):
        for w in np.linspace(low, high, 21):
            t = np.linspace(0.0, best.profile.duration, 20001)
            a = best.profile.acceleration(0.5 * (t[1:] + t[:-1]))
            pole = complex(-zeta * w, w * math.sqrt(1.0 - zeta * zeta))
            swing = (a * np.diff(np.exp(pole * (t[-1] - t)))).sum() / pole
            assert abs(swing) / (w * 1.0) <= best.worst_case + 2e-4
    if box.frequencies[0] == box.frequencies[1]:
        assert fastest + best.delay == pytest.approx(1.429, abs=1e-3)


def test_why_there_is_no_fastest_move_is_told():
    choice = choose([ModeBox.around(5.0)], Requirements(move=Move(1.0, max_velocity=1.0), kinds=("fastest", "cycloid")))
    (entry,) = [one for one in choice.left_out if one.name == "fastest"]
    assert "needs max_acceleration" in entry.reason


@pytest.mark.parametrize("nominal", [1.0, 0.01])
def test_no_move_that_fits_is_below_the_floor_of_moves(nominal):
    """The floor is a linear programme's; for one known mode it is the lower bound of the fastest move at that tolerance."""
    move = Move(1.0, max_velocity=1.0, max_acceleration=3.0)
    choice = choose([ModeBox.around(W, 0.01, 0.05)], Requirements(move=move, nominal_tolerance=nominal))
    fitting = [one.delay for one in choice.candidates if one.worst_case <= 0.05 and one.nominal <= nominal]
    assert choice.floor
    assert min(fitting) >= choice.floor
    assert f"less than {choice.floor:.4g} s later than the fastest one" in choice.reason
    exact = choose([ModeBox.around(W)], Requirements(move=move, kinds=("zv",)))
    bound = shortest_move(1.0, max_velocity=1.0, max_acceleration=3.0, modes=[W], tolerance=0.05)
    assert exact.floor == pytest.approx(bound - 4.0 / 3.0, abs=1e-9)


def test_a_profiles_duration_is_the_shortest_that_fits():
    """A cycloid: V = |sin(x) / (x (1 - x^2 / pi^2))| with x = w T / 2, falling from 1 to 0 at x = 2 pi."""
    choice = choose([ModeBox.around(W)], Requirements(move=Move(1.0), kinds=("cycloid",)))
    assert choice.recommended is not None
    assert choice.recommended.profile is not None
    x = 0.5 * W * choice.recommended.profile.duration
    assert abs(math.sin(x) / (x * (1.0 - x * x / math.pi**2))) == pytest.approx(choice.recommended.worst_case, abs=1e-6)
    assert 0.95 * 0.05 < choice.recommended.worst_case <= 0.05


def test_a_move_that_leaves_less_nominally():
    """A cycloid: V = |sin(x) / (x (1 - x^2 / pi^2))| with x = w T / 2, and 0 at x = 2 pi; ZV on w0: |cos(pi w / (2 w0))|."""
    box = ModeBox(Range(0.9 * W, 1.02 * W, 1.05 * W), Range(0.0, 0.0, 0.0))
    plain, nominal = (
        choose([box], Requirements(0.1, move=Move(1.0), kinds=("zv", "cycloid"), nominal_tolerance=limit)).recommended
        for limit in (1.0, 0.002)
    )
    assert plain is not None
    assert nominal is not None
    assert plain.nominal > 0.002 >= nominal.nominal
    assert nominal.worst_case <= 0.1
    assert nominal.delay >= plain.delay
    for one in (plain, nominal):
        assert one.profile is not None
        x = 0.5 * 1.02 * W * one.profile.duration
        left = abs(math.sin(x) / (x * (1.0 - x * x / math.pi**2))) if x else 1.0
        for factor in one.design.factors:
            left *= abs(math.cos(0.5 * math.pi * 1.02 * W / factor.frequencies[0]))
        assert one.nominal == pytest.approx(left, abs=1e-9)
