"""PulseTrain and PulseWidthModulator: exact switches at any step size, announced; designs as of the Python functions."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shaper_fmu.commands.pulse_train import SWITCHES, Design, PulseTrain
from shaper_fmu.commands.pulse_width_modulator import PulseWidthModulator
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
from shaper_fmu.export.compile import jit, record_of
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
    start, step = jit(PulseTrain, "start"), jit(PulseTrain, "step")
    rng = random.Random(7)
    for design in list(DESIGNS) * 4:
        zeta = rng.choice([0.0, rng.uniform(0.0, 0.6)])
        values = {"natural_frequency": rng.uniform(3.0, 30.0), "damping_ratio": zeta, "frequency_ratio": rng.uniform(6.0, 30.0)}
        values["duration"] = rng.uniform(0.45, 0.95) * 2 * math.pi / values["natural_frequency"] / math.sqrt(1 - zeta**2)
        values["minimum_pulse_width_limit"] = rng.choice([0.0, 0.01 * values["duration"]])
        plain = PulseTrain(design=design, **values)
        record = record_of(plain)
        plain.initialize(0.0)
        assert start(record[0]) == 0
        assert step(record[0], 0.0, 0.0) == 0
        assert equal_records(plain, record), (design, values)
        for i in range(40):
            plain.do_step(i * 0.05, 0.05)
            assert step(record[0], i * 0.05, 0.05) == 0
            assert equal_records(plain, record), (design, values)


# ---------------------------------------------------------------- PulseWidthModulator


def triangle(t, frequency, phase):
    return abs(1 - 2 * ((frequency * t + phase / (2 * math.pi)) % 1))


def followed(modulator, references, interval, end):
    """Switch times up to `end`, stepping from event to event; reference i holds over [i, i + 1] * interval."""
    modulator.reference = references[0]
    modulator.initialize(0.0)
    t, value, switches = 0.0, modulator.pulse, []
    while t < end:
        index = int((t + 1e-12) / interval)
        modulator.reference = references[index]
        modulator.do_step(t, 0.0)
        if modulator.pulse != value:
            switches.append(t)
            value = modulator.pulse
        until = min((index + 1) * interval, modulator.next_event_time)
        assert until > t
        modulator.do_step(t, until - t)
        t = until
        if modulator.pulse != value:
            switches.append(t)
            value = modulator.pulse
    return switches


@pytest.mark.parametrize("phase", [0.0, 0.7, -3.0, 11.0])
@pytest.mark.parametrize("reference", [0.1, 0.5, 0.93])
def test_switches_of_a_held_reference_are_the_crossings(reference, phase):
    """The triangle's crossings in closed form: pulses centred where the carrier is 0, `reference` of a period wide."""
    modulator = PulseWidthModulator(carrier_frequency=4.0, carrier_phase=phase)
    switches = followed(modulator, [reference] * 40, 0.1, 3.0)
    inner = np.array(switches)[1:-1]
    assert len(inner) >= 20
    assert triangle(inner, 4.0, phase) == pytest.approx(np.full(len(inner), reference), abs=1e-12)
    widths = np.diff(inner)
    assert sorted({round(w, 9) for w in widths}) == pytest.approx(sorted({reference / 4, round((1 - reference) / 4, 9)}), abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-0.2, 1.2), min_size=20, max_size=20),
    st.floats(0.5, 30.0),
    st.floats(-7.0, 7.0),
    st.floats(0.01, 0.2),
)
def test_output_mean_and_event_at_fixed_steps_are_those_of_the_definition(references, frequency, phase, step):
    """pulse = 1 where the held reference is above the carrier; its mean by fine sampling of that definition."""
    modulator = PulseWidthModulator(carrier_frequency=frequency, carrier_phase=phase, reference=references[0])
    modulator.initialize(0.0)
    for i, reference in enumerate(references):
        modulator.reference = reference
        modulator.do_step(i * step, step)
        end = (i + 1) * step
        gap = reference - triangle(end, frequency, phase)
        if abs(gap) > 1e-6:
            assert modulator.pulse == (gap > 0.0)
        samples = i * step + step * (np.arange(2000) + 0.5) / 2000
        mean = np.mean(reference > triangle(samples, frequency, phase))
        assert modulator.pulse_mean == pytest.approx(mean, abs=(2 * step * frequency + 3) / 1000)
        if 1e-6 < reference < 1 - 1e-6:
            due = modulator.next_event_time
            assert end < due <= end + 1.0 / frequency + 1e-9
            assert triangle(due, frequency, phase) == pytest.approx(reference, abs=1e-9)
        elif not 0.0 < reference < 1.0:
            assert modulator.next_event_time == NO_EVENT


