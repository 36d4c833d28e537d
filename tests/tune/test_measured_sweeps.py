"""Swept excitations that were not recorded: resonance tests of 3D printers as Klipper makes them (a square wave of acceleration, half a
period of each frequency), continuous sweeps; the truth is known, its exact motion from matrix exponentials or scipy's lsim."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from command_line import typed
from printers import record_of, write_record
from recordings import driven_by, swept

from shaper_fmu.analysis.identification import CONTRADICTING, IdentificationError, free_response
from shaper_fmu.analysis.identification.sweep_result import identify_swept
from shaper_fmu.analysis.identification.swept import Sweep
from shaper_fmu.machines.settings import FIRMWARE
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning_measured import tune_axes, tune_measured

QUICK = {"rate": 2.0, "high": 100.0, "sampling": 800.0, "noise": 10.0}
"""Options of a short record: 47 s."""
LEAST = 2e-4
"""Errors of this share are of the record's making: its harmonics, and accelerations that are held over a sample."""


def table(modes, seed: int = 0, **options: float) -> Table:
    t, x = record_of(modes, seed=seed, **{**QUICK, **options})
    rng = np.random.default_rng(seed + 1)
    y, z = (0.02 * x + 30.0 * rng.standard_normal(len(t)) for _ in range(2))
    return Table({"time": t, "accel_x": x + 120.0, "accel_y": y, "accel_z": z + 9806.65})


def assert_modes(found, modes) -> None:
    assert len(found.modes) == len(modes)
    total = sum(g / math.sqrt(1.0 - zeta * zeta) for _, zeta, g in modes)
    for mode, (hertz, zeta, g) in zip(found.modes, modes, strict=True):
        assert abs(mode.natural_frequency / (2.0 * math.pi * hertz) - 1.0) < 5.0 * mode.natural_frequency_std / 300.0 + LEAST
        assert abs(mode.damping_ratio - zeta) < 5.0 * mode.damping_ratio_std + 0.01 * zeta
        # after a unit step of the acceleration: g / sqrt(1 - zeta^2) of it
        assert mode.share == pytest.approx(g / math.sqrt(1.0 - zeta * zeta) / total, abs=0.02)


def test_a_resonance_test():
    modes = [(38.0, 0.05, 0.6), (71.0, 0.03, 0.15)]
    found = identify_measured(table(modes))
    assert_modes(found.identification, modes)
    assert found.outputs == ("accel_x",)
    assert found.law is not None
    assert found.law.stepped
    assert found.law.growing
    assert found.law.rate == pytest.approx(2.0, rel=1e-3)
    assert not {one.code for one in found.findings} & set(CONTRADICTING)
    assert "accel_x moves most along the sweep" in next(one.text for one in found.findings if one.code == "driven")
    assert "each frequency for half a period" in next(one.text for one in found.findings if one.code == "sweep")


def test_a_continuous_sweep_of_one_mode_has_one_mode():
    """As a ring-down it had six."""
    t = np.arange(0.0, 12.0, 2e-3)
    x = driven_by(swept(t, 5.0, 100.0), t, [(40.0, 0.03, 1.0)]) + 1e-2 * np.random.default_rng(0).standard_normal(len(t))
    found = tune_measured(Table({"time": t, "x": x}))
    assert found.verdict == "for_modes_found", found.summary
    assert found.measured is not None
    assert_modes(found.measured.identification, [(40.0, 0.03, 1.0)])
    assert found.measured.law is not None
    assert not found.measured.law.stepped
    assert not found.measured.law.growing


@pytest.mark.thorough
def test_a_line_is_no_mode():
    modes = [(45.0, 0.06, 0.7)]
    t, x = record_of(modes, noise=10.0, rate=2.0, high=100.0, sampling=800.0)
    found = identify_measured(Table({"time": t, "accel_y": x + 300.0 * np.cos(2.0 * np.pi * 60.0 * t)}))
    assert_modes(found.identification, modes)
    assert "lines at 59.99" in next(one.text for one in found.findings if one.code == "hum")


def test_a_sweep_that_is_too_narrow_is_refused():
    t, x = record_of([(20.0, 0.05, 0.5)], low=15.0, high=26.0, rate=2.0, sampling=400.0)
    with pytest.raises(IdentificationError, match=r"the sweep from .* is too narrow; sweep over .* at least, or more slowly"):
        identify_swept(free_response(x, float(t[1] - t[0])), Sweep(0.3, 5.8, 15.0, 26.0))


@pytest.mark.thorough
def test_an_axis_each(tmp_path):
    """Files of x and y as Klipper writes them: a shaper each, whose impulses by Klipper's definition keep the tolerance on the truth."""
    truth = {"x": [(52.0, 0.06, 0.6), (88.0, 0.04, 0.02)], "y": [(38.0, 0.07, 0.7)]}
    for seed, (axis, modes) in enumerate(truth.items()):
        write_record(tmp_path / f"raw_{axis}.csv", modes, axis, seed, **{**QUICK, "sampling": 1600.0})
    options = ["--for", "klipper", "--margin", "2%", "--nominal", "5%", "--no-report"]
    done = typed("tune", "raw_x.csv", "--also", "raw_y.csv", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "axis x (raw_x.csv):" in done.stdout
    assert "axis y (raw_y.csv):" in done.stdout
    numbers = json.loads((tmp_path / "raw_x_tuned" / "y" / "tuning.json").read_text())
    assert numbers["modes"][0]["natural_frequency"] == pytest.approx(2.0 * math.pi * 38.0, rel=1e-3)
    assert numbers["measured"]["sweep"]["rate"] == pytest.approx(2.0, rel=1e-3)
    text = (tmp_path / "raw_x_tuned" / "klipper.cfg").read_text()
    assert text.count("\n[input_shaper]") == 1
    values = dict(line.split(": ", 1) for line in text.splitlines() if ": " in line and not line.startswith("#"))
    assert len(values) == 6
    for axis, modes in truth.items():
        shaper = FIRMWARE["klipper"].shapers[values[f"shaper_type_{axis}"]]
        sequence = shaper(float(values[f"shaper_freq_{axis}"]), float(values[f"damping_ratio_{axis}"]))
        left = sum(g * sequence.residual_vibration(2.0 * math.pi * f, zeta) for f, zeta, g in modes)
        assert left / sum(g for *_, g in modes) < 0.05


@pytest.mark.thorough
def test_recordings_of_one_axis_are_taken_together():
    places = [table([(hertz, 0.05, 0.6)], seed) for seed, hertz in enumerate((40.0, 44.0))]
    found = tune_axes(places[0], also=[places[1]])
    assert list(found) == ["x"]
    assert found["x"].choice is not None
    low, high = found["x"].choice.boxes[0].frequencies
    assert low < 0.9 * 2.0 * math.pi * 40.0 * 1.001
    assert high > 1.1 * 2.0 * math.pi * 44.0 * 0.999
