"""ShapedStop where the damping ratio is at its limit: exp(zeta w t) over a change would be beyond all numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from shaper_fmu.commands.shaped_stop import TOO_MUCH_SWING, ShapedStop


def planned(rope: float, acceleration: float, speed: float) -> tuple[ShapedStop, int]:
    stop = ShapedStop()
    stop.damping_ratio, stop.rope_length, stop.initial_angle = 0.999, rope, 0.1
    stop.max_acceleration, stop.max_speed, stop.target_speed = acceleration, speed, speed
    return stop, stop.start() or stop.step(0.0, 0.01)


@pytest.mark.parametrize(("rope", "acceleration"), [(5.0, 0.001), (0.01, 0.3)])
def test_the_load_rests(rope, acceleration):
    """The linear pendulum theta'' + 2 zeta w theta' + w^2 theta = -a/l through the pieces, by the matrix exponential."""
    stop, code = planned(rope, acceleration, 1.0)
    assert code == 0
    w = math.sqrt(9.81 / rope)
    state, speed, zeta = np.array([0.1, 0.0]), 0.0, 0.999
    rates = np.array([[0.0, 1.0, 0.0], [-(w**2), -2.0 * zeta * w, -1.0 / rope], [0.0, 0.0, 0.0]])
    for level, time in zip(stop.plan_level[: stop.planned], stop.plan_time[: stop.planned], strict=True):
        assert abs(level) <= acceleration
        state = (expm(rates * time) @ [*state, level])[:2]
        speed += level * time
    assert speed == pytest.approx(1.0, rel=1e-12)
    forced = acceleration / (rope * w**2)  # the angle that this acceleration holds
    assert math.hypot(state[0], state[1] / w) <= 1e-9 * max(0.1, forced)
    assert stop.rest_time >= 1.0 / acceleration


def test_what_cannot_be_told_by_numbers_is_refused():
    """A ramp of 1e15 s on a rope that swings 16 000 times a second: no math range error."""
    _, code = planned(1e-9, 1e-9, 1e6)
    assert code == TOO_MUCH_SWING