def test_the_mean_is_the_reference_over_whole_periods():
    modulator = PulseWidthModulator(carrier_frequency=20.0, carrier_phase=0.4, reference=0.37)
    modulator.initialize(0.0)
    for i in range(5):
        modulator.do_step(0.15 * i, 0.15)
        assert modulator.pulse_mean == pytest.approx(0.37, abs=1e-12)


def test_the_mean_survives_a_step_of_length_zero():
    modulator = PulseWidthModulator(reference=0.3)
    modulator.initialize(0.0)
    modulator.do_step(0.0, 0.01)
    before = modulator.pulse_mean
    modulator.do_step(0.01, 0.0)
    assert modulator.pulse_mean == before


def test_the_outputs_do_not_depend_on_the_steps():
    """One step of 1 s, 100 of 10 ms, and 1000 of random lengths with repeats of zero end alike."""
    ends = []
    rng = np.random.default_rng(3)
    cuts = np.sort(np.append(rng.uniform(0.0, 1.0, 998), [0.0, 1.0]))
    for grid in (np.array([0.0, 1.0]), np.linspace(0.0, 1.0, 101), cuts, np.repeat(cuts, 2)):
        modulator = PulseWidthModulator(carrier_frequency=7.3, reference=0.61)
        modulator.initialize(0.0)
        on_time = 0.0
        for a, b in itertools.pairwise(grid.tolist()):
            modulator.do_step(a, b - a)
            on_time += (b - a) * modulator.pulse_mean
        ends.append((modulator.pulse, modulator.next_event_time, on_time))
    assert len({end[0] for end in ends}) == 1
    assert [end[1] for end in ends] == pytest.approx([ends[0][1]] * 4, abs=1e-12)
    assert [end[2] for end in ends] == pytest.approx([ends[0][2]] * 4, abs=1e-12)


def test_modulating_the_papers_profile_in_fine_steps_gives_the_papers_pulses():
    """Held at the middle of steps of 10 us, the profile of Taskin, Kilic and Kapucu 2019 gives the edges of q = 12."""
    command = PulseTrain(design="carrier", duration=PERIOD / 2, natural_frequency=W, damping_ratio=ZETA, frequency_ratio=RATIO)
    modulator = PulseWidthModulator(carrier_frequency=RATIO / PERIOD)
    command.initialize(0.0)
    modulator.initialize(0.0)
    step, switches, value = 1e-5, [], 0.0
    for i in range(12500):
        command.do_step((i - 0.5) * step if i else 0.0, step if i else 0.5 * step)
        modulator.reference = command.reference
        modulator.do_step(i * step, step)
        if modulator.pulse != value:
            value = modulator.pulse
            switches.append(i * step + (1.0 - modulator.pulse_mean if value else modulator.pulse_mean) * step)
    assert switches == pytest.approx(carrier_pulses(PERIOD / 2, W, ZETA, RATIO).switch_times, abs=1e-5)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.one_of(st.floats(-0.1, 1.1), st.sampled_from([0.0, 1.0])), min_size=80, max_size=80),
    st.floats(0.02, 0.1),
    st.floats(0.0, 0.49),
)
def test_no_pulse_or_gap_is_shorter_than_the_limit(references, interval, share):
    limit = share / 5.0
    modulator = PulseWidthModulator(carrier_frequency=5.0, minimum_pulse_width=limit)
    switches = followed(modulator, references, interval, 70 * interval)
    assert np.all(np.diff(switches) >= limit - 1e-9)


def test_shares_that_are_too_narrow_are_off_or_on():
    for reference, pulse in ((0.04, 0.0), (0.06, None), (0.94, None), (0.96, 1.0)):
        modulator = PulseWidthModulator(carrier_frequency=5.0, minimum_pulse_width=0.01, reference=reference)
        modulator.initialize(0.0)
        modulator.do_step(0.0, 1.0)
        if pulse is None:
            assert modulator.pulse_mean == pytest.approx(reference)
            assert modulator.next_event_time < NO_EVENT
        else:
            assert (modulator.pulse_mean, modulator.next_event_time) == (pulse, NO_EVENT)


