"""PulseTrain and PulseWidthModulator: exact switches at any step size, announced; designs as of the Python functions."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of

from shaper_fmu.commands.pulse_train import SWITCHES, Design, PulseTrain
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.pulses import (
    carrier_pulses,
    minimax_pulses,
    polished_pulses,
    pulses,
    unity_magnitude_pulses,
    zv_carrier_pulses,
)
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.pulses import PULSES as METHODS
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper

# the plant of Taskin, Kilic and Kapucu 2019
W, ZETA, RATIO, START = 22.9476, 0.0891, 12.0, 0.05
PERIOD = 2.0 * math.pi / (W * math.sqrt(1.0 - ZETA**2))

DESIGNS = {
    "carrier": carrier_pulses(PERIOD / 2, W, ZETA, RATIO),
    "carrier_polished": polished_pulses(PERIOD / 2, W, ZETA, RATIO),
    "minimax": minimax_pulses(PERIOD / 2, W, ZETA),
    "um_zv": unity_magnitude_pulses("zv", W, ZETA),
    "um_zvd": unity_magnitude_pulses("zvd", W, ZETA),
    "zv_carrier": zv_carrier_pulses(W, ZETA, RATIO),
}
more = [name for name in METHODS if name not in DESIGNS]
DESIGNS |= {name: pulses(name, W, ZETA, duration=PERIOD / 2, frequency_ratio=RATIO) for name in more}
every_design = pytest.mark.parametrize("design", DESIGNS)


def train(design: str, **values) -> PulseTrain:
    values = {"duration": PERIOD / 2, "start_time": START, "amplitude": 1.0, **values}
    return PulseTrain(design=design, natural_frequency=W, damping_ratio=ZETA, frequency_ratio=RATIO, **values)


def test_the_designs_numbers_never_change():
    assert [(item.name, item.value) for item in Design][:6] == list(zip(list(DESIGNS)[:6], range(1, 7), strict=True))


@every_design
def test_calculated_parameters_are_those_of_the_sequence(design):
    instance, sequence = train(design), DESIGNS[design]
    instance.initialize(0.0)
    assert (instance.pulses, instance.switches) == (sequence.pulses, sequence.switches)
    assert instance.minimum_pulse_width == sequence.minimum_pulse_width
    assert instance.travel_time == sequence.travel_time
    assert instance.residual_vibration == pytest.approx(sequence.residual_vibration(W, ZETA), abs=1e-14)


@every_design
def test_a_master_that_follows_the_events_meets_every_switch(design):
    instance, sequence = train(design, amplitude=-2.5), DESIGNS[design]
    instance.initialize(0.0)
    assert instance.pulse == 0.0
    t, value, found = 0.0, 0.0, []
    while instance.next_event_time < NO_EVENT:
        due = instance.next_event_time
        assert due > t
        instance.do_step(t, due - t)
        t = due
        if instance.pulse != value:
            found.append(t - START)
            value = instance.pulse
        instance.do_step(t, 0.0)
        assert instance.pulse == value
    assert found == pytest.approx(sequence.switch_times, abs=1e-14)
    instance.do_step(t, START + sequence.travel_time - t)
    assert (instance.pulse, instance.reference) == (-2.5, -2.5)


@every_design
@pytest.mark.parametrize("step", [0.0013, 0.01, 0.03])
def test_fixed_steps_give_the_value_from_the_right_and_the_next_jump(design, step):
    instance, switches = train(design), np.array(DESIGNS[design].switch_times) + START
    instance.initialize(0.0)
    for i in range(round(0.3 / step)):
        instance.do_step(i * step, step)
        now = (i + 1) * step
        assert instance.pulse == np.searchsorted(switches, now + 1e-12, side="right") % 2
        later = switches[switches > now + 1e-12]
        if len(later):
            assert instance.next_event_time <= later[0]
            if design in ("carrier", "carrier_polished"):
                assert instance.next_event_time == pytest.approx(later[0], abs=1e-14)


def test_a_step_that_ends_at_a_switch_but_for_rounding_reaches_it():
    instance = train("um_zv")
    instance.initialize(0.0)
    edge = START + DESIGNS["um_zv"].switch_times[1]
    instance.do_step(0.0, edge * (1.0 - 2e-15))
    assert instance.pulse == 0.0
    assert instance.next_event_time == pytest.approx(START + DESIGNS["um_zv"].switch_times[2])


@pytest.mark.parametrize("design", ["carrier", "zv_carrier"])
def test_the_pulse_is_on_where_the_reference_is_above_the_carrier(design):
    """Taskin, Kilic and Kapucu 2019: the definition of natural sampling, on the outputs themselves."""
    instance = train(design, amplitude=3.0)
    instance.initialize(0.0)
    t = 0.0
    for step in np.random.default_rng(1).uniform(0.0, 0.001, 400):
        instance.do_step(t, step)
        t += step
        if START < t < START + PERIOD / 2:
            assert instance.pulse == 3.0 * (instance.reference > instance.carrier)
        if t < START:
            assert (instance.pulse, instance.reference) == (0.0, 0.0)
        phase = RATIO / PERIOD * (t - START) % 1
        assert instance.carrier == pytest.approx(3.0 * abs(1 - 2 * phase), abs=1e-9)
    assert t > START + PERIOD / 2
    assert (instance.pulse, instance.reference) == (3.0, 3.0)


@pytest.mark.parametrize("design", ["minimax", "um_zv", "um_zvd"])
def test_without_a_carrier_the_reference_is_a_step(design):
    instance = train(design)
    instance.initialize(0.0)
    assert (instance.reference, instance.carrier, instance.next_event_time) == (0.0, 0.0, START)
    instance.do_step(0.0, START)
    assert (instance.pulse, instance.reference, instance.carrier) == (1.0, 1.0, 0.0)


@pytest.mark.parametrize("design", ["carrier_polished", "minimax", "um_zv", "um_zvd"])
def test_the_plant_is_at_rest_after_the_command(design):
    """From switch to switch, against the plant's exact solution: no vibration remains."""
    mass = 2.0
    plant = MassSpringDamper(mass=mass, stiffness=mass * W**2, damping=2 * mass * ZETA * W)
    command = train(design, amplitude=0.1 * mass * W**2)
    plant.initialize(0.0)
    command.initialize(0.0)
    t = 0.0
    while command.next_event_time < NO_EVENT:
        h = min(command.next_event_time, START + command.travel_time) - t
        plant.force = command.pulse
        plant.do_step(t, h)
        command.do_step(t, h)
        t += h
    plant.force = command.pulse
    plant.do_step(t, START + command.travel_time - t)
    assert plant.position == pytest.approx(0.1, abs=1e-13)
    assert plant.velocity == pytest.approx(0.0, abs=1e-12)


