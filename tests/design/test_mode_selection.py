"""Partial-mode selection: the numbers of the three-mass example, the theorem, and equality with brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from three_mass_loop import closed_loop, response

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.modal_responses import ModalResponse, modal_response, step_response
from shaper_fmu.design.mode_selection import mode_sets, select_modes
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError

UNIT = ImpulseSequence((1.0,), (0.0,))
OPEN_LOOP = [3.8554510, 9.4234900], [0.0963863, 0.2355873]


def on(kind: str, modes: tuple[int, ...], frequency, ratio) -> ImpulseSequence:
    return shaper(kind, [frequency[k] for k in modes], [ratio[k] for k in modes]) if modes else UNIT


# The example of Jung 2011, m = (15, 8, 10) kg, k = (400, 120) N/m, c = k / 20, F = 300 (r - x1) - 50 v1. The numbers were
# found by an independent program that integrates the loop (differences of 2e-11) and looks at a grid of 0.1 ms: hence the
# tolerance of settling times.


def test_the_closed_loops_modes():
    r = response()
    assert r.natural_frequency == pytest.approx([2.3519709, 4.8264223, 9.6501345], abs=6e-8)
    assert r.damping_ratio == pytest.approx([0.1228887, 0.2475501, 0.2875112], abs=6e-8)
    assert r.final == pytest.approx([1.0, 1.0, 1.0], abs=1e-14)
    assert r.modes == (0, 1, 2)


SETS = {
    (): (0.0, 1.0, 11.0884, 13.8566),
    (2,): (0.67980, 0.846035, 11.1697, 13.9809),
    (1,): (1.34365, 0.505642, 8.9165, 12.8049),
    (1, 2): (2.02345, 0.441634, 9.0468, 11.8081),
    (0,): (2.69186, 0.147352, 3.4712, 4.1861),
    (0, 2): (3.37166, 0.030809, 3.1233, 3.7772),
    (0, 1): (4.03551, 0.004450, 3.2895, 3.6288),
    (0, 1, 2): (4.71531, 0.0, 3.5199, 3.8537),
}


def test_all_sets_of_modes_with_zvd():
    r = response()
    found = mode_sets(r, "zvd")
    assert [one.modes for one in found] == list(SETS)
    for one in found:
        duration, residual, within5, within2 = SETS[one.modes]
        assert one.duration == pytest.approx(duration, abs=5.1e-6)
        assert one.residual == pytest.approx(residual, abs=5.1e-7)
        assert r.settling_time(one.shaper, 0.05).max() == pytest.approx(within5, abs=1.01e-4)
        assert r.settling_time(one.shaper, 0.02).max() == pytest.approx(within2, abs=1.01e-4)


@pytest.mark.parametrize(
    ("kind", "tolerance", "modes", "duration", "residual"),
    [
        ("zvd", 0.02, (0, 1), 4.03551, 0.004450),
        ("zvd", 0.05, (0, 2), 3.37166, 0.030809),
        ("zvd", 0.10, (0, 2), 3.37166, 0.030809),
        ("zvd", 0.15, (0,), 2.69186, 0.147352),
        ("zvd", 0.20, (0,), 2.69186, 0.147352),
        ("zvd", 0.30, (0,), 2.69186, 0.147352),
        ("zv", 0.02, (0, 1, 2), 2.35766, 0.0),
        ("zv", 0.05, (0, 1), 2.01776, 0.025712),
        ("zv", 0.10, (0, 1), 2.01776, 0.025712),
        ("zv", 0.15, (0, 2), 1.68583, 0.100314),
        ("zv", 0.20, (0, 2), 1.68583, 0.100314),
        ("zv", 0.30, (0,), 1.34593, 0.288817),
    ],
)
def test_the_chosen_sets(kind, tolerance, modes, duration, residual):
    selection = select_modes(response(), kind, tolerance)
    assert selection.feasible
    assert selection.chosen.modes == modes
    assert selection.chosen.kinds == (kind,) * len(modes)
    assert selection.chosen.duration == pytest.approx(duration, abs=5.1e-6)
    assert selection.chosen.residual == pytest.approx(residual, abs=5.1e-7)
    assert set(selection.mandatory) <= set(modes)


def test_the_reason_says_what_was_gained():
    selection = select_modes(response(), "zvd", 0.05)
    assert selection.mandatory == (0,)
    assert selection.full.modes == (0, 1, 2)
    assert "2.352, 9.6501 rad/s shaped" in selection.reason
    assert "28.5% shorter than all modes" in selection.reason
    assert "without 2.352 rad/s the tolerance 0.05 cannot be met" in selection.reason


@pytest.mark.parametrize(
    ("modes", "end", "overshoot", "within2", "within5"),
    [
        ((), 0.0, (27.455, 44.278, 99.809), (11.027, 12.405, 13.857), (7.200, 8.527, 11.088)),
        ((1,), 0.6861, (23.776, 39.167, 83.319), (10.114, 11.442, 14.002), (7.333, 8.675, 11.182)),
        ((0,), 1.6373, (11.085, 17.502, 31.585), (7.845, 9.195, 11.627), (3.943, 6.341, 7.865)),
        ((0, 1), 2.3234, (9.174, 14.250, 26.960), (6.883, 9.239, 10.779), (4.098, 5.454, 7.990)),
    ],
)
def test_shapers_for_the_open_loops_modes(modes, end, overshoot, within2, within5):
    """What Jung 2011 does: ZVD on the free-free modes in front of the loop."""
    r, sequence = response(), on("zvd", modes, *OPEN_LOOP)
    assert sequence.duration == pytest.approx(end, abs=5.1e-5)
    assert 100.0 * r.overshoot(sequence) == pytest.approx(np.array(overshoot), abs=5.1e-4)
    assert r.settling_time(sequence, 0.02) == pytest.approx(np.array(within2), abs=6e-4)
    assert r.settling_time(sequence, 0.05) == pytest.approx(np.array(within5), abs=6e-4)


def test_values_are_those_of_an_integration():
    """scipy's DOP853 over the shaped step, from impulse to impulse."""
    a, b = closed_loop()
    sequence = on("zvd", (0, 1), *OPEN_LOOP)
    x, level, now = np.zeros(6), 0.0, 0.0
    for amplitude, t in zip((*sequence.amplitudes, 0.0), (*sequence.delays, 4.0), strict=True):
        if t > now:
            held = level * b
            x = solve_ivp(lambda _, y, held=held: a @ y + held, (now, t), x, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        level, now = level + amplitude, t
    assert response().values(sequence, np.array([4.0]))[:, 0] == pytest.approx(x[:3], abs=1e-10)


# The algorithm


def random_system(random: np.random.Generator) -> ModalResponse:
    """3 to 5 modes and two outputs, at rest at the start: x_j(0) = 0."""
    n = int(random.integers(3, 6))
    frequency = np.sort(random.uniform(1.0, 3.0) * np.cumprod(random.uniform(1.3, 2.5, n)))
    zeta = random.uniform(0.02, 0.3, n)
    poles = frequency * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
    size = random.dirichlet(np.ones(n), 2) * random.choice([1.0, 0.15], (2, n))
    residues = -size * (1.0 + 1j * random.uniform(-0.3, 0.6, (2, n)))
    return modal_response(poles, residues / residues.real.sum(axis=1)[:, None] * -1.0, [1.0, 1.0])


def looked_at(r: ModalResponse, parts: list[ImpulseSequence], waves: np.ndarray) -> tuple[float, float]:
    """Duration of shapers convolved, and their residual by looking at the times of waves = exp(p_k tau), shape (n, times)."""
    amplitudes, delays = np.ones(1), np.zeros(1)
    for part in parts:
        amplitudes = np.multiply.outer(amplitudes, part.amplitudes).ravel()
        delays = np.add.outer(delays, part.delays).ravel()
    left = np.exp(np.multiply.outer(r.poles, delays.max() - delays)) @ amplitudes
    return float(delays.max()), float((np.abs(((r.residues * left) @ waves).real) / r.final[:, None]).max())


def test_it_equals_brute_force_on_random_systems():
    """100 random systems: the shortest of all 2^n sets whose residual, looked at densely, is within the tolerance."""
    random = np.random.default_rng(2011)
    shorter = feasible = 0
    for number in range(100):
        r = random_system(random)
        waves = np.exp(np.multiply.outer(r.poles, np.linspace(0.0, 6.0 * np.pi / r.natural_frequency.min(), 2000)))
        tolerance = float(random.choice([0.02, 0.05, 0.1]))
        kind = ("zvd", "zv", "zvd", "mzv")[number % 4]
        parts = [shaper(kind, w, zeta) for w, zeta in zip(r.natural_frequency, r.damping_ratio, strict=True)]
        good = []
        for size in range(len(parts) + 1):
            for modes in itertools.combinations(range(len(parts)), size):
                duration, residual = looked_at(r, [parts[k] for k in modes], waves)
                assert not 0.0 < tolerance - residual < 1e-5, "the times cannot decide this"
                if residual <= tolerance:
                    good.append((duration, modes))
        selection = select_modes(r, kind, tolerance)
        assert selection.feasible == bool(good), number
        feasible += selection.feasible
        if good:
            assert selection.chosen.modes == min(good)[1], number
            assert selection.chosen.duration == pytest.approx(min(good)[0], rel=1e-12)
            shorter += selection.chosen.duration < selection.full.duration
        else:
            assert "infeasible: even all modes shaped leave" in selection.reason
            assert selection.chosen.modes == r.modes
    assert feasible > 60
    assert shorter > 40


def test_several_kinds_equal_brute_force():
    """Each mode may have another kind: the best of all 4^n or 3^n choices, by their exact residuals."""
    random = np.random.default_rng(7)
    mixed = 0
    for kinds in (("zv", "zvd"), ("zv", "zvd", "mzv"), ("um_zv", "zvd")):
        for _ in range(2):
            r = random_system(random)
            known = [{k: shaper(k, w, z) for k in kinds} for w, z in zip(r.natural_frequency, r.damping_ratio, strict=True)]
            options = [(None, *kinds)] * len(r.poles)
            good = []
            for choice in itertools.product(*options):
                if sum(kind is not None for kind in choice) < len(r.poles) - 3:
                    continue  # of no use below: at least one such choice is always found
                parts = [known[i][k] for i, k in enumerate(choice) if k]
                left = np.prod([np.ones(len(r.poles)), *[r.remaining(part) for part in parts]], axis=0)
                if r.residual_of(left)[1] <= 0.04:
                    good.append((sum(part.duration for part in parts), choice))
            best = min(good, key=lambda one: one[0])
            selection = select_modes(r, kinds, 0.04)
            assert selection.chosen.duration == pytest.approx(best[0], rel=1e-12)
            assert selection.chosen.residual <= 0.04
            mixed += len(set(selection.chosen.kinds)) > 1
    assert mixed > 0


def test_the_earliest_settling_is_that_of_all_sets():
    r = response()
    for tolerance in (0.02, 0.05, 0.1):
        times = {one.modes: r.settling_time(one.shaper, tolerance).max() for one in mode_sets(r, "zvd")}
        selection = select_modes(r, "zvd", tolerance, objective="settling")
        assert selection.settling_time == min(times.values()) == times[selection.chosen.modes]
    assert select_modes(r, "zvd", 0.02, objective="settling").chosen.modes == (0, 1)
    shortest = select_modes(r, "zvd", 0.1)
    assert shortest.settling_time > select_modes(r, "zvd", 0.1, objective="settling").settling_time  # shortest is not earliest


positive = st.lists(st.tuples(st.floats(0.001, 1.0), st.floats(0.0, 3.0)), min_size=1, max_size=5)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10**6), positive, positive)
def test_a_further_positive_shaper_never_raises_the_residual(seed, first, second):
    r = random_system(np.random.default_rng(seed))
    one, two = (
        ImpulseSequence(tuple(a / sum(a for a, _ in given) for a, _ in given), (0.0, *sorted(t for _, t in given)[1:]))
        for given in (first, second)
    )
    assert r.residual(one.convolved(two))[0] <= r.residual(one)[1] + 1e-12


