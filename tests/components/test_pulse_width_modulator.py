"""The component PulseWidthModulator: crossings, means, least widths, states, compiled kernels."""

from __future__ import annotations

import itertools
import math
import random

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from hypothesis import given, settings
from hypothesis import strategies as st
from test_pulse_components import equal_records

from shaper_fmu.commands.pulse_train import PulseTrain
from shaper_fmu.commands.pulse_width_modulator import PulseWidthModulator
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.pulses import (
    carrier_pulses,
)
from shaper_fmu.errors import ComponentError

# the plant of Taskin, Kilic and Kapucu 2019
W, ZETA, RATIO = 22.9476, 0.0891, 12.0
PERIOD = 2.0 * math.pi / (W * math.sqrt(1.0 - ZETA**2))


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
    compiled = Kernels(PulseWidthModulator)
    rng = random.Random(5)
    for _ in range(20):
        frequency = rng.uniform(0.5, 40.0)
        limit = rng.choice([0.0, rng.uniform(0.0, 0.5) / frequency])
        plain = PulseWidthModulator(carrier_frequency=frequency, carrier_phase=rng.uniform(-9, 9), minimum_pulse_width=limit)
        record = record_of(plain)
        plain.initialize(0.0)
        assert compiled.start(record) == 0
        assert compiled.step(record, 0.0, 0.0) == 0
        t = 0.0
        for _ in range(100):
            plain.reference = rng.choice([0.0, 1.0, rng.uniform(-0.2, 1.2)])
            record["reference"] = plain.reference
            h = rng.choice([0.0, 0.01, 0.013, 0.05])
            plain.do_step(t, h)
            assert compiled.step(record, t, h) == 0
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
