"""On/off commands: the numbers of the papers, the equations that define each design, and independent checks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from shaper_fmu.design.pulse_sequence import PulseSequence
from shaper_fmu.design.pulses import (
    carrier_pulses,
    minimax_pulses,
    polished_pulses,
    unity_magnitude_pulses,
    zv_carrier_pulses,
)
from shaper_fmu.errors import ComponentError
from shaper_fmu.pulses.minimum_width import enforce_minimum_width

# the plant of Taskin, Kilic and Kapucu 2019
W, ZETA = 22.9476, 0.0891
DAMPED = W * math.sqrt(1.0 - ZETA**2)
PERIOD = 2.0 * math.pi / DAMPED
LONG, SHORT = PERIOD / 2, 0.1222
RATIOS = (5, 9, 11, 12, 13, 15, 20, 25)

dampings = st.floats(0.0, 0.5)


def paper_profile(s, duration, w, zeta):
    """Taskin, Kilic and Kapucu 2019: ramp L1 + cycloid L2 + ramped versine L3."""
    rate = 2 * math.pi / duration
    cycloid, versine = 1 - (rate / w) ** 2, 2 * zeta * rate / w
    angle = rate * s
    ramp = 1 - cycloid - versine
    return (ramp * angle + cycloid * (angle - np.sin(angle)) + versine * (angle + 1 - np.cos(angle))) / (2 * math.pi)


def paper_carrier(s, w, zeta, ratio):
    """Their triangle: 1 at time zero and falling, of `ratio` times the damped frequency."""
    return abs(1 - 2 * (ratio * w * math.sqrt(1 - zeta**2) / (2 * math.pi) * s % 1))


def percent(sequence: PulseSequence) -> float:
    return 100 * sequence.relative_residual(W, ZETA)


def designed(name: str, ratio: float) -> PulseSequence:
    if name == "zv":
        return zv_carrier_pulses(W, ZETA, ratio)
    return carrier_pulses({"long": LONG, "short": SHORT}[name], W, ZETA, ratio)


# Recomputed from the equations of Taskin, Kilic and Kapucu 2019 by dense sampling and Brent's method, in percent
RESIDUALS = {
    "long": (10.969, 8.646, 5.296, 2.724, 3.431, 2.437, 0.901, 0.806),
    "short": (21.520, 10.803, 2.456, 6.604, 2.072, 2.883, 0.216, 0.230),
    "zv": (0.558, 0.166, 0.110, 1.037, 0.079, 0.059, 0.372, 0.021),
}


@pytest.mark.parametrize("name", RESIDUALS)
def test_residuals_of_the_paper(name):
    assert [percent(designed(name, q)) for q in RATIOS] == pytest.approx(RESIDUALS[name], abs=5.1e-4)


def test_pulse_counts_of_the_paper():
    ratios = (5, 9, 12, 13, 25)
    assert [designed("long", q).pulses for q in ratios] == [3, 5, 6, 7, 13]
    assert [designed("short", q).pulses for q in ratios] == [3, 5, 6, 6, 12]


def test_edges_of_frequency_ratio_12():
    tabled = ".008612 .016793 .026641 .043846 .047847 .064904 .074035 .084751 .099383 .107234 .119735"
    edges = designed("long", 12).switch_times
    assert edges == pytest.approx([float(t) for t in tabled.split()], abs=5.1e-7)
    assert designed("long", 12).levels == (1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1)


@pytest.mark.parametrize(("name", "first"), [("long", 12), ("short", 13)])
def test_first_frequency_ratio_that_stays_below_five_percent(name, first):
    """The paper's conclusion: below 5 % from frequency ratio 12, and 13 for the shorter travel time."""
    above = [q for q in range(1, 26) if percent(designed(name, q)) >= 5.0]
    assert above[-1] + 1 == first


