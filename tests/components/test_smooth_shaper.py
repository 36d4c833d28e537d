"""SmoothShaper: zeros by scipy's quadrature, exact for held and linear commands at any step, and through FMUs."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from native_host import native_fmu
from scipy.integrate import fixed_quad
from scipy.optimize import fsolve

from shaper_fmu.commands.smooth_shaper import HISTORY_FULL, SmoothShaper
from shaper_fmu.component import NO_EVENT, Component
from shaper_fmu.design.guarantees import guarantee
from shaper_fmu.design.shapers import shaper
from shaper_fmu.design.smoothers import SmoothKernel, smoother
from shaper_fmu.errors import ArgumentError
from shaper_fmu.kinds.smoothers import SMOOTHERS
from shaper_fmu.master.system import System
from shaper_fmu.smoothers.edges import EDGES

W, ZETA = 5.0, 0.03
KINDS = [
    ("dzv", {}), ("dzv", {"box_share": 0.4}), ("dzvd", {}), ("dzvd", {"box_share": 0.7}), ("ramped_zv", {}),
    ("ramped_zv", {"ramp_periods": 0.2}), ("ramped_zvd", {}), ("ramped_zvd", {"ramp_periods": 0.9}), ("smoother", {}),
]  # fmt: skip
every_kind = pytest.mark.parametrize(("kind", "parameters"), KINDS)


def pole(w: float, zeta: float) -> complex:
    return w * complex(-zeta, math.sqrt(1.0 - zeta * zeta))


def transformed(kernel: SmoothKernel, p: complex) -> complex:
    """The kernel's Laplace transform at p by scipy's quadrature of its density between the breakpoints."""
    total = sum((size * cmath.exp(-p * t) for t, size in kernel.impulses), 0j)
    for begin, end in pairwise(kernel.breakpoints):
        total += fixed_quad(lambda t: kernel.step_slope(t) * np.exp(-p * t), begin, end, n=60)[0]
    return total


def test_every_kind_is_tested():
    assert {kind for kind, _ in KINDS} == set(SMOOTHERS)


@every_kind
@pytest.mark.parametrize("zeta", [0.0, 1e-6, 0.03, 0.4])
def test_the_modes_poles_are_zeros_and_the_command_is_reached(kind, parameters, zeta):
    """Of three modes; with a zero derivative where the method says so."""
    modes = [3.0, 7.0, 11.0]
    kernel = smoother(kind, modes, zeta, **parameters)
    assert kernel.certificate < 1e-14
    for w in modes:
        p = pole(w, zeta)
        assert abs(transformed(kernel, p)) < 1e-9 * max(1.0, math.exp(zeta * w * kernel.duration))
        if kind in ("dzvd", "ramped_zvd", "smoother"):
            assert abs(transformed(kernel, p * 1.0001)) < 1e-6 * math.exp(zeta * w * kernel.duration)
    response = kernel.step_response(np.linspace(0.0, kernel.duration, 200))
    assert np.diff(response).min() > -1e-12  # of positive parts
    assert response[-1] == 1.0
    later = [fixed_quad(lambda t: 1.0 - kernel.step_response(t), *ends, n=9)[0] for ends in pairwise(kernel.breakpoints)]
    assert sum(later) == pytest.approx(kernel.mean_delay, rel=1e-12)


@pytest.mark.parametrize("zeta", [0.01, 0.1, 0.5])
def test_dzv_is_the_equation_solved_by_scipy(zeta):
    """A + (1 - A)(1 - exp(-p T))/(p T) = 0 (Vyhlidal, Kucera and Hromcik 2013)."""

    def left(x: np.ndarray) -> list[float]:
        a, theta = x[0], pole(1.0, zeta) * x[1]
        value = a + (1.0 - a) * (1.0 - cmath.exp(-theta)) / theta
        return [value.real, value.imag]

    kernel = smoother("dzv", 1.0, zeta)
    start = math.sqrt(zeta / math.pi)  # of the smallest damping: a = A/(1 - A), T = 2 pi (1 - a)/wd
    wanted: Any = fsolve(left, [start / (1.0 + start), 2.0 * math.pi * (1.0 - 0.8 * start)], xtol=1e-13)
    assert [kernel.impulses[0][1], kernel.duration] == pytest.approx(wanted.tolist(), rel=1e-9)
    assert kernel.duration < 2.0 * math.pi / math.sqrt(1.0 - zeta * zeta)


def test_without_damping_the_average_is_the_mean_over_a_period_and_dzv_as_well():
    for kind in ("dzv", "ramped_zv"):
        kernel = smoother(kind, 1.0)
        t = np.linspace(0.0, 2.0 * math.pi, 50)
        assert kernel.step_response(t) == pytest.approx(t / (2.0 * math.pi), abs=1e-15)
        assert not kernel.impulses
    near = smoother("ramped_zv", W, ZETA, ramp_periods=1e-6)
    zv = shaper("zv", W, ZETA)
    assert near.residual_vibration(6.0, ZETA) == pytest.approx(zv.residual_vibration(6.0, ZETA), rel=1e-4)
    assert near.insensitivity(W, ZETA) == pytest.approx(zv.insensitivity(W, ZETA), rel=1e-3)


@every_kind
def test_figures_of_merit(kind, parameters):
    """V by quadrature is |K(p)| exp(-zeta w D); a band's bound is the tolerance; no floor is undercut."""
    kernel = smoother(kind, W, ZETA, **parameters)
    for w in (4.0, 5.0, 6.5):
        v = abs(transformed(kernel, pole(w, ZETA))) * math.exp(-ZETA * w * kernel.duration)
        assert kernel.residual_vibration(w, ZETA) == pytest.approx(v, abs=1e-11)
    width = kernel.insensitivity(W, ZETA)
    assert width > 0.05
    box = guarantee(kernel.as_impulses(3.0 * W), (W, 1.02 * W), (ZETA, ZETA))
    assert box.bound < 0.05
    distance = kernel.distance_to_floor(W, 0.05, ZETA)
    assert distance is None or distance > 0.0


