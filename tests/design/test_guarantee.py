"""Certified bounds of the residual vibration over boxes of frequency and damping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shaper_fmu.analysis.vibration import tolerated_band
from shaper_fmu.design.guarantees import guarantee
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.profiles import profile
from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.design.pulses import carrier_pulses, minimax_pulses, unity_magnitude_pulses
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError

W = 5.0
amplitudes = st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=6)
times = st.lists(st.floats(0.0, 4.0), min_size=6, max_size=6)
frequencies = st.tuples(st.floats(0.1, 12.0), st.floats(0.0, 6.0))
dampings = st.tuples(st.floats(0.0, 0.9), st.floats(0.0, 0.09))


def largest_on_a_grid(command, w: tuple[float, float], zeta: tuple[float, float]) -> float:
    return max(command.residual_vibration(a, b) for a in np.linspace(*w, 25) for b in np.linspace(*zeta, 7))


def check(command, w: tuple[float, float], zeta: tuple[float, float], tolerance: float) -> None:
    found = guarantee(command, w, zeta, tolerance=tolerance)
    assert largest_on_a_grid(command, w, zeta) <= found.bound
    assert found.attained <= found.bound <= found.attained + tolerance
    assert command.residual_vibration(*found.at) == found.attained
    assert w[0] <= found.at[0] <= w[1]
    assert zeta[0] <= found.at[1] <= zeta[1]


@given(amplitudes, times, frequencies, dampings)
def test_no_impulses_leave_more_than_the_bound(sizes, delays, w, zeta):
    command = ImpulseSequence(tuple(sizes), (0.0, *sorted(delays)[: len(sizes) - 1]))
    check(command, (w[0], w[0] + w[1]), (zeta[0], zeta[0] + zeta[1]), 1e-8)


@given(amplitudes, times, frequencies, dampings)
def test_no_pulses_leave_more_than_the_bound(levels, switches, w, zeta):
    times = sorted(switches)
    command = PulseSequence(tuple(times[: len(levels)]), (*levels[:-1], 1.0), times[-1])
    check(command, (w[0], w[0] + w[1]), (zeta[0], zeta[0] + zeta[1]), 1e-7)


@pytest.mark.parametrize(("kind", "order"), [("zv", 1), ("zvd", 2), ("zvdd", 3)])
@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_undamped_bounds_are_the_closed_form(kind, order, share):
    """V = |cos(pi r / 2)|^n of the frequency ratio r (Singer and Seering 1990): largest at both ends of r = 1 +- share."""
    found = guarantee(shaper(kind, W), ((1 - share) * W, (1 + share) * W), tolerance=2e-11)
    assert found.bound == pytest.approx(math.sin(math.pi / 2 * share) ** order, abs=2.1e-11)


def test_a_maximum_inside_an_edge_is_found():
    """ZV over 0.5 to 3.5 design frequencies: V = |cos(pi r / 2)| is 1 at r = 2, between any two points of most grids."""
    found = guarantee(shaper("zv", W), (0.5 * W, 3.5 * W), tolerance=1e-11)
    assert found.bound == pytest.approx(1.0, abs=1.1e-11)
    assert found.at[0] == pytest.approx(2 * W, rel=1e-5)


def test_the_damping_alone_may_vary():
    """Two impulses of 1/2 half a period of w apart, on w: K = exp(-zeta w T), V^2 = (1 + K^2 + 2 K cos(pi sqrt(1 - zeta^2))) / 4."""
    found = guarantee(shaper("zv", W), (W, W), (0.0, 0.3), tolerance=1e-11)
    decay = math.exp(-0.3 * math.pi)
    expected = math.sqrt(1 + decay**2 + 2 * decay * math.cos(math.pi * math.sqrt(1 - 0.09))) / 2
    assert found.bound == pytest.approx(expected, abs=1.1e-11)


@pytest.mark.parametrize(("w", "zeta"), [((W, W), (0.0, 0.0)), ((W, W), (0.1, 0.1))])
def test_a_box_may_be_a_point(w, zeta):
    command = shaper("um_zvd", 1.1 * W, 0.05)
    found = guarantee(command, w, zeta, tolerance=1e-10)
    assert found.bound == pytest.approx(command.residual_vibration(w[0], zeta[0]), abs=1e-11)


@pytest.mark.parametrize("kind", ["zv", "zvd", "ei", "two_hump_ei", "three_hump_ei", "um_zvd"])
@pytest.mark.parametrize("zeta", [0.0, 0.05])
def test_within_the_tolerated_band_the_bound_is_the_tolerance(kind, zeta):
    """The band's ends are where V is 5 %; humps of EI shapers touch 5 % inside."""
    command = shaper(kind, W, zeta)
    band = tolerated_band(command, W, zeta)
    assert band is not None
    found = guarantee(command, (band[0] * W, band[1] * W), (zeta, zeta), tolerance=1e-10)
    assert found.bound == pytest.approx(0.05, abs=1e-9)


