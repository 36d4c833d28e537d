"""Maps over natural frequency and damping ratio: FMU runs against the design objects' V, and what is made of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from documented_verdicts import assert_documented

from shaper_fmu import carrier_pulses, minimax_pulses, profile, shaper, unity_magnitude_pulses
from shaper_fmu.page.figures import Map
from shaper_fmu.reproduce.pwm.runs import DAMPING_RATIO, HALF_PERIOD, NATURAL_FREQUENCY
from shaper_fmu.reproduce.runs import band_below, last_crossing
from shaper_fmu.reproduce.unknown_parameters import paper as of

MODE = NATURAL_FREQUENCY, DAMPING_RATIO
DESIGNS = {
    "ZV": shaper("zv", *MODE),
    "ZVD": shaper("zvd", *MODE),
    "EI": shaper("ei", *MODE),
    "single profile": profile("cycloid_versine_ramp", 1.0, of.MOVE, *MODE),
    "two-part": profile("two_part", 1.0, of.MOVE, *MODE),
    "S-curve": profile("s_curve", 1.0, of.MOVE, *MODE),
    "PWM, ratio 12": carrier_pulses(HALF_PERIOD, *MODE, 12.0),
    "on/off, minimax": minimax_pulses(HALF_PERIOD, *MODE),
    "on/off, UM-ZVD": unity_magnitude_pulses("zvd", *MODE),
    of.UNDAMPED.name: profile("s_curve", 1.0, of.MOVE, NATURAL_FREQUENCY, 0.0),
}


def blurred(duration: float, jumps: int, parts: int) -> float:
    """What holding makes of the velocity's jumps at the ends, eqs. (3)-(6): w h^2 / 24 of each [% of a step's]."""
    r = 2.0 * math.pi / duration / NATURAL_FREQUENCY
    speed = r * r / duration / parts  # (L1 + L3) / tau: what begins at once
    return 100.0 * jumps * speed * 1.2 * NATURAL_FREQUENCY * of.PROFILE_STEP**2 / 24.0


JUMPING = {"single profile": blurred(of.MOVE, 2, 1), "two-part": blurred(0.5 * of.MOVE, 4, 2)}
FREQUENCY, DAMPING = np.array([0.8, 0.9, 1.0, 1.1, 1.2]), DAMPING_RATIO * np.array([0.0, 1.0, 2.0])


@pytest.fixture(scope="module")
def found() -> dict[str, of.Found]:
    return {c.name: of.vibration_map(c, FREQUENCY, DAMPING) for c in [*of.COMMANDS, of.UNDAMPED]}


@pytest.mark.parametrize("name", DESIGNS)
def test_maps_agree_with_the_formulas(found, name):
    """Shapers and on/off commands to the last digits; profiles are held over 100 steps, which changes V by (w h)^2 / 24 of it."""
    design = DESIGNS[name]
    expected = [[100.0 * design.residual_vibration(x * NATURAL_FREQUENCY, z) for x in FREQUENCY] for z in DAMPING]
    held = isinstance(next(c for c in [*of.COMMANDS, of.UNDAMPED] if c.name == name).duration, float)
    share = (1.2 * NATURAL_FREQUENCY * of.PROFILE_STEP) ** 2 / 24.0 if held else 1e-9
    np.testing.assert_allclose(found[name].values, expected, rtol=share, atol=JUMPING.get(name, 1e-4 if held else 1e-10))
    assert found[name].duration == pytest.approx(design.duration, rel=1e-12)


def test_claims_and_blocks_name_what_was_found(found):
    claims = of._claims(found, of.two_part_by_estimate())
    assert [claim.verdict for claim in claims] == ["reproduced", "reproduced", "not reproduced", "reproduced"]
    assert_documented("unknown-parameters", claims)
    assert f"V up to {found['two-part'].over_damping().max():.2f} %" in claims[0].number
    assert found["two-part"].share() == np.mean(found["two-part"].values < 5.0)
    maps = [block for block in of._blocks(found) if isinstance(block, Map)]
    assert [name for name, _ in maps[0].panels] == [command.name for command in of.COMMANDS]


def test_which_way_to_err():
    """V of the design's own closed formula, by the estimate for which it is designed; held over 2000 steps.

    10.5, 4.4, 3.2, 5.7 % for a fixed duration are those of an independent recomputation.
    """
    found = of.two_part_by_estimate()
    for name, duration, plant in (
        ("same duration", lambda x: of.MOVE, lambda x: 1.0),
        ("duration in periods of the estimate", lambda x: of.MOVE / x, lambda x: 1.0),
        ("plant", lambda x: of.MOVE, lambda x: x),
    ):
        designs = [
            profile("two_part", 1.0, duration(x), NATURAL_FREQUENCY * (1.0 if name == "plant" else x), DAMPING_RATIO)
            for x in of.ERRORS
        ]
        expected = [
            100.0 * design.residual_vibration(plant(x) * NATURAL_FREQUENCY, DAMPING_RATIO)
            for design, x in zip(designs, of.ERRORS, strict=True)
        ]
        assert found[name] == pytest.approx(expected, rel=1e-4, abs=1e-4)
    fixed, in_periods = found["same duration"], found["duration in periods of the estimate"]
    assert [f"{v:.1f}" for v in fixed] == ["10.5", "4.4", "3.2", "5.7"]
    assert fixed[0] > fixed[3]
    assert fixed[1] > fixed[2]  # rather high
    assert in_periods[0] < in_periods[3]
    assert in_periods[1] < in_periods[2]  # rather low


def test_an_ei_shaper_counts_where_it_has_just_the_tolerated_vibration(found):
    assert found["EI"].nominal() == pytest.approx(5.0, abs=1e-6)
    assert found["EI"].width() > found["ZVD"].width()


def test_bands_and_crossings():
    x = np.linspace(0.0, 4.0, 41)
    y = np.abs(x - 2.0)
    assert band_below(x, y, 0.75, 2.0) == pytest.approx((1.25, 2.75))
    assert band_below(x, y, 0.75, 1.75) == pytest.approx((1.25, 2.75))  # a centre between points of the grid
    assert band_below(x, y, 9.0, 2.0) == (0.0, 4.0)
    assert band_below(x, y, 0.75, 3.0) == (3.0, 3.0)
    assert last_crossing(x, 3.0 - x, 0.55) == pytest.approx(2.45)
    assert last_crossing(x, y, 9.0) == 0.0
    assert np.isnan(last_crossing(x, x, 3.0))