def signal(t: np.ndarray | float, linear: bool) -> np.ndarray:
    """A signal that is held from 0.35 s to 0.35 s, or linear between."""
    knots = np.arange(0.0, 20.0, 0.35)
    values = np.sin(1.3 * knots) + 0.2 * knots
    if linear:
        return np.asarray(np.interp(t, knots, values))
    return np.asarray(values[np.searchsorted(knots, np.asarray(t) + 1e-9) - 1])


def fed(linear: bool, step: float, **parameters: Any) -> tuple[np.ndarray, SmoothShaper]:
    """Times, shaped, slope and mean over the last step, shape (4, times)."""
    component = SmoothShaper(initial_command=float(signal(0.0, linear)), **parameters)
    component.initialize()
    rows = []
    for k in range(round(7.0 / step)):
        now, end = k * step, (k + 1) * step
        component.command = float(signal(now, linear))
        component.command_slope = (float(signal(end, linear)) - component.command) / step if linear else 0.0
        component.do_step(now, step)
        rows.append((end, component.shaped, component.shaped_slope, component.shaped_mean))
    return np.array(rows).T, component


@every_kind
@pytest.mark.parametrize("linear", [False, True])
def test_exact_for_held_and_linear_commands_at_any_step(kind, parameters, linear):
    """The convolution by numpy, at 3 instants; equal at steps of 35, 50 and 350 ms; slope and mean belong to it."""
    parameters = {"smoother": kind, "natural_frequency": [W, 9.0], "damping_ratio": [ZETA, 0.1], "modes": 2, **parameters}
    kernel = smoother(kind, [W, 9.0], [ZETA, 0.1], **{k: v for k, v in parameters.items() if k in ("box_share", "ramp_periods")})
    runs = {step: fed(linear, step, **parameters)[0] for step in (0.035, 0.05, 0.35)}
    assert runs[0.035][1, 9::10] == pytest.approx(runs[0.35][1], abs=1e-11)
    assert runs[0.05][1, 6::7] == pytest.approx(runs[0.35][1], abs=1e-11)
    means = runs[0.035][3].reshape(-1, 10).mean(axis=1)
    assert means == pytest.approx(runs[0.35][3], abs=1e-10)
    masses = kernel.as_impulses(400.0)
    for t, value, slope, _ in runs[0.35].T[[5, 11, 19]]:
        if linear:
            wanted = float(np.array(masses.amplitudes) @ signal(t - np.array(masses.delays), True))
            assert value == pytest.approx(wanted, abs=3e-5)
        knots = np.arange(0.0, t - 1e-6, 0.35)
        jumps = np.diff(signal(knots, False), prepend=signal(0.0, False))
        if not linear:
            assert value == pytest.approx(signal(0.0, False) + jumps @ kernel.step_response(t - knots), abs=1e-11)
            assert slope == pytest.approx(jumps @ kernel.step_slope(np.maximum(t - knots, 0.0)), abs=1e-9)


