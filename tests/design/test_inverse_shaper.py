"""The inverse of a shaper with a distributed delay: its equations, its poles, and loops with and without it, by scipy."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lfilter

from shaper_fmu.design.feedback_inverse import inverse_shaper
from shaper_fmu.design.smoothers import smoother
from shaper_fmu.errors import ArgumentError, NoSolutionError

W, ZETA, H = 5.0, 0.1, 0.01
POLE = W * complex(-ZETA, math.sqrt(1.0 - ZETA**2))


@pytest.mark.parametrize("zeta", [0.02, 0.1, 0.3, 0.7])
@pytest.mark.parametrize("h", [0.1, 0.037, 0.005])
def test_the_mode_is_a_zero_and_all_zeros_are_inside_of_the_unit_circle(zeta, h):
    """numpy's roots of the polynomial: the mode's poles are among them, and no magnitude reaches 1."""
    found = inverse_shaper(W, zeta, h)
    roots = np.roots(found.amplitudes)
    pole = np.exp(W * h * complex(-zeta, math.sqrt(1.0 - zeta * zeta)))
    assert np.abs(roots - pole).min() < 1e-10
    assert np.abs(roots).max() < 1.0
    assert found.largest_pole == np.abs(roots).max()
    assert sum(found.amplitudes) == pytest.approx(1.0, abs=1e-14)
    assert found.shaper.residual_vibration(W, zeta) < 1e-12


def test_towards_short_samples_it_is_the_shaper_of_the_continuous_command():
    """A and the duration of DZV, which solve A + (1 - A)(1 - exp(-p L))/(p L) = 0; the error falls with the sample."""
    kernel = smoother("dzv", W, ZETA)
    errors = [abs(inverse_shaper(W, ZETA, h).direct - kernel.impulses[0][1]) for h in (0.02, 0.002)]
    assert errors[1] < 0.15 * errors[0] < 1.2e-3


def test_its_step_response_is_that_of_the_delay_equation():
    """A u + (1 - A)/L (integral of u over the last L) = 1 from rest: u = exp(-a t)/A with a = (1 - A)/(A L), up to L."""
    kernel, h = smoother("dzv", W, ZETA), 0.0005
    share, length = kernel.impulses[0][1], kernel.duration
    t = h * np.arange(int(0.95 * length / h))
    step = inverse_shaper(W, ZETA, h).running()
    found = np.array([step(1.0) for _ in t])
    assert np.abs(found - np.exp(-(1.0 - share) / (share * length) * t) / share).max() < 5e-3 / share


def test_it_undoes_the_shaper():
    command = np.random.default_rng(1).normal(size=2000)
    found = inverse_shaper(W, ZETA, H)
    shaped = np.asarray(lfilter(found.amplitudes, [1.0], command))
    step, held = found.running(), found.running(0.7)
    assert [step(y) for y in shaped.tolist()] == pytest.approx(command.tolist(), abs=1e-9)
    assert held(0.7) == pytest.approx(0.7, abs=1e-12)  # at rest from the beginning
    sine = 3.0
    assert found.response(np.array([sine]))[0] == pytest.approx(
        sum(a * np.exp(-1j * sine * H * k) for k, a in enumerate(found.amplitudes))
    )
    gains = 1.0 / np.abs(found.response(np.linspace(4.0, 6.0, 20001)))
    assert found.peak_gain == pytest.approx(gains.max(), rel=1e-6)


def trolley(way: str, reference: Callable[[float], float], disturbance: Callable[[float], float]) -> tuple[np.ndarray, np.ndarray]:
    """A trolley of 1 kg behind a sampled PD controller (1.5 rad/s, 0.8), with a light load that swings: the sum of control and
    disturbance, and the load's swing q'' + 2 zeta w q' + w^2 q = -x'' at each sample, by the matrix exponential."""
    inverse = inverse_shaper(W, ZETA, H)
    matrix = np.zeros((5, 5))
    matrix[0, 1] = matrix[2, 3] = matrix[1, 4] = 1.0
    matrix[3] = [0.0, 0.0, -W * W, -2.0 * ZETA * W, -1.0]
    grown = expm(matrix * H)
    state, commands, force, swing = np.zeros(4), np.zeros(len(inverse.amplitudes)), [], []
    back = inverse.running()
    for k in range(3000):
        commands = np.concatenate(([reference(k * H)], commands[:-1]))
        wanted = float(commands @ inverse.amplitudes) if way == "outside" else commands[0]
        measured = 2.25 * state[0] + 2.4 * state[1]
        measured = back(measured) if way == "inverse" else measured
        force.append(2.25 * wanted - measured + disturbance(k * H))
        state = grown[:4] @ np.append(state, force[-1])
        swing.append(state[2])
    return np.array(force), np.array(swing)


def excited(force: np.ndarray) -> float:
    """What a held force leaves of a mode after all, over what its parts would leave without cancelling: sum f_k exp(-p k h)."""
    parts = force * np.exp(-POLE * H * np.arange(len(force)))
    return float(abs(parts.sum()) / np.abs(parts).sum())


def test_in_the_feedback_path_neither_set_point_nor_disturbance_excites_the_mode():
    """Outside of the loop the shaper keeps the set point from it, and the disturbance swings the load as without a shaper."""
    step, none = (lambda _: 1.0), (lambda _: 0.0)
    gust = lambda t: 1.0 if 0.3 <= t < 0.8 else 0.0  # noqa: E731
    found = {
        way: [excited(trolley(way, *case)[0]) for case in ((step, none), (none, gust))] for way in ("plain", "outside", "inverse")
    }
    assert max(found["inverse"]) < 1e-5  # the sum ends after 30 s, while the loop itself still settles
    assert found["outside"][0] < 1e-9
    assert found["outside"][1] == pytest.approx(found["plain"][1], rel=1e-9)
    assert found["outside"][1] > 0.05
    assert found["plain"][0] > 0.05
    late = {way: np.abs(trolley(way, none, gust)[1][400:]).max() for way in ("plain", "inverse")}
    assert late["inverse"] < 0.2 * late["plain"]


@pytest.mark.parametrize(
    ("arguments", "error", "word"),
    [
        ((5.0, 0.0, 0.01), NoSolutionError, "damping_ratio = 0"),
        ((5.0, 1.0, 0.01), ArgumentError, "zeta = 1"),
        ((0.0, 0.1, 0.01), ArgumentError, "w = 0"),
        ((5.0, 0.1, 0.0), ArgumentError, "sample_period = 0"),
        ((5.0, 0.1, 1.0), ArgumentError, "limits: 4 to"),
        ((5.0, 0.1, 1e-5), ArgumentError, "to 4096"),
        ((5.0, 0.001, 0.1), NoSolutionError, "A = 0.0"),
    ],
)
def test_what_has_no_stable_inverse_is_refused_by_its_numbers(arguments, error, word):
    with pytest.raises(error, match=word):
        inverse_shaper(*arguments)
