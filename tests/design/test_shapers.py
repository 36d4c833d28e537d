"""Impulse sequences: closed forms of the papers, and the tables computed from them."""

from __future__ import annotations

import cmath
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.shapers.convolution import convolve
from shaper_fmu.shapers.sensitivity import residual_vibration


def designed(**values) -> InputShaper:
    shaper = InputShaper(**values)
    shaper.initialize()
    return shaper


def impulses(shaper: InputShaper) -> tuple[list[float], list[float]]:
    return shaper.amplitude[: shaper.impulses], shaper.delay[: shaper.impulses]


def formula_v(amplitude, delay, w: float, zeta: float) -> float:
    """V of Singer and Seering 1990, in complex form: |sum_i A_i exp(p (t_n - t_i))| with the pole p."""
    pole = complex(-zeta * w, w * math.sqrt(1.0 - zeta * zeta))
    return abs(sum(a * cmath.exp(pole * (delay[-1] - t)) for a, t in zip(amplitude, delay, strict=True)))


# Singer and Seering 1990: A_i = C(n, i) K^i / (1 + K)^n, t_i = i Td/2. Printed to six digits for zeta = 0.1.
DAMPED = {
    "zv": [0.578286, 0.421714],
    "zvd": [0.334415, 0.487743, 0.177843],
    "zvdd": [0.193388, 0.423082, 0.308532, 0.074999],
}


@pytest.mark.parametrize(("kind", "printed"), DAMPED.items())
def test_amplitudes_at_ten_percent_damping(kind, printed):
    amplitude, delay = impulses(designed(shaper=kind, natural_frequency=[2.0 * math.pi], damping_ratio=[0.1]))
    assert amplitude == pytest.approx(printed, abs=5e-7)
    assert delay == pytest.approx([0.502519 * i for i in range(len(printed))], abs=2e-6)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.1, 0.3, 0.7, 0.95])
@pytest.mark.parametrize(("kind", "order"), [("zv", 1), ("zvd", 2), ("zvdd", 3)])
def test_amplitudes_and_times_are_the_closed_form(kind, order, zeta):
    w = 22.9476
    amplitude, delay = impulses(designed(shaper=kind, natural_frequency=[w], damping_ratio=[zeta]))
    k = math.exp(-zeta * math.pi / math.sqrt(1 - zeta**2))
    assert amplitude == pytest.approx(
        [math.comb(order, i) * k**i / (1 + k) ** order for i in range(order + 1)], rel=1e-14, abs=1e-15
    )
    assert delay == pytest.approx([i * math.pi / (w * math.sqrt(1 - zeta**2)) for i in range(order + 1)], rel=1e-15)


# Undamped: I(V) = (4/pi) asin(V^(1/n)) for the ZVD^(n-1) shaper (from V = |cos(pi r/2)|^n).
@pytest.mark.parametrize(("kind", "n"), [("zv", 1), ("zvd", 2), ("zvdd", 3)])
@pytest.mark.parametrize("tolerance", [0.01, 0.05, 0.1, 0.3])
def test_undamped_insensitivity_is_the_closed_form(kind, n, tolerance):
    shaper = designed(shaper=kind, natural_frequency=[3.3], vibration_tolerance=tolerance)
    assert shaper.insensitivity == pytest.approx(4 / math.pi * math.asin(tolerance ** (1 / n)), abs=1e-12)


def test_insensitivity_at_ten_percent_damping():
    """I(5 %) = .0751 (ZV), .3402 (ZVD), .5744 (ZVDD), computed from V with matched damping."""
    found = [designed(shaper=k, damping_ratio=[0.1]).insensitivity for k in ("zv", "zvd", "zvdd")]
    assert found == pytest.approx([0.0751, 0.3402, 0.5744], abs=5e-5)


def test_no_shaper_is_one_impulse():
    shaper = designed(shaper="none")
    assert impulses(shaper) == ([1.0], [0.0])
    assert (shaper.duration, shaper.insensitivity) == (0.0, 0.0)