@pytest.mark.parametrize(("name", "last", "tolerance"), [("long", 11.097, 0.02), ("short", 12.642, 0.02), ("zv", 19.58, 0.05)])
def test_last_crossing_of_five_percent_on_a_dense_grid(name, last, tolerance):
    """The paper's figures 6 and 7."""
    above = [q for q in np.arange(10.0, 25.0, 0.02) if percent(designed(name, float(q))) >= 5.0]
    assert above[-1] == pytest.approx(last, abs=tolerance)


def test_the_carrier_makes_very_short_gaps():
    assert 1e3 * designed("short", 18).minimum_pulse_width == pytest.approx(0.02, abs=0.005)  # ms
    assert designed("short", 18).minimum_pulse_width == min(np.diff(designed("short", 18).switch_times))


def test_zv_staircase_is_that_of_smith():
    """The levels and the time of equations 7 and 8 of the paper: 0.5698 at 0, 1 at 0.1374 s."""
    command = zv_carrier_pulses(W, ZETA, 1000.0)
    widths = np.diff([*command.switch_times, LONG])
    assert sum(widths[::2]) / LONG == pytest.approx(0.569800, abs=1e-6)  # over whole carrier periods
    assert command.travel_time == pytest.approx(0.1374496, abs=5.1e-8)
    assert zv_carrier_pulses(W, ZETA, 12.0).levels[-1] == 1.0
    assert zv_carrier_pulses(W, ZETA, 12.0).switch_times[-1] == command.travel_time


@settings(max_examples=150, deadline=None)
@given(dampings, st.floats(0.5, 25.0), st.floats(0.4423, 2.0))
def test_crossings_are_exact_and_complete(zeta, ratio, periods):
    duration = periods * 2 * math.pi / (3.0 * math.sqrt(1 - zeta**2))
    command = carrier_pulses(duration, 3.0, zeta, ratio)
    times = np.array(command.switch_times)
    inner = times[times < duration]
    assert np.all(np.diff(times) > 0.0)
    assert command.levels == tuple(1.0 - i % 2 for i in range(command.switches))
    assert np.all(abs(paper_profile(inner, duration, 3.0, zeta) - paper_carrier(inner, 3.0, zeta, ratio)) < 1e-11)
    samples = np.linspace(0.0, duration, 3001)[:-1]
    above = paper_profile(samples, duration, 3.0, zeta) - paper_carrier(samples, 3.0, zeta, ratio)
    on = np.searchsorted(times, samples, side="right") % 2 == 1
    assert np.all((on == (above > 0.0)) | (abs(above) < 1e-9))


def test_a_profile_that_touches_the_carrier_does_not_switch():
    """tau = Td/2, even q: y and c are both 1 at the end, and the profile comes from above."""
    for ratio in range(4, 26, 2):
        assert designed("long", ratio).switch_times[-1] < LONG * (1.0 - 1e-6)


def test_tangency_inside_is_bracketed():
    """Between q with a gap and q without it lies the tangency: the gap shrinks to nothing there and none is missed."""
    low, high = 8.9, 9.0  # at tau = 0.1222 s, q = 9 there is a gap of 0.047 ms
    assert [designed("short", q).switches for q in (low, high)] == [7, 9]
    for _ in range(45):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if designed("short", middle).switches == 7 else (low, middle)
    assert designed("short", low).switches == 7
    assert designed("short", high).switches == 9
    assert designed("short", high).minimum_pulse_width < 1e-8  # s