def started(kind: type[Component], **parameters: Any) -> tuple[Kernels, np.ndarray]:
    """A component compiled, for runs with many steps."""
    compiled, record = Kernels(kind), record_of(kind(**parameters))
    assert compiled.start(record) == 0
    return compiled, record


def test_a_long_linear_command_is_later_by_the_mean_delay_and_ends_at_its_value():
    compiled, record = started(SmoothShaper, natural_frequency=[W], smoother="smoother")
    for k in range(3 * EDGES):
        record["command"], record["command_slope"] = 0.1 * 0.01 * k, 0.1
        assert compiled.step(record, 0.01 * k, 0.01) == 0
    end = 0.01 * 3 * EDGES
    assert record["shaped"] == pytest.approx(0.1 * (end - record["mean_delay"]), rel=1e-12)
    assert record["next_event_time"] == NO_EVENT  # a linear command has no jumps
    record["command"], record["command_slope"] = 0.25, 0.0
    assert compiled.step(record, end, 10.0) == 0
    assert record["shaped"] == 0.25
    assert record["settled"]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
@pytest.mark.parametrize("kind", ["ramped_zv", "ramped_zvd"])
def test_through_fmus_nothing_vibrates_after_the_command(fmi, step, kind):
    """A position that jumps becomes ramps, whose speed is held between events: an oscillator driven by the speed is at rest."""
    system = System()
    mode = {"natural_frequency[1]": W, "damping_ratio[1]": ZETA}
    system.add("shaper", native_fmu("SmoothShaper", fmi), smoother=kind, **mode)
    system.add("plant", native_fmu("MassSpringDamper", fmi), stiffness=W * W, damping=2.0 * ZETA * W)
    system.drive("shaper.command", [(0.0, 0.0), (0.123, 1.0), (0.6, -0.4), (0.9, 0.35)])
    system.connect_raw("shaper.shaped_slope", "plant.force", 1.0)
    results = system.simulate(6.0, step)
    t, x, wd = results.time, results["plant.position"], W * math.sqrt(1.0 - ZETA**2)
    envelope = np.hypot(x, (results["plant.velocity"] + ZETA * W * x) / wd)
    assert envelope[t < 1.5].max() > 0.01  # it does swing
    assert envelope[t > 3.0].max() < 1e-11
    assert results["shaper.shaped"][-1] == 0.35


@every_kind
def test_compiled_it_gives_the_same_bits(kind, parameters):
    rng = np.random.default_rng(5)
    compiled = Kernels(SmoothShaper)
    component = SmoothShaper(smoother=kind, modes=2, natural_frequency=[W, 9.0], damping_ratio=[0.03, 0.1], **parameters)
    record = record_of(component)
    assert compiled.start(record) == component.start() == 0
    for k in range(150):
        if rng.random() < 0.2:
            component.command = record["command"] = float(rng.uniform(-1.0, 1.0))
            component.command_slope = record["command_slope"] = float(rng.choice([0.0, 0.3]))
        assert component.step(0.02 * k, 0.02) == compiled.step(record, 0.02 * k, 0.02)
        assert record_of(component).tobytes() == record.tobytes()


def test_what_is_wrong_is_refused_with_the_reason():
    with pytest.raises(ArgumentError, match="there is no smoother 'dzz'"):
        smoother("dzz", 1.0)
    with pytest.raises(ArgumentError, match="1 to 3 modes"):
        smoother("dzv", [1.0, 2.0, 3.0, 4.0])
    with pytest.raises(ArgumentError, match="no parameter 'share'"):
        smoother("dzv", 1.0, share=0.5)
    with pytest.raises(ArgumentError, match="box_share = 0"):
        smoother("dzv", 1.0, box_share=0.0)


def test_what_cannot_be_kept_in_mind_is_an_error():
    """The 4095th change within the duration."""
    compiled, record = started(SmoothShaper, natural_frequency=[0.1])
    statuses = []
    for k in range(EDGES + 2):
        record["command"] = math.sin(0.001 * k + 1.0)
        statuses.append(compiled.step(record, 0.001 * k, 0.001))
    assert statuses[: EDGES - 1] == [0] * (EDGES - 1)
    assert statuses[EDGES] == HISTORY_FULL
