"""Swept-sine tests and other commands with their responses: modes, their uncertainty, hum, and what is said; truth from scipy's lsim."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from command_line import typed
from recordings import driven_by, swept

from shaper_fmu.analysis.identification import CONTRADICTING, IdentificationError
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning_measured import tune_measured

STEP = 1.0 / 500.0
T = np.arange(0.0, 12.0, STEP)
TWO = [(25.0, 0.02, 1.0), (40.0, 0.03, 0.5)]


def recorded(u: np.ndarray, modes, noise: float, hum: float = 0.0, seed: int = 0) -> Table:
    x = driven_by(u, T, modes)
    x += noise * np.abs(x).max() * np.random.default_rng(seed).standard_normal(len(T)) + hum * np.cos(2.0 * np.pi * 50.0 * T + 1.0)
    return Table({"time": T, "cmd": u, "x": x})


def assert_modes(found, modes, deviations: float = 4.5) -> None:
    assert len(found.modes) == len(modes)
    for mode, (hertz, zeta, gain) in zip(found.modes, modes, strict=True):
        assert abs(mode.natural_frequency - 2.0 * math.pi * hertz) < deviations * mode.natural_frequency_std + 1e-4 * hertz
        assert abs(mode.damping_ratio - zeta) < deviations * mode.damping_ratio_std + 1e-4
        # of the response to a unit step: gain / sqrt(1 - zeta^2)
        assert abs(mode.residues[0, 0]) == pytest.approx(gain / math.sqrt(1.0 - zeta * zeta), rel=0.05)


@pytest.mark.parametrize("noise", [1e-3, 2e-2])
@pytest.mark.parametrize("method", ["linear", "logarithmic"])
def test_a_swept_sine_test(noise, method):
    found = identify_measured(recorded(swept(T, 5.0, 100.0, method), TWO, noise), command="cmd")
    assert_modes(found.identification, TWO)
    assert found.forced is not None
    assert found.forced.band == (pytest.approx(5.0, abs=3.0), pytest.approx(100.0, rel=0.15))
    assert not {one.code for one in found.findings} & set(CONTRADICTING)


def test_one_mode_is_one():
    """The recording that had six modes as a ring-down."""
    found = tune_measured(recorded(swept(T, 5.0, 100.0), [(40.0, 0.03, 1.0)], 1e-2), command="cmd")
    assert found.verdict == "for_modes_found", found.summary
    assert found.measured is not None
    assert_modes(found.measured.identification, [(40.0, 0.03, 1.0)])
    assert "This holds for the modes found in the table between " in found.summary
    assert "the command excites from" in next(one.text for one in found.findings if one.code == "band")


def test_a_hum_is_not_excited_by_the_command():
    found = identify_measured(recorded(swept(T, 5.0, 100.0), TWO, 1e-3, hum=0.05), command="cmd")
    assert_modes(found.identification, TWO)
    assert [one.kind for one in found.identification.others] == ["line"]
    assert "lines at 50" in next(one.text for one in found.findings if one.code == "hum")


def test_a_random_command():
    rng = np.random.default_rng(4)
    found = identify_measured(recorded(rng.standard_normal(len(T)), TWO, 1e-2), command="cmd")
    assert_modes(found.identification, TWO)


def test_the_command_line(tmp_path):
    table = recorded(swept(T, 5.0, 100.0), [(40.0, 0.03, 1.0)], 5e-3)
    np.savetxt(
        tmp_path / "sweep.csv", np.column_stack([table[n] for n in table.names]), delimiter=",", header="time,cmd,x", comments=""
    )
    done = typed("tune", "sweep.csv", "--command", "cmd", "--kind", "zvd", "--kind", "mzv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "for modes found: " in done.stdout
    numbers = json.loads((tmp_path / "sweep_tuned" / "tuning.json").read_text())
    assert numbers["measured"]["excited_band"][1] == pytest.approx(100.0, rel=0.15)
    assert numbers["modes"][0]["natural_frequency"] == pytest.approx(2.0 * math.pi * 40.0, rel=1e-3)
    wrong = typed("tune", "sweep.csv", "--command", "cmf", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "Did you mean 'cmd'?" in " ".join(wrong.stderr.split())


def test_what_makes_no_sense_is_refused():
    table = recorded(swept(T, 5.0, 100.0), TWO, 1e-3)
    with pytest.raises(IdentificationError, match="give neither input nor excitation_end"):
        identify_measured(table, command="cmd", excitation_end=1.0)
    with pytest.raises(IdentificationError, match="the command does not change"):
        identify_measured(Table({"time": T, "cmd": np.ones(len(T)), "x": table["x"]}), command="cmd")
    with pytest.raises(IdentificationError, match="--command"):
        identify_measured(table, input="cmd")