@pytest.mark.parametrize(
    "command", [carrier_pulses(LONG, W, ZETA, 12), minimax_pulses(SHORT, W, ZETA), zv_carrier_pulses(W, ZETA, 9)]
)
@pytest.mark.parametrize("frequency", [W, 0.8 * W])
def test_residual_by_simulation(command, frequency):
    """x'' + 2 zeta w x' + w^2 x = w^2 u, integrated numerically from switch to switch; envelope of what remains."""
    state, before, level = np.zeros(2), 0.0, 0.0

    def rates(t, x):
        return [x[1], frequency**2 * (level - x[0]) - 2 * ZETA * frequency * x[1]]

    for until, after in [*zip(command.switch_times, command.levels, strict=True), (command.travel_time, 1.0)]:
        if until > before:
            state = solve_ivp(rates, (before, until), state, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
        before, level = until, after
    root = math.sqrt(1 - ZETA**2)
    error = state[0] - 1.0
    envelope = math.hypot(error, (state[1] + ZETA * frequency * error) / (frequency * root))
    step_envelope = 1.0 / root  # of x = 1 - exp(-zeta w t) (cos + zeta/root sin)
    assert command.residual_vibration(frequency, ZETA) == pytest.approx(envelope / step_envelope, abs=1e-9)
    growth = math.exp(ZETA * frequency * command.travel_time)
    assert command.relative_residual(frequency, ZETA) == pytest.approx(growth * envelope / step_envelope, abs=1e-9)


def test_polishing_shifts_little_and_leaves_nothing():
    raw, polished = designed("long", 12), polished_pulses(LONG, W, ZETA, 12)
    shifts = abs(np.subtract(raw.switch_times, polished.switch_times))
    assert 1e3 * shifts.max() == pytest.approx(0.215, abs=5.1e-4)  # ms, minimum-norm Newton correction by numpy's lstsq
    assert polished.residual_vibration(W, ZETA) < 1e-12
    assert polished.certificate < 1e-12


def test_polished_shifts_are_the_smallest_possible():
    """Against sequential linear least-norm steps by numpy's pseudo-inverse (the fixed point of d = J+ (J d - S))."""
    raw = np.array(designed("long", 9).switch_times)
    times, signs, pole = raw.copy(), (-1.0) ** np.arange(len(raw)), complex(-ZETA * W, DAMPED)
    for _ in range(60):
        terms = signs * np.exp(pole * (LONG - times))
        total, slopes = terms.sum(), -pole * terms
        jacobian = np.array([slopes.real, slopes.imag])
        times = raw + np.linalg.pinv(jacobian) @ (jacobian @ (times - raw) - [total.real, total.imag])
    assert polished_pulses(LONG, W, ZETA, 9).switch_times == pytest.approx(times, abs=1e-11)


@settings(max_examples=150, deadline=None)
@given(dampings, st.floats(5.0, 25.0), st.floats(0.4423, 2.0))
def test_polished_commands_leave_no_vibration(zeta, ratio, periods):
    duration = periods * 2 * math.pi / (3.0 * math.sqrt(1 - zeta**2))
    command = polished_pulses(duration, 3.0, zeta, ratio)
    assert command.residual_vibration(3.0, zeta) < 1e-11
    assert np.all(np.diff([0.0, *command.switch_times, duration])[1:-1] > 0.0)
    assert command.switch_times[0] >= 0.0
    assert command.switch_times[-1] <= duration


def test_a_pulse_that_polishing_would_turn_inside_out_is_left_out():
    zeta = 0.5158103459593923
    duration = 0.4765088653441991 * 2 * math.pi / math.sqrt(1 - zeta**2)
    raw = carrier_pulses(duration, 1.0, zeta, 14.816174421900765)
    polished = polished_pulses(duration, 1.0, zeta, 14.816174421900765)
    assert polished.switches < raw.switches
    assert polished.residual_vibration(1.0, zeta) < 1e-12


def test_what_cannot_be_polished_is_said():
    with pytest.raises(ComponentError, match="no shift of the switches leaves no vibration with frequency_ratio = 1,"):
        polished_pulses(LONG, W, ZETA, 1.0)


def test_short_pulses_and_gaps_are_left_out_shortest_first():
    times = [0.0, 1.0, 1.1, 2.0, 2.05, 3.0, 5.0]  # the gap of 0.05 s goes, then that of 0.1 s
    assert enforce_minimum_width(times, 7, 0.5) == 3
    assert times[:3] == [0.0, 3.0, 5.0]
    times = [0.0, 1.0, 1.1]
    assert enforce_minimum_width(times, 3, 10.0) == 1
    assert times[0] == 0.0 or times[0] == 1.1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 10.0), min_size=1, max_size=31), st.floats(0.0, 3.0))
