"""Shapers found by linear programming: the floor, specified insensitivity, and two modes directly."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.optimize import linprog

from shaper_fmu.design.floor import distance_to_floor, shortest_duration
from shaper_fmu.design.impulse_sequence import ImpulseSequence, convolve_all
from shaper_fmu.design.lp.exchange import shortest_on_grid
from shaper_fmu.design.lp.layout import Band, GeneralLayout, SymmetricLayout
from shaper_fmu.design.specified_bands import specified_insensitivity
from shaper_fmu.design.two_mode import direct_two_mode
from shaper_fmu.errors import ComponentError
from shaper_fmu.shapers.zero_derivative import zero_derivative

TURN = 2.0 * math.pi

FLOOR = {
    0.0637: 0.500,
    0.1: 0.742,
    0.2: 0.888,
    0.3: 0.942,
    0.3995: 1.000,
    0.5: 1.246,
    0.6: 1.367,
    0.7245: 1.500,
    0.8: 1.701,
    0.9: 1.884,
    0.9639: 2.000,
    1.1: 2.40,
    1.2: 2.76,
}
"""Insensitivity at 5 %, and the shortest duration of a positive shaper [T]."""


def independent_v(sequence: ImpulseSequence, w: float, zeta: float = 0.0) -> float:
    """V from the definition, with complex exponentials."""
    pole = complex(zeta * w, w * math.sqrt(1.0 - zeta * zeta))
    total = sum(a * cmath.exp(pole * t) for a, t in zip(sequence.amplitudes, sequence.delays, strict=True))
    return math.exp(-zeta * w * sequence.duration) * abs(total)


def largest_v(sequence: ImpulseSequence, low: float, high: float, zeta: float = 0.0) -> float:
    return max(independent_v(sequence, float(w), zeta) for w in np.linspace(low, high, 4001))


def check_positive(sequence: ImpulseSequence) -> None:
    assert min(sequence.amplitudes) > 0.0
    assert abs(math.fsum(sequence.amplitudes) - 1.0) < 1e-12
    assert sequence.delays[0] == 0.0
    assert all(a < b for a, b in zip(sequence.delays, sequence.delays[1:], strict=False))


def equally_spaced(*amplitudes: float) -> ImpulseSequence:
    """Impulses half a period apart, for T = 1 s."""
    return ImpulseSequence(amplitudes, tuple(0.5 * i for i in range(len(amplitudes))))


def two_hump(v: float = 0.05) -> ImpulseSequence:
    x = (v * v * (math.sqrt(1.0 - v * v) + 1.0)) ** (1.0 / 3.0)
    a = (3.0 * x * x + 2.0 * x + 3.0 * v * v) / (16.0 * x)
    return equally_spaced(a, 0.5 - a, 0.5 - a, a)


def three_hump(v: float = 0.05) -> ImpulseSequence:
    a = (1.0 + 3.0 * v + 2.0 * math.sqrt(2.0 * (v * v + v))) / 16.0
    b = (1.0 - v) / 4.0
    return equally_spaced(a, b, 1.0 - 2.0 * (a + b), b, a)


def zero_derivative_sequence(order: int, w: float, zeta: float) -> ImpulseSequence:
    amplitudes, delays = [0.0] * 4, [0.0] * 4
    count = zero_derivative(amplitudes, delays, order, w, zeta)
    return ImpulseSequence(tuple(amplitudes[:count]), tuple(delays[:count]), 0.0)


@pytest.mark.parametrize(("insensitivity", "duration"), FLOOR.items())
def test_floor_table(insensitivity: float, duration: float) -> None:
    assert shortest_duration(insensitivity) == pytest.approx(duration, abs=0.006)


def test_floor_of_a_single_frequency_is_a_pair_of_impulses() -> None:
    assert shortest_duration(0.0, 0.1) == pytest.approx(math.acos(0.1) / math.pi, abs=1e-10)


def test_floor_rises_with_insensitivity_and_falls_with_tolerance() -> None:
    durations = [shortest_duration(i) for i in (0.05, 0.0637, 0.35, 0.45, 0.75, 1.3)]
    assert durations == sorted(durations)
    assert shortest_duration(0.5, 0.02) > shortest_duration(0.5, 0.05) > shortest_duration(0.5, 0.1)


def test_nothing_of_three_periods_reaches_an_insensitivity_of_one_and_a_half() -> None:
    """A lower bound of its own: a weight on frequencies that no positive sequence of 3 T can make small.

    On the band [.25, 1.75] some nonnegative combination of +-cos(w s), with weights that add up to 1, exceeds 5 % for every
    |s| <= D/2; so its mean over any symmetric sequence does, and with it the largest V.
    """
    offsets = TURN * np.linspace(0.0, 1.5, 1201)
    frequencies = np.linspace(0.25, 1.75, 241)
    cosines = np.cos(np.outer(offsets, frequencies))
    n = len(frequencies)
    matrix = np.hstack((-cosines[::8], cosines[::8], np.ones((len(offsets[::8]), 1))))
    result = linprog(
        np.r_[np.zeros(2 * n), -1.0], matrix, np.zeros(len(matrix)), np.r_[np.ones(2 * n), 0.0][None], [1.0], method="highs"
    )
    weights = np.maximum(result.x[:n], 0.0) - np.maximum(result.x[n : 2 * n], 0.0)
    assert np.min(cosines @ weights) / np.abs(weights).sum() > 0.06
    assert shortest_duration(1.5) == pytest.approx(4.58, abs=0.006)


def test_symmetric_sequences_are_optimal_without_damping() -> None:
    band = [Band(0.75, 1.25, 0.05)]
    general = shortest_on_grid(band, GeneralLayout, 1e-4)[0]
    assert general == pytest.approx(shortest_on_grid(band, SymmetricLayout, 1e-4)[0], rel=1e-3)
    assert general == pytest.approx(TURN * shortest_duration(0.5), rel=1e-3)


@pytest.mark.parametrize(
    "sequence",
    [equally_spaced(0.5, 0.5), equally_spaced(0.2625, 0.475, 0.2625), two_hump(), three_hump()],
    ids=["ZV", "EI", "2-hump", "3-hump"],
)
def test_zv_and_the_ei_family_lie_on_the_floor(sequence: ImpulseSequence) -> None:
    assert distance_to_floor(sequence, TURN) == pytest.approx(0.0, abs=1e-6)


def test_zvd_lies_above_the_floor() -> None:
    distance = distance_to_floor(equally_spaced(0.25, 0.5, 0.25), TURN)
    assert distance == pytest.approx(1.0 / 0.9344 - 1.0, abs=0.001)


def test_distance_does_not_depend_on_the_unit_of_time() -> None:
    slow = ImpulseSequence((0.25, 0.5, 0.25), (0.0, 5.0, 10.0))
    assert distance_to_floor(slow, 0.1 * TURN) == pytest.approx(distance_to_floor(equally_spaced(0.25, 0.5, 0.25), TURN), abs=1e-9)


def test_distance_uses_the_band_where_it_lies() -> None:
    """MZV tolerates more above its frequency than below; a design for just that band is as long as MZV."""
    root = math.sqrt(0.5)
    modified = ImpulseSequence((1.0 - root, 2.0 * root - 1.0, 1.0 - root), (0.0, 0.375, 0.75))
    assert distance_to_floor(modified, TURN) == pytest.approx(0.0, abs=1e-6)


def test_distance_of_a_damped_mode() -> None:
    zv = zero_derivative_sequence(0, TURN, 0.1)
    zvd = zero_derivative_sequence(1, TURN, 0.1)
    of_zv, of_zvd = (distance_to_floor(s, TURN, damping_ratio=0.1) for s in (zv, zvd))
    assert of_zv is not None
    assert of_zvd is not None
    assert -1e-6 < of_zv < of_zvd < 0.2
    assert distance_to_floor(zv, TURN) is None  # on an undamped mode it leaves more than 5 %


def test_no_distance_without_a_floor() -> None:
    assert distance_to_floor(ImpulseSequence((1.0, -1.0, 1.0), (0.0, 1 / 6, 1 / 3)), TURN) is None
    assert distance_to_floor(ImpulseSequence((1.0,), (0.0,)), TURN) is None
    assert distance_to_floor(ImpulseSequence((0.7, 0.3), (0.0, 0.5)), TURN) is None


@pytest.mark.parametrize("insensitivity", [0.0637, 0.1, 0.3, 0.3995, 0.6, 0.7245, 0.9639, 1.2])
def test_specified_insensitivity_is_reached_on_the_floor(insensitivity: float) -> None:
    w = 7.3
    half = 0.5 * insensitivity
    sequence = specified_insensitivity(w * (1.0 - half), w * (1.0 + half))
    check_positive(sequence)
    assert sequence.certificate <= 0.05e-9
    assert sequence.insensitivity(w, 0.0, 0.05 * (1.0 + 1e-8)) >= insensitivity - 1e-12
    assert largest_v(sequence, w * (1.0 - half), w * (1.0 + half)) <= 0.05 * (1.0 + 1e-9)
    grid = shortest_on_grid([Band(1.0 - half, 1.0 + half, 0.05)], SymmetricLayout, 1e-5)[0]
    assert sequence.duration * w == pytest.approx(grid, rel=1e-3)
    assert sequence.duration * w / TURN < 1.01 * FLOOR.get(insensitivity, math.inf)


def test_design_for_the_band_of_ei_is_ei() -> None:
    half = 1.0 - math.acos((3 * 0.05 - 1.0) / 1.05) / math.pi
    sequence = specified_insensitivity(TURN * (1.0 - half), TURN * (1.0 + half))
    assert sequence.amplitudes == pytest.approx((0.2625, 0.475, 0.2625), abs=1e-5)
    assert sequence.delays == pytest.approx((0.0, 0.5, 1.0), abs=1e-5)


@pytest.mark.parametrize(("zeta", "width"), [(0.02, 0.4), (0.1, 0.1), (0.1, 0.7), (0.3, 0.4), (0.5, 0.4)])
def test_damped_specified_insensitivity(zeta: float, width: float) -> None:
    low, high = TURN * (1.0 - 0.5 * width), TURN * (1.0 + 0.5 * width)
    sequence = specified_insensitivity(low, high, 0.05, zeta)
    check_positive(sequence)
    assert largest_v(sequence, low, high, zeta) <= 0.05 * (1.0 + 1e-9)
    assert sequence.certificate <= 0.05e-9
    assert sequence.duration < shortest_duration(width)
    assert sequence.duration == pytest.approx(shortest_on_grid([Band(low, high, 0.05, zeta)], GeneralLayout, 1e-4)[0], rel=2e-3)


@pytest.mark.parametrize(("tolerance", "zetas"), [(0.05, (0.0, 0.0)), (0.02, (0.05, 0.1))])
def test_two_intervals(tolerance: float, zetas: tuple[float, float]) -> None:
    second = Band(3.0 * TURN, 3.5 * TURN, tolerance, zetas[1])
    sequence = specified_insensitivity(0.8 * TURN, 1.2 * TURN, 0.05, zetas[0], [second])
    check_positive(sequence)
    assert largest_v(sequence, 0.8 * TURN, 1.2 * TURN, zetas[0]) <= 0.05 * (1.0 + 1e-9)
    assert largest_v(sequence, second.low, second.high, zetas[1]) <= tolerance * (1.0 + 1e-9)
    alone = specified_insensitivity(0.8 * TURN, 1.2 * TURN, 0.05, zetas[0])
    both = alone.convolved(specified_insensitivity(second.low, second.high, tolerance, zetas[1]))
    assert alone.duration <= sequence.duration < both.duration


def test_designs_are_deterministic() -> None:
    assert specified_insensitivity(5.0, 6.0, 0.03, 0.04) == specified_insensitivity(5.0, 6.0, 0.03, 0.04)


def mode_pairs() -> list[tuple[list[float], list[float]]]:
    rng = np.random.default_rng(20260)
    pairs = []
    for k in range(20):
        frequencies = (TURN * np.exp(rng.uniform(-0.5, 1.8, 2))).tolist()
        pairs.append((frequencies, rng.uniform(0.0, 0.2, 2).tolist() if k % 2 else [0.0, 0.0]))
    return pairs


@pytest.mark.parametrize("order", [0, 1], ids=["zv", "zvd"])
@pytest.mark.parametrize(("frequencies", "zetas"), mode_pairs())
def test_two_modes_directly(frequencies: list[float], zetas: list[float], order: int) -> None:
    sequence = direct_two_mode(frequencies, zetas, ("zv", "zvd")[order])
    check_positive(sequence)
    assert sequence.certificate < 1e-11
    for w, zeta in zip(frequencies, zetas, strict=True):
        assert independent_v(sequence, w, zeta) < 1e-11
        if order:
            step = 1e-5  # V = 0 and dS/dw = 0: what is left near the mode is of second order
            assert max(independent_v(sequence, w * (1.0 + r), zeta) for r in (-step, step)) < 1e4 * step * step
    convolution = convolve_all([zero_derivative_sequence(order, w, z) for w, z in zip(frequencies, zetas, strict=True)])
    assert sequence.duration <= convolution.duration * (1.0 + 1e-12)


def test_two_undamped_modes_by_three_impulses() -> None:
    """D = 4 pi / (w1 + w2): cos(w1 D/2) = cos(w2 D/2) = -c, amplitudes 1/2 (1, 2c, 1) / (1 + c)."""
    w1, w2 = 8.0, 12.0
    sequence = direct_two_mode((w2, w1))
    c = -math.cos(TURN * w1 / (w1 + w2))
    assert sequence.delays == pytest.approx((0.0, TURN / (w1 + w2), 2.0 * TURN / (w1 + w2)), abs=1e-9)
    assert sequence.amplitudes == pytest.approx([x / (2.0 + 2.0 * c) for x in (1.0, 2.0 * c, 1.0)], abs=1e-9)


@pytest.mark.parametrize("shaper", ["zv", "zvd"])
def test_mode_of_three_times_the_frequency_costs_nothing(shaper: str) -> None:
    single = zero_derivative_sequence(("zv", "zvd").index(shaper), 5.0, 0.0)
    sequence = direct_two_mode((5.0, 15.0), shaper=shaper)
    assert sequence.certificate < 1e-11
    assert sequence.duration == pytest.approx(single.duration, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0.0, 1.0), "positive"),
        ((2.0, 1.0), "decrease"),
        ((1.0, math.inf), "finite"),
        ((math.nan, 1.0), "positive"),
        ((0.2, 1.8), "limit: 1.5"),
        ((1.0, 2.0, 0.0), "tolerance"),
        ((1.0, 2.0, 0.6), "tolerance"),
        ((1.0, 2.0, 0.05, 0.6), "damping ratio"),
        ((1.0, 2.0, 0.05, -0.1), "damping ratio"),
        ((1.0, 2.0, 0.05, 0.0, [Band(50.0, 51.0, 0.05)]), "factor of 30"),
        ((1.0, 2.0, 0.05, 0.0, [Band(3.0, 4.0, 0.05)] * 4), "5 bands"),
    ],
)
def test_bands_that_are_not_served(arguments: tuple, words: str) -> None:
    with pytest.raises(ComponentError, match=words):
        specified_insensitivity(*arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((1.0,),), "two of each"),
        (((1.0, 2.0), (0.0,)), "two of each"),
        (((1.0, -2.0),), "positive"),
        (((1.0, math.inf),), "finite"),
        (((3.0, 3.0),), "differ"),
        (((1.0, 31.0),), "factor of 30"),
        (((1.0, 2.0), (0.0, 1.0)), "damping ratio"),
        (((1.0, 2.0), (0.0, 0.0), "ei"), "zv, zvd"),
    ],
)
def test_modes_that_are_not_served(arguments: tuple, words: str) -> None:
    with pytest.raises(ComponentError, match=words):
        direct_two_mode(*arguments)


@pytest.mark.parametrize("arguments", [(-0.1,), (1.6,), (math.nan,), (0.5, 0.0), (0.5, 1.0)])
def test_floors_that_are_not_known(arguments: tuple) -> None:
    with pytest.raises(ComponentError, match=r"floor is known|tolerance"):
        shortest_duration(*arguments)


def test_distance_refuses_bad_modes() -> None:
    with pytest.raises(ComponentError, match="positive"):
        distance_to_floor(equally_spaced(0.5, 0.5), 0.0)
    with pytest.raises(ComponentError, match="tolerance"):
        distance_to_floor(equally_spaced(0.5, 0.5), 1.0, 0.0)
