"""Shaped accelerations of the flexible beam's base: residuals equal to the formula at any communication step."""

from __future__ import annotations

import math
from typing import cast

import pytest
from scipy.optimize import brentq

from shaper_fmu import System
from shaper_fmu.design.pulses import carrier_pulses
from shaper_fmu.design.shapers import shaper
from shaper_fmu.export.build import fmu_path

W, ZETA = 22.0, 0.02  # what the commands are designed for; no edge falls on a grid of 1, 7 or 50 ms
BEGIN = 0.0137
MECHANISMS = {"next_event_time": 2, "event mode": 3}


def beam_system(mechanism: str, source: str, parameters: dict, output: str) -> System:
    """A command as acceleration of the base of the paper's beam, in its first mode, 22.0487 rad/s."""
    fmi = MECHANISMS[mechanism]
    system = System()
    system.add("source", fmu_path(source, fmi, platforms=["this"]), parameters)
    system.add("beam", fmu_path("FlexibleBeam", fmi, platforms=["this"]), {"modal_damping[1]": ZETA}, modes=1)
    system.connect(f"source.{output}", "beam.base_acceleration")
    return system


def residual(system: System, end: float, step: float, exact: bool | None) -> float:
    """V at the command's end, from the last recorded state of the mode: q'' + 2 zeta w q' + w^2 q = -Gamma a."""
    names = ["natural_frequency[1]", "participation[1]", "modal_deflection[1]", "modal_velocity[1]"]
    stop = step * math.ceil((end + 0.1) / step)
    results = system.simulate(stop, step, exact=exact, record=[f"beam.{name}" for name in names])
    w, gamma, q, speed = (float(results[f"beam.{name}"][-1]) for name in names)
    wd = w * math.sqrt(1.0 - ZETA * ZETA)
    deviation = q + gamma / (w * w)
    envelope = math.hypot(deviation, (speed + ZETA * w * deviation) / wd) * math.exp(ZETA * w * (stop - end))
    return envelope * w * w * math.sqrt(1.0 - ZETA * ZETA) / gamma


@pytest.fixture(scope="module")
def true_frequency() -> float:
    """First mode of a cantilever with a tip mass: 1 + cos b cosh b + (m_tip / m_beam) b (cos b sinh b - sin b cosh b) = 0."""

    def excess(b: float) -> float:
        c, s = math.cos(b), math.sin(b)
        return 1.0 + c * math.cosh(b) + 0.015 / 0.02 * b * (c * math.sinh(b) - s * math.cosh(b))

    root = cast(float, brentq(excess, 1.0, 1.6, xtol=1e-15))
    assert root == pytest.approx(1.3202665, abs=5e-8)  # Ozokutan, Karadag, Kapucu and Kutuk (2025): 1.3202
    return root**2 * math.sqrt(3e9 * 0.025 * 0.002**3 / 12 / (0.02 * 0.25**3))


@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
@pytest.mark.parametrize("mechanism", MECHANISMS)
@pytest.mark.parametrize("kind", ["zv", "zvd", "ei"])
@pytest.mark.representatives(kind=["zv"])
def test_a_shaped_acceleration_leaves_the_residual_of_the_formula(kind, mechanism, step, true_frequency):
    """V of Singer and Seering 1990 with impulses designed for a frequency that is not quite the beam's."""
    parameters = {"shaper": kind, "natural_frequency[1]": W, "damping_ratio[1]": ZETA}
    system = beam_system(mechanism, "InputShaper", parameters, "shaped")
    system.drive("source.command", [(0.0, 0.0), (BEGIN, 1.0)])
    impulses = shaper(kind, W, ZETA)
    expected = impulses.residual_vibration(true_frequency, ZETA)
    found, on_grid = (residual(system, BEGIN + impulses.duration, step, exact) for exact in (None, False))
    assert found == pytest.approx(expected, abs=1e-10)
    assert abs(on_grid - expected) > 1e4 * max(abs(found - expected), 1e-10)


@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
@pytest.mark.parametrize("mechanism", MECHANISMS)
def test_a_pulse_train_on_the_beam_leaves_the_residual_of_the_formula(mechanism, step, true_frequency):
    duration = 0.24
    parameters = {"duration": duration, "natural_frequency": W, "damping_ratio": ZETA, "frequency_ratio": 13.0, "start_time": BEGIN}
    system = beam_system(mechanism, "PulseTrain", {"design": "carrier", **parameters}, "pulse")
    expected = carrier_pulses(duration, W, ZETA, 13.0).residual_vibration(true_frequency, ZETA)
    found, on_grid = (residual(system, BEGIN + duration, step, exact) for exact in (None, False))
    assert found == pytest.approx(expected, abs=1e-10)
    assert abs(on_grid - expected) > 1e4 * max(abs(found - expected), 1e-10)