def test_a_switch_waits_for_the_limit_and_is_announced():
    modulator = PulseWidthModulator(carrier_frequency=1.0, minimum_pulse_width=0.2, reference=0.5)
    modulator.initialize(0.0)
    modulator.do_step(0.0, 0.3)  # on since 0.25 s
    assert (modulator.pulse, modulator.next_event_time) == (1.0, 0.75)
    modulator.reference = 0.0
    modulator.do_step(0.3, 0.0)
    assert (modulator.pulse, modulator.next_event_time) == (1.0, pytest.approx(0.45))
    modulator.do_step(0.3, 0.3)
    assert (modulator.pulse, modulator.next_event_time) == (0.0, NO_EVENT)
    assert modulator.pulse_mean == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"carrier_frequency": 10.0, "minimum_pulse_width": 0.06}, r"minimum_pulse_width = 0\.06 s must be at most half a period"),
        ({"carrier_frequency": 0.0}, "carrier_frequency = 0 Hz must be greater than 0 Hz"),
        ({"minimum_pulse_width": -0.1}, "minimum_pulse_width = -0.1 s must be at least 0 s"),
        ({"reference": math.nan}, "reference is nan; it must be a finite number"),
    ],
)
def test_impossible_modulation_is_refused(values, words):
    with pytest.raises(ComponentError, match=words):
        PulseWidthModulator(**values).initialize(0.0)


def test_a_step_over_too_many_periods_is_refused():
    modulator = PulseWidthModulator(carrier_frequency=1e6)
    modulator.initialize(0.0)
    with pytest.raises(ComponentError, match=r"spans more than 100000 periods of the carrier_frequency 1000000 Hz"):
        modulator.do_step(0.0, 1.0)


def test_a_saved_state_replays():
    modulator = PulseWidthModulator(carrier_frequency=3.0, minimum_pulse_width=0.05, reference=0.4)
    modulator.initialize(0.0)
    modulator.do_step(0.0, 0.21)
    state, rows = modulator.get_state(), []
    for _ in range(2):
        modulator.set_state(state)
        for i in range(20):
            modulator.reference = 0.1 * (i % 9)
            modulator.do_step(0.21 + 0.05 * i, 0.05)
            rows.append((modulator.pulse, modulator.pulse_mean, modulator.next_event_time))
    assert rows[:20] == rows[20:]


def test_the_modulator_compiled_gives_the_same_bits():
    start, step = jit(PulseWidthModulator, "start"), jit(PulseWidthModulator, "step")
    rng = random.Random(5)
    for _ in range(20):
        frequency = rng.uniform(0.5, 40.0)
        limit = rng.choice([0.0, rng.uniform(0.0, 0.5) / frequency])
        plain = PulseWidthModulator(carrier_frequency=frequency, carrier_phase=rng.uniform(-9, 9), minimum_pulse_width=limit)
        record = record_of(plain)
        plain.initialize(0.0)
        assert start(record[0]) == 0
        assert step(record[0], 0.0, 0.0) == 0
        t = 0.0
        for _ in range(100):
            plain.reference = rng.choice([0.0, 1.0, rng.uniform(-0.2, 1.2)])
            record["reference"] = plain.reference
            h = rng.choice([0.0, 0.01, 0.013, 0.05])
            plain.do_step(t, h)
            assert step(record[0], t, h) == 0
            assert equal_records(plain, record)
            t += h


@pytest.mark.parametrize("step", [0.0007, 0.011, 0.5])
def test_pulse_mean_adds_up_to_the_time_that_the_command_was_on(step):
    """Sum of mean * step = sum of the on-times between the designed switches, up to the end of the run."""
    train = PulseTrain(
        design="carrier", duration=0.1374496, natural_frequency=W, damping_ratio=ZETA, frequency_ratio=12.0, start_time=0.013
    )
    train.initialize()
    end, total, i = 0.2, 0.0, 0
    while i * step < end - 1e-12:
        h = min(step, end - i * step)
        train.do_step(i * step, h)
        assert 0.0 <= train.pulse_mean <= 1.0
        total += h * train.pulse_mean
        i += 1
    switches = [0.013 + t for t in train.switch_time[: train.switches]] + [end]
    assert total == pytest.approx(sum(switches[k + 1] - switches[k] for k in range(0, len(switches) - 1, 2)), abs=1e-14)
