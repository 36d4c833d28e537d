"""Ring-downs of a recording with several hits are cut out by themselves, and nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recordings import driven_by, pole, ringing

from shaper_fmu.analysis.identification import free_response
from shaper_fmu.analysis.identification.ring_downs import ring_downs
from shaper_fmu.page.blocks import Figure, Text
from shaper_fmu.report.tune.evidence import recording_blocks
from shaper_fmu.tune import identify_ring_downs, requirements_for
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning_measured import tune_measured

MORE = pytest.mark.thorough
STEP = 2e-3
T = np.arange(0.0, 9.0, STEP)
HITS = ((0.5, 8.0), (3.4, 8.15), (6.2, 7.9))
"""When the stage is hit [s], and its natural frequency then [Hz]."""
NOISE = 1e-3


def noisy(x: np.ndarray, noise: float = NOISE, seed: int = 0) -> np.ndarray:
    return x + noise * np.random.default_rng(seed).standard_normal(len(x))


def hits(t: np.ndarray, ringing_of: list[tuple[float, list[tuple[float, float, float]]]]) -> np.ndarray:
    """From each time on the ringing of these modes, which ends with the next hit: the load has changed in between."""
    x = np.zeros(len(t))
    for begin, modes in ringing_of:
        x = np.where(t >= begin, ringing(t, modes, begin), x)
    return x


def three_hits() -> np.ndarray:
    return hits(T, [(begin, [(hertz, 0.02, 1.0)]) for begin, hertz in HITS])


def cut(x: np.ndarray) -> list[tuple[float, float]]:
    found = ring_downs(free_response(x[:, None], STEP, ["x"], np.zeros(1)))
    return [(one.first * STEP, one.last * STEP) for one in found]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 1e-2])
def test_each_hit_begins_a_ring_down(noise):
    """It begins within half a period of the hit, and ends before the next one, to a sample of those that are kept."""
    found = cut(noisy(three_hits(), noise))
    assert len(found) == 3
    for (begin, end), (hit, hertz), last in zip(found, HITS, (3.4, 6.2, 9.0), strict=True):
        assert hit < begin < hit + 0.5 / hertz
        assert last - 0.03 < end <= last + STEP


def test_forces_over_some_time_are_no_part_of_a_ring_down():
    """Half sines of 30 ms on two modes: each part begins after its force."""
    u = np.sum([np.where((b <= T) & (b + 0.03 > T), np.sin(np.pi * (T - b) / 0.03), 0.0) for b in (0.5, 3.5, 6.5)], axis=0)
    x = driven_by(u, T, [(8.0, 0.02, 1.0), (23.0, 0.02, 0.5)])
    found = cut(noisy(x / x.max()))
    assert len(found) == 3
    assert all(b + 0.03 < begin < b + 0.1 for (begin, _), b in zip(found, (0.5, 3.5, 6.5), strict=True))


ALONE = {
    "one": ringing(T, [(8.0, 0.005, 1.0)]),
    "one after a rest": ringing(T, [(8.0, 0.005, 1.0)], 2.0),
    "a beat": ringing(T, [(8.0, 0.01, 1.0), (8.9, 0.01, 0.9)]),
    "ten modes": ringing(
        T, [(f, 0.01, 1.0 / (k + 1)) for k, f in enumerate((1.1, 1.9, 2.8, 4.1, 5.6, 7.7, 11.0, 15.0, 22.0, 30.0))]
    ),
    "a hum": ringing(T, [(8.0, 0.01, 1.0)]) + 0.02 * np.sin(2.0 * np.pi * 50.0 * T),
    "12 bits": np.round(ringing(T, [(8.0, 0.01, 1.0)]) * 200.0) / 200.0,
    "nothing": np.zeros(len(T)),
}


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("what", ALONE)
def test_what_rings_down_once_is_not_cut(what, noise):
    """A beat of two modes rises again and again, but slowly."""
    assert cut(noisy(ALONE[what], noise)) == []


def test_the_shaper_is_for_all_ring_downs_and_the_report_shows_them():
    found = tune_measured(Table({"time": T, "x": noisy(three_hits())}), requirements=requirements_for({}, frequency_margin=0.0))
    assert found.verdict == "for_modes_found", found.summary
    assert found.choice is not None
    (box,) = found.choice.boxes
    low, high = (value / (2.0 * math.pi) for value in box.frequencies)
    assert 7.85 < low < 7.9
    assert 8.15 < high < 8.2
    assert found.candidate is not None
    sequence = found.candidate.sequence
    for _, hertz in HITS:  # V of Singer and Seering (1990)
        left = np.exp(pole(hertz, 0.02) * (sequence.delays[-1] - np.array(sequence.delays))) @ np.array(sequence.amplitudes)
        assert abs(left) <= 0.05
    assert any(one.code == "ring_downs" and "3 ring-downs were cut out" in one.text for one in found.findings)
    text, figure = recording_blocks(found.measured, ["x"])
    assert isinstance(text, Text)
    assert "3 ring-downs were cut out" in text.text
    assert isinstance(figure, Figure)
    assert [words for _, words in figure.marks] == [f"ring-down {k}" for k in (1, 2, 3)] + ["its end"] * 3


def test_what_tells_the_beginning_leaves_one_part():
    table = Table({"time": T, "x": noisy(three_hits())})
    (one,) = identify_ring_downs(table, excitation_end=6.25)
    assert [mode.frequency for mode in one.identification.modes] == pytest.approx([7.9], rel=1e-3)
    assert one.parts == ()


@MORE
def test_the_share_of_recordings_with_hits_that_are_right():
    """Two to five hits of one or two modes, 0.01 to 1 % of noise, frequencies that differ by 3 %: none that is good is wrong."""
    rng = np.random.default_rng(3)
    good, count = 0, 20
    for _ in range(count):
        hertz, number = rng.uniform(4.0, 20.0), int(rng.integers(2, 6))
        second = hertz * rng.uniform(1.8, 2.6) if rng.random() < 0.5 else 0.0
        lasting, zeta = rng.uniform(15.0, 30.0) / hertz, rng.uniform(0.01, 0.05)
        t = np.arange(0.0, lasting * (number + 0.3), 1.0 / (hertz * rng.choice([20, 40, 80])))
        made, true = [], []
        for k in range(number):
            factor = rng.uniform(0.985, 1.015)
            modes = [(hertz * factor, zeta, 1.0)] + ([(second * factor, zeta, 0.3)] if second else [])
            made.append(((k + 0.3) * lasting, modes))
            true += [(f, z) for f, z, _ in modes]
        x = hits(t, made) + 10.0 ** rng.uniform(-4.0, -2.0) * rng.standard_normal(len(t))
        found = tune_measured(Table({"time": t, "x": x}), requirements=requirements_for({}, frequency_margin=0.0))
        if found.verdict != "for_modes_found" or found.candidate is None:
            print(found.verdict, found.summary[:200])
            continue
        good += 1
        sequence = found.candidate.sequence
        left = [
            abs(np.exp(pole(f, z) * (sequence.delays[-1] - np.array(sequence.delays))) @ np.array(sequence.amplitudes))
            for f, z in true
        ]
        assert max(left[:: 2 if second else 1]) <= 0.055
    print(f"{good} of {count} good")
    assert good >= 0.7 * count
