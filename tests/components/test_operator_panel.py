"""The component OperatorPanel: jumps at the times that were given, in co-simulation at any step."""

from __future__ import annotations

import pytest

from shaper_fmu import System, fmu_path
from shaper_fmu.commands.operator_panel import OperatorPanel
from shaper_fmu.component import NO_EVENT
from shaper_fmu.errors import ComponentError

PRESSED = {
    "presses": 3,
    "press_time": [0.5, 1.23, 2.0],
    "press_speed": [0.4, -1.0, 0.0],
    "stop_time": 1.5,
    "release_time": 1.75,
}


@pytest.mark.parametrize("step", [0.1, 0.07, 3.0])
def test_buttons_act_when_they_are_pressed(step):
    system = System()
    system.add("panel", fmu_path("OperatorPanel", platforms=["this"]), **PRESSED)
    results = system.simulate(3.0, step, everywhere=True)
    time, speed, stop = results.time, results["panel.speed"], results["panel.stop"]
    for at, value in [(0.0, 0.0), (0.5, 0.4), (1.23, -1.0), (2.0, 0.0)]:
        assert speed[abs(time - at) < 1e-9][-1] == value
    assert stop[abs(time - 1.5) < 1e-9][-1]
    assert not stop[abs(time - 1.75) < 1e-9][-1]
    assert not stop[(time < 1.5) | (time > 1.75)].any()


def test_left_limits_and_events():
    panel = OperatorPanel(**PRESSED)
    panel.initialize()
    assert panel.next_event_time == 0.5
    panel.do_step(0.0, 0.5, left_limits=True)
    assert panel.speed == 0.0
    panel.do_step(0.5, 0.0)
    assert (panel.speed, panel.next_event_time) == (0.4, 1.23)
    panel.do_step(0.5, 3.0)
    assert (panel.speed, panel.stop, panel.next_event_time) == (0.0, False, NO_EVENT)


def test_times_that_do_not_rise_are_refused():
    with pytest.raises(ComponentError, match="press_time must rise over its first 3 elements"):
        OperatorPanel(**{**PRESSED, "press_time": [0.5, 0.5, 1.0]}).initialize()
