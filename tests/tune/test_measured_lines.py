"""What is no free vibration in a recording: a swept excitation, a hum, lines that were there before; their truth is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from recordings import driven_by, pole, ringing, swept

from shaper_fmu.analysis.identification import CONTRADICTING, IdentificationError, free_response
from shaper_fmu.analysis.identification.swept import find_sweep
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning_measured import tune_measured


@pytest.mark.parametrize(("method", "given"), [("linear", True), ("logarithmic", True), ("logarithmic", False)])
def test_a_swept_recording_is_no_ring_down(method, given):
    """One mode of 40 Hz, a sine from 5 to 100 Hz: modes were found in it, six of them.

    A linear sweep without an end that was given has one mode (tests/tune/test_measured_sweeps.py).
    """
    t = np.arange(0.0, 10.0, 1e-3)
    x = driven_by(swept(t, 5.0, 100.0, method), t, [(40.0, 0.03, 1.0)])
    x += 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    end = -1.0 if given else None
    with pytest.raises(IdentificationError, match=r"this is no free response: from .* the motion sweeps from .* Give the column"):
        tune_measured(Table({"time": t, "x": x}), excitation_end=end)


def test_what_is_behind_a_sweep_is_looked_at():
    t = np.arange(0.0, 8.0, 1e-3)
    u = np.where(t < 6.0, swept(np.minimum(t, 6.0), 5.0, 100.0), 0.0)
    x = driven_by(u, t, [(12.0, 0.01, 1.0)]) + 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    found = identify_measured(Table({"time": t, "x": x}))
    assert found.excitation_end >= 5.9
    (mode,) = found.identification.modes
    assert mode.natural_frequency == pytest.approx(abs(pole(12.0, 0.01)), rel=1e-3)


def test_ring_downs_are_no_sweeps():
    """Of one to four modes, noisy, of stiffening springs, and noise alone."""
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 6.0, 2e-3)
    for _ in range(60):
        modes = [(rng.uniform(2.0, 60.0), rng.uniform(0.002, 0.05), rng.uniform(0.2, 1.0)) for _ in range(rng.integers(1, 5))]
        x = ringing(t, modes) + rng.choice([0.0, 1e-3, 3e-2]) * rng.standard_normal(len(t))
        assert find_sweep(free_response(x, 2e-3)) is None, modes
    softening = np.exp(-0.5 * t) * np.cos(2.0 * np.pi * (8.0 * t - 1.0 * np.exp(-t)))
    assert find_sweep(free_response(softening, 2e-3)) is None
    assert find_sweep(free_response(rng.standard_normal(len(t)), 2e-3)) is None
    found = find_sweep(free_response(swept(t, 80.0, 4.0), 2e-3))
    assert found is not None
    assert (found.first, found.last) == (pytest.approx(80.0, abs=6.0), pytest.approx(4.0, abs=6.0))


@pytest.mark.parametrize("hertz", [50.0, 60.0, 150.0])
@pytest.mark.parametrize("rest", [0.0, 1.0])
def test_a_hum_is_no_mode(hertz, rest):
    """A tenth of the ringing: it is excluded, told, and the mode beside it is found as it is."""
    t = np.arange(0.0, 3.0 + rest, 1e-3)
    x = ringing(t, [(8.0, 0.02, 1.0)], rest) + 0.1 * np.cos(2.0 * np.pi * hertz * t + 1.0)
    x += 1e-3 * np.random.default_rng(3).standard_normal(len(t))
    found = tune_measured(Table({"time": t, "x": x}), excitation_end=rest - 1e-4)
    assert found.verdict == "for_modes_found", found.summary
    assert found.measured is not None
    (mode,) = found.measured.identification.modes
    assert mode.natural_frequency == pytest.approx(abs(pole(8.0, 0.02)), abs=4.0 * mode.natural_frequency_std)
    assert mode.share == 1.0
    (line,) = [one for one in found.measured.identification.others if one.kind == "line"]
    assert line.pole.imag == pytest.approx(2.0 * math.pi * hertz, rel=1e-4)
    (told,) = [one.text for one in found.findings if one.code == "hum"]
    assert ("the same before the excitation" if rest else "by its frequency") in told


def test_a_line_at_any_frequency_is_known_by_what_was_before():
    """A line of 31 Hz goes on through the excitation; an undamped mode of 31 Hz begins with it."""
    t = np.arange(0.0, 4.0, 1e-3)
    noise = 1e-3 * np.random.default_rng(4).standard_normal(len(t))
    mode = ringing(t, [(8.0, 0.02, 1.0)], 1.0)
    lined = Table({"time": t, "x": mode + 0.2 * np.cos(2.0 * np.pi * 31.0 * t) + noise})
    found = identify_measured(lined, excitation_end=1.0)
    assert [round(one.frequency) for one in found.identification.modes] == [8]
    assert "hum" in [one.code for one in found.findings]
    undamped = identify_measured(Table({"time": t, "x": mode + ringing(t, [(31.0, 0.0, 0.2)], 1.0) + noise}), excitation_end=1.0)
    assert [round(one.frequency) for one in undamped.identification.modes] == [8, 31]
    codes = {one.code for one in undamped.findings}
    assert "undamped" in codes
    assert not codes & set(CONTRADICTING)


def test_a_line_of_which_nothing_is_known_is_excluded_and_contradicts():
    t = np.arange(0.0, 3.0, 1e-3)
    x = (
        ringing(t, [(8.0, 0.02, 1.0)])
        + 0.2 * np.cos(2.0 * np.pi * 31.0 * t)
        + 1e-3 * np.random.default_rng(5).standard_normal(len(t))
    )
    found = tune_measured(Table({"time": t, "x": x}), excitation_end=-1.0)
    assert found.verdict == "not_proven"
    assert found.measured is not None
    assert [round(one.frequency) for one in found.measured.identification.modes] == [8]
    assert "that no shaper changes; it was excluded" in found.summary
