"""Shaped commands on plants, all as FMUs from files, against the closed forms of the residual vibration."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest

from shaper_fmu.master.results import Results
from shaper_fmu.master.system import System

STEP = 0.01
HALF_PERIOD = 0.25  # Td/2 of the design: 25 steps, so that the edges fall on communication points


def shaped_plant(fmus, kind: str, wn: float, zeta: float, ratio: float) -> Results:
    """A unit step, shaped for (wn, zeta), on an oscillator of the frequency ratio * wn; Jacobi, so no instance is ahead."""
    w = ratio * wn
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper=kind, natural_frequency=[wn], damping_ratio=[zeta])
    system.add("plant", fmus / "MassSpringDamper.fmu", stiffness=w * w, damping=2.0 * zeta * w)
    system.drive("shaper.command", 1.0)
    system.connect("shaper.shaped", "plant.force")
    return system.simulate(3.0, STEP, algorithm="jacobi")


def residual_v(results: Results, w: float, zeta: float, end: float) -> float:
    """Envelope of the free vibration at `end`, relative to that of the unit step at its time (V of Singer and Seering).

    It is taken from the state half a second later and carried back by the envelope's decay.
    """
    at = round(end / STEP) + 50
    deviation = results["plant.position"][at] - 1.0 / (w * w)
    speed = results["plant.velocity"][at]
    wd = w * math.sqrt(1.0 - zeta * zeta)
    envelope = math.hypot(deviation, (speed + zeta * w * deviation) / wd) * math.exp(zeta * w * 50 * STEP)
    return envelope * w * w * math.sqrt(1.0 - zeta * zeta)


def formula_v(order: int, wn: float, zeta: float, ratio: float) -> float:
    """V of the ZV (order 1) and ZVD (order 2) shapers: |sum_i A_i exp(p (t_n - t_i))|, closed-form A_i and t_i."""
    k = math.exp(-zeta * math.pi / math.sqrt(1 - zeta**2))
    td = 2 * math.pi / (wn * math.sqrt(1 - zeta**2))
    pole = ratio * wn * complex(-zeta, math.sqrt(1 - zeta**2))
    impulses = [(math.comb(order, i) * k**i / (1 + k) ** order, i * td / 2) for i in range(order + 1)]
    return abs(sum(a * cmath.exp(pole * (order * td / 2 - t)) for a, t in impulses))


@pytest.mark.parametrize("zeta", [0.0, 0.0891, 0.3])
@pytest.mark.parametrize(("kind", "order"), [("zv", 1), ("zvd", 2)])
@pytest.mark.parametrize("ratio", [0.8, 0.9, 1.0, 1.1, 1.2])
def test_residual_vibration_is_the_formula(fmus, kind, order, zeta, ratio):
    wn = math.pi / (HALF_PERIOD * math.sqrt(1 - zeta**2))
    results = shaped_plant(fmus, kind, wn, zeta, ratio)
    found = residual_v(results, ratio * wn, zeta, order * HALF_PERIOD)
    expected = formula_v(order, wn, zeta, ratio)
    assert found == pytest.approx(expected, abs=1e-9)  # at the design frequency the formula is below 1e-15
    assert (expected < 1e-12) == (ratio == 1.0)


@pytest.mark.parametrize(("kind", "order"), [("zv", 1), ("zvd", 2)])
def test_impulses_that_leave_the_fmu_are_the_designed_ones(fmus, kind, order):
    zeta = 0.0891
    wn = math.pi / (HALF_PERIOD * math.sqrt(1 - zeta**2))
    results = shaped_plant(fmus, kind, wn, zeta, 1.0)
    jumps = np.flatnonzero(np.diff(results["shaper.shaped"])) + 1
    k = math.exp(-zeta * math.pi / math.sqrt(1 - zeta**2))
    amplitudes = [math.comb(order, i) * k**i / (1 + k) ** order for i in range(order + 1)]
    assert results["shaper.shaped"][0] == pytest.approx(amplitudes[0], abs=1e-12)
    assert results.time[jumps] == pytest.approx([HALF_PERIOD * (i + 1) for i in range(order)], abs=1e-12)
    assert np.diff(results["shaper.shaped"])[jumps - 1] == pytest.approx(amplitudes[1:], abs=1e-12)
    assert results["shaper.shaped"][-1] == 1.0


W, ZETA = 22.9476, 0.0891  # the plant of Taskin, Kilic and Kapucu 2019


def cycloid_versine_ramp_residual(fmus, duration: float, steps: int) -> float:
    """V after the profile of Taskin, Kilic and Kapucu 2019 at its design frequency, held over `steps` communication steps."""
    step = duration / steps
    system = System()
    profile = {"profile": "cycloid_versine_ramp", "duration": duration, "natural_frequency": W, "damping_ratio": ZETA}
    system.add("profile", fmus / "MotionProfile.fmu", profile)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="none")
    system.add("plant", fmus / "MassSpringDamper.fmu", stiffness=W * W, damping=2 * ZETA * W)
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    results = system.simulate(duration + 4 * step, step, record=["plant.position", "plant.velocity"])
    deviation, speed = results["plant.position"][-1] - 1.0 / (W * W), results["plant.velocity"][-1]
    wd = W * math.sqrt(1 - ZETA**2)
    return math.hypot(deviation, (speed + ZETA * W * deviation) / wd) * W * W * math.sqrt(1 - ZETA**2)


@pytest.mark.parametrize("duration", [0.1374496, 0.1222, 0.3])
def test_cycloid_versine_ramp_leaves_nothing_in_the_limit_of_small_steps(fmus, duration, record_property):
    """Holding y over steps of h delays it by h/2, which leaves no residual, and errs by O(h^2): order 2 to zero."""
    residuals = [cycloid_versine_ramp_residual(fmus, duration, steps) for steps in (50, 100, 200, 400)]
    orders = [math.log2(a / b) for a, b in pairwise(residuals)]
    record_property("residuals", residuals)
    record_property("orders", orders)
    print(f"\nduration {duration} s: V = {residuals}, observed orders {orders}")
    assert orders == pytest.approx([2.0, 2.0, 2.0], abs=0.06)
    assert residuals[-1] < 1e-3
    # Richardson's limit of the last two for order 2 is zero, up to the next order's terms
    assert abs(4 * residuals[-1] - residuals[-2]) < 0.01 * residuals[-2]