def test_no_width_below_the_limit_remains(times, limit):
    times = sorted(times if len(times) % 2 else times[1:])
    count = enforce_minimum_width(times, len(times), limit)
    assert count % 2 == 1
    assert np.all(np.diff(times[:count]) >= limit)


def test_a_limit_costs_vibration_and_says_how_much():
    free, limited = designed("short", 18), carrier_pulses(SHORT, W, ZETA, 18, minimum_pulse_width=1e-3)
    assert limited.minimum_pulse_width >= 1e-3 > free.minimum_pulse_width
    assert limited.relative_residual(W, ZETA) != free.relative_residual(W, ZETA)
    polished = polished_pulses(SHORT, W, ZETA, 18, minimum_pulse_width=1e-3)
    assert polished.minimum_pulse_width >= 1e-3
    assert polished.residual_vibration(W, ZETA) < 1e-12
    assert unity_magnitude_pulses("zv", W, ZETA, minimum_pulse_width=1.0).switches == 1
    assert unity_magnitude_pulses("zv", W, ZETA, minimum_pulse_width=1.0).minimum_pulse_width == math.inf


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: carrier_pulses(0.0, W, ZETA, 12), "duration = 0.0 must be a finite number greater than 0"),
        (lambda: carrier_pulses(1.0, -1.0, ZETA, 12), "natural_frequency = -1.0 must be"),
        (lambda: carrier_pulses(1.0, W, 1.0, 12), "damping_ratio = 1.0 must be at least 0 and less than 1"),
        (lambda: carrier_pulses(1.0, W, ZETA, math.nan), "frequency_ratio = nan must be a finite number"),
        (lambda: carrier_pulses(1.0, W, ZETA, 1e9), "gives more than 100000 switches"),
        (lambda: carrier_pulses(1.0, W, ZETA, 9, minimum_pulse_width=-1.0), "minimum_pulse_width = -1.0 must be .* at least 0"),
        (lambda: zv_carrier_pulses(W, ZETA, 0.0), "frequency_ratio = 0.0 must be"),
        (lambda: minimax_pulses(LONG, W, ZETA, band=1.0), "band = 1.0 must be greater than 0 and less than 1"),
        (lambda: unity_magnitude_pulses("zvdd", W, ZETA), "'zvdd' is neither 'zv' nor 'zvd'"),  # pyright: ignore[reportArgumentType]
        (lambda: PulseSequence((0.0,), (1.0, 0.0), 1.0), "2 levels for 1 switch times"),
        (lambda: PulseSequence((0.5, 0.2), (1.0, 1.0), 1.0), "not be negative nor decrease"),
        (lambda: PulseSequence((0.5,), (1.0,), 0.4), "not lie after the travel time"),
        (lambda: PulseSequence((0.5,), (0.0,), 1.0), "end at a level other than 0"),
        (lambda: PulseSequence((math.nan,), (1.0,), 1.0), "must be finite"),
        (lambda: PulseSequence((0.0,), (1.0,), 1.0).residual_vibration(0.0), "natural_frequency = 0.0 rad/s"),
    ],
)
def test_impossible_input_is_refused_in_clear_words(call, words):
    with pytest.raises(ComponentError, match=words):
        call()


def test_a_sequence_of_any_levels():
    """A staircase 0.5, 1 half a period apart is the undamped ZV shaper's command (Smith 1958): V = |cos(pi r/2)|."""
    staircase = PulseSequence((0.0, 0.5), (0.5, 1.0), 0.5)
    assert staircase.pulses == 2
    assert staircase.residual_vibration(2 * math.pi) == pytest.approx(0.0, abs=1e-15)
    assert staircase.residual_vibration(2 * math.pi * 1.1) == pytest.approx(abs(math.cos(math.pi * 0.55)))
    assert PulseSequence((0.0, 0.5), (1.0, 2.0), 0.5).residual_vibration(2 * math.pi * 1.1) == pytest.approx(
        abs(math.cos(math.pi * 0.55))
    )