@pytest.mark.parametrize(
    "command",
    [
        minimax_pulses(0.1374496, 22.9476, 0.0891),
        carrier_pulses(0.1374496, 22.9476, 0.0891, 12.0),
        unity_magnitude_pulses("zvd", 22.9476, 0.0891),
    ],
)
def test_pulse_trains_have_bounds_too(command):
    """The plant of Taskin, Kilic and Kapucu 2019 with 10 % of uncertainty."""
    check(command, (0.9 * 22.9476, 1.1 * 22.9476), (0.07, 0.11), 1e-9)


def test_a_finer_tolerance_is_a_tighter_bound_at_few_more_cells():
    """Quadratic cells: each halving gains a factor of four, so eight digits take about 14 halvings of a few cells."""
    command, box = shaper("three_hump_ei", W, 0.05), ((0.7 * W, 1.3 * W), (0.0, 0.2))
    coarse, fine = guarantee(command, *box, tolerance=1e-2), guarantee(command, *box, tolerance=1e-10)
    assert coarse.bound - coarse.attained <= 1e-2
    assert fine.bound - fine.attained <= 1e-10
    assert fine.bound <= coarse.bound
    assert fine.evaluations < 10 * coarse.evaluations


@pytest.mark.parametrize(
    ("w", "zeta", "tolerance", "words"),
    [
        ((0.0, 1.0), (0.0, 0.0), 1e-9, r"natural_frequency = \(0, 1\) must be"),
        ((2.0, 1.0), (0.0, 0.0), 1e-9, r"natural_frequency = \(2, 1\) must be"),
        ((1.0, math.inf), (0.0, 0.0), 1e-9, "natural_frequency"),
        ((1.0, math.nan), (0.0, 0.0), 1e-9, "natural_frequency"),
        ((1.0, 2.0), (-0.1, 0.0), 1e-9, r"damping_ratio = \(-0.1, 0\) must be"),
        ((1.0, 2.0), (0.0, 1.0), 1e-9, r"damping_ratio = \(0, 1\) must be"),
        ((1.0, 2.0), (0.0, 0.1), 1e-14, "finer than rounding allows here: at least"),
        ((1.0, 2.0), (0.0, 0.1), math.nan, "finer than rounding"),
        ((1.0, 1e7), (0.0, 0.0), 1e-3, "needs more than 1000000 cells"),
    ],
)
def test_what_cannot_be_guaranteed_is_refused(w, zeta, tolerance, words):
    with pytest.raises(ComponentError, match=words):
        guarantee(shaper("zvd", W), w, zeta, tolerance=tolerance)


def test_smooth_commands_are_refused():
    with pytest.raises(ComponentError, match="not for Profile"):
        guarantee(profile("cycloid", 1.0, 1.0), (1.0, 2.0))  # pyright: ignore[reportArgumentType]