def test_a_negative_impulse_may_raise_it():
    """So the theorem needs positive impulses: (1, -1, 1) at 0, 1/2, 1 of the period of a mode with G = 3 of 1 undamped."""
    r = modal_response([-1e-9 + 1.0j], [[-0.3]], [1.0])
    worse = ImpulseSequence((1.0, -1.0, 1.0), (0.0, np.pi, 2.0 * np.pi))
    assert r.residual(worse)[0] == pytest.approx(0.9, rel=1e-6)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.005, 0.5))
def test_bounds_and_settling_hold_against_a_dense_look(seed, band):
    random = np.random.default_rng(seed)
    r = random_system(random)
    sequence = ImpulseSequence((0.4, 0.35, 0.25), (0.0, *np.sort(random.uniform(0.0, 3.0, 2))))
    h = 0.004
    time = np.sort([*np.arange(0.0, 50.0, h), *sequence.delays])
    values = r.values(sequence, time)
    missed = h * h / 8.0 * (np.abs(r.residues) @ r.natural_frequency**2).max()  # at most, by a look at these times
    low, high = r.residual(sequence)
    seen = np.abs(values[:, time >= sequence.duration] - 1.0).max()
    assert low <= high <= low + 1e-12
    assert seen - 1e-12 <= high <= seen + missed
    peaks = np.maximum(0.0, values.max(axis=1) - 1.0)
    assert (r.overshoot(sequence) >= peaks - 1e-12).all()
    assert (r.overshoot(sequence) <= peaks + missed).all()
    for found, line in zip(r.settling_time(sequence, band), np.abs(values - 1.0), strict=True):
        assert (line[time > found + 1e-9] <= band + 1e-12).all()
        if found == 0.0:
            continue
        at = r.values(sequence, np.array([found]))[:, 0] - 1.0
        assert np.abs(np.abs(at) - band).min() < 1e-9


