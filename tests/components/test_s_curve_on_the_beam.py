"""The S-curve for two modes on the paper's beam with two modes, both as FMUs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.design import profile
from shaper_fmu.master.system import System
from shaper_fmu.plants.flexible_beam import FlexibleBeam

FIRST, SECOND = 22.048710, 208.511064
"""Ozokutan, Karadag, Kapucu and Kutuk 2025, eq. (7) [rad/s]."""
DAMPING = 0.03
MOVE, DISTANCE = 0.8 * 2 * math.pi / FIRST, 0.1


def left(fmus, kind: str, damping_ratio: float, **further: float) -> float:
    """The largest deflection of the tip after the move, both modes damped or not [m]."""
    system = System("beam")
    start = {"profile": kind, "distance": DISTANCE, "duration": MOVE, "natural_frequency": FIRST, "damping_ratio": damping_ratio}
    system.add("profile", fmus / "MotionProfile.fmu", **start, **further)
    system.add("beam", fmus / "FlexibleBeam.fmu", modes=2, modal_damping=[damping_ratio, damping_ratio])
    system.connect("profile.acceleration", "beam.base_acceleration")
    run = system.simulate(
        MOVE + 0.05, MOVE / 4000, record=["beam.tip_deflection"], algorithm="gauss_seidel", interpolation="linear"
    )
    return float(np.abs(run["beam.tip_deflection"][run.time > MOVE + 1e-9]).max())


@pytest.mark.parametrize("damping_ratio", [0.0, DAMPING])
def test_neither_mode_is_left_where_the_papers_s_curve_leaves_the_second(fmus, damping_ratio):
    """The paper's curve leaves V of the second mode times its participation, of the profile's quadrature; the other nothing."""
    second = {"second_natural_frequency": SECOND, "second_damping_ratio": damping_ratio}
    paper, both = left(fmus, "s_curve", damping_ratio), left(fmus, "s_curve_modes", damping_ratio, **second)
    beam = FlexibleBeam(modes=2)
    beam.initialize()
    v = profile("s_curve", DISTANCE, MOVE, FIRST, damping_ratio).residual_vibration(SECOND, damping_ratio)
    expected = DISTANCE * abs(beam.participation[1]) * v / math.sqrt(1 - damping_ratio**2)
    assert paper == pytest.approx(expected, rel=0.15 if damping_ratio else 0.01)  # between the envelope and the first peak
    assert both < 0.005 * paper
