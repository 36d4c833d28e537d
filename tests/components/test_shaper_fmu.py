"""The input shaper as an FMU: what leaves it is what was designed, and it can be retuned while it runs."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import SimulationError
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance

SIZE = 3.0  # of the step


def started(fmus, values) -> Instance:
    instance = Instance("shaper", load_fmu(fmus / "InputShaper.fmu"))
    instance.set_values(instance.fmu.start_values(values))
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        instance.call(call)
    return instance


@pytest.mark.parametrize("modes", [1, 2])
@pytest.mark.parametrize("kind", [item.name for item in Shaper if item != Shaper.custom])
def test_impulses_that_leave_the_fmu_are_the_designed_ones(fmus, kind, modes):
    """Communication steps that divide no delay, shortened onto the events that the FMU announces."""
    w, zeta = [5.0, 13.7][:modes], [0.05, 0.02][:modes]
    sequence = shaper(kind, w, zeta)
    instance = started(fmus, {"shaper": kind, "modes": modes, "natural_frequency": w, "damping_ratio": zeta})
    instance.set_values({"command": SIZE})
    step = (sequence.duration or 1.0) / 23.7
    t, level, seen = 0.0, *instance.get_values(["shaped"]), []
    seen.append((0.0, level))
    while t < 1.2 * sequence.duration + step:
        event = instance.get_values(["next_event_time"])[0]
        end = min(t + step, event)
        instance.call("doStep", t, end - t)
        new = instance.get_values(["shaped"])[0]
        if end == event:
            seen.append((event, new - level))
        else:
            assert new == level  # nothing happens between the events
        t, level = end, new
    assert [time for time, _ in seen] == pytest.approx(sequence.delays, abs=1e-12)
    assert [size / SIZE for _, size in seen] == pytest.approx(sequence.amplitudes, abs=1e-12)
    assert instance.get_values(["shaped", "settled", "next_event_time"]) == [SIZE, 1, NO_EVENT]
    calculated = instance.get_values(["duration", "impulses", "certificate"])
    assert calculated == [pytest.approx(sequence.duration, rel=1e-14), len(sequence.delays), sequence.certificate]
    assert calculated[2] < 1e-11
    instance.close()


@pytest.fixture(scope="module")
def retunable(fmus):
    instance = started(fmus, {"shaper": "zvd", "natural_frequency": [5.0], "damping_ratio": [0.1]})
    yield instance
    instance.close()


@settings(deadline=None, max_examples=25)
@given(change=st.floats(0.0, 2.5), w=st.floats(2.0, 15.0), zeta=st.floats(0.0, 0.4), step=st.sampled_from([0.011, 0.03]))
def test_a_frequency_change_during_a_move_is_continuous_and_leaves_no_error(retunable, change, w, zeta, step):
    retunable.call("reset")
    retunable.set_values({"shaper": 3, "natural_frequency[1]": 5.0, "damping_ratio[1]": 0.1})
    for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
        retunable.call(call)
    duration = max(shaper("zvd", 5.0, 0.1).duration, shaper("zvd", w, zeta).duration)
    changed, i, move = False, 0, 1.0
    while i * step < max(move, change) + duration + 2 * step:
        t = i * step
        retunable.set_values({"command": min(1.0, round(t / move, 3))})  # a ramp
        if not changed and t >= change:
            before = retunable.get_values(["shaped"])[0]
            retunable.set_values({"natural_frequency[1]": w, "damping_ratio[1]": zeta})
            assert retunable.get_values(["shaped"])[0] == pytest.approx(before, abs=1e-14)
            changed = True
        retunable.call("doStep", t, step)
        i += 1
    assert retunable.get_values(["shaped", "settled"]) == [1.0, 1]
    assert retunable.get_values(["duration"])[0] == pytest.approx(shaper("zvd", w, zeta).duration, rel=1e-14)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("natural_frequency[1]", -2.0, "must be greater than 0 rad/s"),
        ("natural_frequency[2]", math.nan, "must be a finite number"),
        ("damping_ratio[1]", 1.0, "must be less than 1"),
        ("modes", 2, "modes is fixed"),
    ],
)
def test_impossible_changes_are_refused_at_the_set(fmus, name, value, words):
    instance = started(fmus, {"shaper": "zv"})
    with pytest.raises(SimulationError, match=words):
        instance.set_values({name: value})


def test_a_shaper_that_does_not_exist_is_told(fmus):
    with pytest.raises(SimulationError, match=r"no three_hump_ei shaper was found beyond the damping ratio 0\.2"):
        started(fmus, {"shaper": "three_hump_ei", "damping_ratio": [0.6]})


def test_tunable_variables_say_so(fmus):
    variables = load_fmu(fmus / "InputShaper.fmu").variables
    for name in ("natural_frequency[1]", "damping_ratio[4]", "duration", "insensitivity"):
        assert variables[name].variability == "tunable"
    assert variables["shaper"].variability == "fixed"