def test_a_limit_decides_without_the_exact_supremum():
    r = response()
    low, high = r.residual(UNIT, 0.5)
    assert low > 0.5
    low, high = r.residual(on("zvd", (0, 1), r.natural_frequency, r.damping_ratio), 0.05)
    assert high <= 0.05


def test_a_state_space_system_with_real_poles_and_a_hidden_mode():
    """Poles -2 and -0.3 +- 4j seen, -7 not: y = c expm(A t) ... by scipy's matrix exponential."""
    a = np.zeros((4, 4))
    a[0, 0], a[3, 3] = -2.0, -7.0
    a[1:3, 1:3] = [[-0.3, 4.0], [-4.0, -0.3]]
    b, c = np.array([2.0, 1.0, 3.0, 1.0]), np.array([[1.0, 1.0, 0.0, 0.0], [0.5, 0.0, 1.0, 0.0]])
    r = step_response(a, b, c, ["first", "second"])
    assert r.poles == pytest.approx(np.array([-2.0, -0.3 + 4.0j]), abs=1e-12)
    assert r.modes == (1,)
    assert r.names == ("first", "second")
    whole = np.zeros((5, 5))
    whole[:4, :4], whole[:4, 4] = a, b
    for t in (0.0, 0.4, 2.3):
        assert r.values(UNIT, np.array([t]))[:, 0] == pytest.approx(c @ (expm(whole * t) @ np.eye(5)[4])[:4], abs=1e-12)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: select_modes(response(), "zvd", 0.0), "tolerance = 0.0 is outside its domain"),
        (lambda: select_modes(response(), "zvx"), "there is no shaper 'zvx'. Did you mean 'zv'"),
        (lambda: select_modes(response(), "none"), "'none' is not a kind of shaper to choose from"),
        (lambda: select_modes(response(), []), "at least one kind"),
        (lambda: select_modes(response(), objective="time"), "no objective 'time'"),  # type: ignore[arg-type]
        (lambda: response().settling_time(UNIT, 0.0), "band = 0.0"),
        (lambda: modal_response([1.0j], [[1.0]], [1.0]), "does not decay"),
        (lambda: modal_response([-1.0 - 1.0j], [[1.0]], [1.0]), "positive imaginary part"),
        (lambda: modal_response([-1.0], [[1.0]], [0.0]), "x1 returns to 0"),
        (lambda: modal_response([-1.0, -2.0], [[1.0]], [1.0]), r"residues of shape \(1, 1\) and 1 final values do not fit 2 poles"),
        (lambda: modal_response([], np.zeros((0, 0)), []), "at least one output"),
        (lambda: step_response([[1.0]], [1.0], [[1.0]]), "not stable: it has the pole 1"),
        (lambda: step_response([[-1.0, 1.0], [0.0, -1.0]], [0.0, 1.0], [[1.0, 0.0]]), "eigenvalues coincide"),
        (lambda: step_response([[-1.0]], [1.0, 2.0], [[1.0]]), "do not belong together"),
    ],
)
def test_errors_say_what_is_wrong(call, message):
    with pytest.raises(ComponentError, match=message):
        call()


def test_too_many_sets_are_refused():
    """16 equal shares: any one mode left out breaks the tolerance, but no kind of shaper is mandatory, for none is positive."""
    n = 16
    r = modal_response(1.3 ** np.arange(n) * (-0.05 + 1.0j), [-np.ones(n) / n], [1.0])
    with pytest.raises(ComponentError, match=r"all sets of 16 modes have \d+ impulses, more than the 20000"):
        mode_sets(r)
    with pytest.raises(ComponentError, match="more than 2000 sets of modes would have to be examined"):
        select_modes(r, "um_zv", 0.01)


def test_real_poles_alone_need_no_shaper():
    selection = select_modes(modal_response([-3.0], [[-1.0]], [1.0]), "zv", 0.05)
    assert not selection.feasible  # rho = 1 at the step itself, and there is nothing to shape
    assert selection.chosen.modes == ()
