"""Several recordings of one machine, and what was cut out of one; truth from formulas."""

from __future__ import annotations

import math

import numpy as np
from command_line import typed
from recordings import ringing

from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning_measured import tune_measured

T = np.arange(0.0, 3.0, 2e-3)


def table(modes, seed: int, noise: float = 1e-3) -> Table:
    return Table({"time": T, "x": ringing(T, modes) + noise * np.random.default_rng(seed).standard_normal(len(T))})


def test_the_ranges_are_over_all_recordings():
    """8 Hz at the left, 9 Hz and a second mode at the right: the shaper's impulses leave no more than the tolerance of all of them."""
    places = [[(8.0, 0.02, 1.0)], [(9.0, 0.03, 1.0), (31.0, 0.02, 0.2)]]
    first, *others = [table(modes, seed) for seed, modes in enumerate(places)]
    found = tune_measured(first, also=others, excitation_end=-1.0)
    assert found.verdict == "for_modes_found", found.summary
    assert found.choice is not None
    low, high = found.choice.boxes[0].frequencies
    assert low < 0.9 * 2.0 * math.pi * 8.0 * 1.001
    assert high > 1.1 * 2.0 * math.pi * 9.0 * 0.999
    assert len(found.choice.boxes) == 2
    assert found.choice.recommended is not None
    sequence = found.choice.recommended.sequence
    for modes in places:
        left = sum(g * sequence.residual_vibration(2.0 * math.pi * f, zeta) for f, zeta, g in modes) / sum(g for _, _, g in modes)
        assert left <= 0.05
    told = [one.text for one in found.findings if one.code == "recording"]
    assert len(told) == 1
    assert "8.99" in told[0]  # damped: 9 sqrt(1 - 0.03^2) Hz
    assert "30.99" in told[0]


def test_findings_of_any_recording_count():
    hummed = Table({"time": T, "x": ringing(T, [(8.0, 0.02, 1.0)]) + 0.2 * np.cos(2.0 * np.pi * 31.0 * T)})
    found = tune_measured(table([(8.0, 0.02, 1.0)], 0), also=[hummed], excitation_end=-1.0)
    assert found.verdict == "not_proven"
    assert "the table: the motion at 194.8 rad/s does not decay" in found.summary


def test_the_command_line_takes_several_files(tmp_path):
    for name, hertz in (("left", 8.0), ("right", 9.0)):
        one = table([(hertz, 0.02, 1.0)], 1)
        np.savetxt(tmp_path / f"{name}.csv", np.column_stack([one["time"], one["x"]]), delimiter=",", header="time,x", comments="")
    options = ["--excitation-end", "-0.001", "--margin", "2%"]
    done = typed("tune", "left.csv", "--also", "right.csv", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "note: right.csv: 8.99" in " ".join(done.stderr.split())
    assert "found in left.csv and right.csv" in " ".join(done.stdout.split())
    assert (tmp_path / "left_tuned" / "report.html").exists()