def test_several_modes_are_convolved():
    """Hyde and Seering 1991: all products of amplitudes at all sums of times; zero residual on every mode."""
    w, zeta = [3.85, 9.42], [0.096, 0.24]  # the modes of Jung 2011 as printed
    shaper = designed(shaper="zvd", modes=2, natural_frequency=w, damping_ratio=zeta)
    amplitude, delay = impulses(shaper)
    one = [designed(shaper="zvd", natural_frequency=[f], damping_ratio=[z]) for f, z in zip(w, zeta, strict=True)]
    pairs = sorted((s + t, a * b) for a, s in zip(*impulses(one[0]), strict=True) for b, t in zip(*impulses(one[1]), strict=True))
    assert delay == pytest.approx([t for t, _ in pairs], rel=1e-15)
    assert amplitude == pytest.approx([a for _, a in pairs], rel=1e-14)
    for f, z in zip(w, zeta, strict=True):
        assert formula_v(amplitude, delay, f, z) < 1e-13
    # recomputed from the printed modes: last impulses at 1.6395688 s and 0.6870864 s, of both at 2.3266552 s
    assert [one[0].duration, one[1].duration, shaper.duration] == pytest.approx([1.6395688, 0.6870864, 2.3266552], abs=5e-8)


def test_a_mode_that_is_not_shaped_is_left_out():
    both = designed(shaper="zv", modes=2, natural_frequency=[4.0, 9.0], shape_mode=[False, True])
    assert impulses(both) == impulses(designed(shaper="zv", natural_frequency=[9.0]))


def test_impulses_that_coincide_merge():
    """ZV for w convolved with ZV for w is ZVD: the two impulses in the middle are one."""
    twice = designed(shaper="zv", modes=2, natural_frequency=[7.0, 7.0], damping_ratio=[0.1, 0.1])
    once = designed(shaper="zvd", natural_frequency=[7.0], damping_ratio=[0.1])
    assert twice.impulses == 3
    assert impulses(twice)[0] == pytest.approx(impulses(once)[0], rel=1e-14)


def test_four_modes_with_the_longest_shaper_fit():
    shaper = designed(shaper="zvdd", modes=4, natural_frequency=[3.0, 5.1, 7.7, 13.3])
    assert shaper.impulses == 256
    assert sum(impulses(shaper)[0]) == pytest.approx(1.0, abs=1e-13)


@given(
    st.lists(st.tuples(st.floats(-2, 2), st.floats(0, 3)), min_size=1, max_size=6),
    st.lists(st.tuples(st.floats(-2, 2), st.floats(0, 3)), min_size=1, max_size=6),
    st.floats(0.1, 20.0),
    st.floats(0.0, 0.9),
)
def test_convolution_multiplies_what_each_factor_leaves(one, other, w, zeta):
    """sum_ij A_i B_j exp(-p (t_i + s_j)) is the product of the two sums, for any pole p."""
    amplitude = [a for a, _ in one] + [0.0] * 36
    delay = [t for _, t in one] + [0.0] * 36
    count = convolve(amplitude, delay, len(one), [b for b, _ in other], [s for _, s in other], len(other))
    pole = complex(-zeta * w, w * math.sqrt(1 - zeta**2)) / 20.0

    def total(pairs):
        return sum(a * cmath.exp(-pole * t) for a, t in pairs)

    assert delay[:count] == sorted(delay[:count])
    result = total(zip(amplitude[:count], delay[:count], strict=True))
    assert abs(result - total(one) * total(other)) < 1e-9


@given(st.sampled_from(["zv", "zvd", "zvdd"]), st.floats(0.05, 500.0), st.floats(0.0, 0.95), st.floats(0.3, 3.0))
def test_v_equals_the_complex_formula(kind, w, zeta, ratio):
    shaper = designed(shaper=kind, natural_frequency=[w], damping_ratio=[zeta])
    amplitude, delay = impulses(shaper)
    assert residual_vibration(amplitude, delay, shaper.impulses, ratio * w, zeta) == pytest.approx(
        formula_v(amplitude, delay, ratio * w, zeta), rel=1e-9, abs=1e-13
    )
    assert formula_v(amplitude, delay, w, zeta) < 1e-11


@pytest.mark.parametrize("zeta", [0.999, 1.0 - 1e-9, 1.0 - 2.0**-53])
def test_insensitivity_of_a_mode_that_hardly_swings(zeta):
    """ZV's impulses are half a damped period apart: x = pi zeta / sqrt(1 - zeta^2) decay times. The second is exp(-x) (nothing), so
    V at the frequency ratio r is exp(-r x), 0.05 at r = ln(20) / x; the band ends at 10. A scan of the band would take for ever."""
    x = math.pi * zeta / math.sqrt(1.0 - zeta * zeta)
    width = designed(natural_frequency=[3.0], damping_ratio=[zeta], vibration_tolerance=0.05).insensitivity
    assert width == pytest.approx(10.0 - math.log(20.0) / x, rel=1e-9)