def test_a_limit_on_the_pulse_width_is_kept_and_its_cost_shown():
    free, limited = train("carrier", duration=0.1222), train("carrier", duration=0.1222, minimum_pulse_width_limit=2e-3)
    for instance in (free, limited):
        instance.initialize(0.0)
    expected = carrier_pulses(0.1222, W, ZETA, RATIO, minimum_pulse_width=2e-3)
    assert free.minimum_pulse_width < 2e-3 <= limited.minimum_pulse_width == expected.minimum_pulse_width
    assert limited.residual_vibration == pytest.approx(expected.residual_vibration(W, ZETA), abs=1e-14)
    assert limited.residual_vibration != free.residual_vibration
    polished = train("carrier_polished", duration=0.1222, minimum_pulse_width_limit=2.2e-3)
    polished.initialize(0.0)
    assert polished.residual_vibration < 1e-12
    assert polished.minimum_pulse_width >= 2.2e-3
    single = train("um_zv", minimum_pulse_width_limit=1.0)
    single.initialize(0.0)
    assert (single.pulses, single.switches, single.minimum_pulse_width) == (1, 1, 1e300)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"frequency_ratio": 5000.0}, rf"a frequency_ratio of 5000 gives more than {SWITCHES} switches"),
        ({"design": "zv_carrier", "frequency_ratio": 5000.0}, rf"a frequency_ratio of 5000 gives more than {SWITCHES} switches"),
        (
            {"design": "carrier_polished", "frequency_ratio": 0.5, "duration": 0.3},
            "no shift of the switches leaves no vibration with frequency_ratio = 0.5, duration = 0.3 s",
        ),
        ({"design": "minimax", "duration": 3.0}, r"no five-switch command without vibration takes 3 s; .* here 0\.628\d* s"),
        ({"design": "um_zvd", "damping_ratio": 0.99}, r"no unity magnitude switch times were found for damping_ratio = 0\.99"),
        ({"duration": 0.0}, "duration = 0 s must be greater than 0 s"),
        ({"damping_ratio": 1.0}, "damping_ratio = 1 must be less than 1"),
        ({"minimum_pulse_width_limit": -1.0}, "minimum_pulse_width_limit = -1 s must be at least 0 s"),
    ],
)
def test_what_is_impossible_is_said(values, words):
    with pytest.raises(ComponentError, match=words):
        PulseTrain(**values).initialize(0.0)


def equal_records(instance, record) -> bool:
    expected = record_of(instance)
    return all(expected[field].tobytes() == record[field].tobytes() for field in expected.dtype.names or ())


@pytest.mark.thorough
def test_every_design_compiled_gives_the_same_bits():
    compiled = Kernels(PulseTrain)
    rng = random.Random(7)
    for design in list(DESIGNS) * 4:
        zeta = rng.choice([0.0, rng.uniform(0.0, 0.6)])
        values = {"natural_frequency": rng.uniform(3.0, 30.0), "damping_ratio": zeta, "frequency_ratio": rng.uniform(6.0, 30.0)}
        values["duration"] = rng.uniform(0.45, 0.95) * 2 * math.pi / values["natural_frequency"] / math.sqrt(1 - zeta**2)
        values["minimum_pulse_width_limit"] = rng.choice([0.0, 0.01 * values["duration"]])
        plain = PulseTrain(design=design, **values)
        record = record_of(plain)
        plain.initialize(0.0)
        assert compiled.start(record) == 0
        assert compiled.step(record, 0.0, 0.0) == 0
        assert equal_records(plain, record), (design, values)
        for i in range(40):
            plain.do_step(i * 0.05, 0.05)
            assert compiled.step(record, i * 0.05, 0.05) == 0
            assert equal_records(plain, record), (design, values)
