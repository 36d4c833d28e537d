"""A step that is long for some of a sweep's runs is noted: for the shortest duration, the highest frequency, in use."""

from __future__ import annotations

from pathlib import Path

import pytest
from sweep_cases import crane_study

from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.step_lengths import sweep_step_notes
from shaper_fmu.sweep.store import Store

STUDY = """
name = "long steps"
system = "crane.ssp"
stop_time = 20.0
step = {}
[metrics.end]
kind = "final"
output = "crane.swing_angle"
"""
SMOOTH = '[compare]\na = { "profile.profile" = "cycloid" }\n'
JUMP = '[compare]\na = { "profile.profile" = "step" }\n'
BOTH = SMOOTH + 'b = { "profile.profile" = "step", "profile.duration" = 0.5 }\n'
GRID = '[vary."profile.duration"]\nlow = 4.0\nhigh = 8.0\npoints = 3\n'
LIST = '[vary."profile.duration"]\nvalues = [8.0, 4.0, 6.0]\n'
ZIP = '[plan]\nkind = "zip"\n[vary."profile.duration"]\nvalues = [4.0, 1.0, 6.0]\n[vary."profile.profile"]\nvalues = ["cycloid", "step", "cycloid"]\n'
KINDS = '[vary."profile.profile"]\nvalues = ["step", "cycloid"]\n'
OTHER = '[vary."crane.initial_rope_length"]\nvalues = [7.0, 8.0]\n'
RANGE = '[vary."crane.initial_rope_length"]\nlow = 7.0\nhigh = 8.0\n'
CASES = '[compare]\na = { "profile.profile" = "cycloid", "profile.duration" = 9.0 }\nb = { "profile.profile" = "cycloid", "profile.duration" = 4.0 }\n'
FREQUENCY = '[vary."shaper.natural_frequency[1]"]\nvalues = [1.0, 2.0]\n'


def notes(folder: Path, fmus: Path, text: str, step: float) -> list[str]:
    study = crane_study(folder, fmus, STUDY.format(step) + text)
    return list(sweep_step_notes(study, load_ssp(study.system_path).system))


@pytest.mark.parametrize(
    "text", [SMOOTH + GRID, SMOOTH + LIST, BOTH + GRID, ZIP, KINDS + GRID, KINDS + OTHER + LIST, CASES + OTHER]
)
def test_the_shortest_duration_of_a_smooth_move_counts(fmus, tmp_path, text):
    """4 s in ten steps are 0.4 s each; jumps need no steps however short they are told to be."""
    assert notes(tmp_path, fmus, text, 0.4) == []
    told = "a step of 0.5 s is long for profile.duration = 4 s: it has 8 steps, and needs 10 (0.4 s)"
    assert notes(tmp_path, fmus, text, 0.5) == [told]


def test_jumps_alone_are_never_too_short(fmus, tmp_path):
    assert notes(tmp_path, fmus, JUMP + GRID, 0.55) == []


@pytest.mark.parametrize("kind", ["random", "latin_hypercube", "sobol"])
def test_the_shortest_of_all_samples_counts(fmus, tmp_path, kind):
    text = f'[plan]\nkind = "{kind}"\nsamples = 16\n{SMOOTH}{GRID}{RANGE}'
    study = crane_study(tmp_path, fmus, STUDY.format(0.9) + text)
    shortest = min(float(point[0]) for point in study.points)
    assert any(f"profile.duration = {shortest:.6g} s: " in note for note in notes(tmp_path, fmus, text, 0.9))


def test_the_highest_frequency_counts(fmus, tmp_path):
    """2 rad/s are a period of 3.1416 s, and ten steps a period (`shaped_mean`, on the grid) are 0.31416 s."""
    assert notes(tmp_path, fmus, JUMP + FREQUENCY, 0.31) == []
    told = "a step of 0.32 s is long for shaper.natural_frequency[1] = 2 rad/s: it has 9.82 steps a period, and needs 10 (0.314 s)"
    assert notes(tmp_path, fmus, JUMP + FREQUENCY, 0.32) == [told]


def test_the_note_is_kept_with_the_sweep(fmus, tmp_path):
    study = crane_study(tmp_path, fmus, STUDY.format(0.5) + SMOOTH + LIST)
    assert run_study(study, tmp_path / "s.sqlite") == {"done": 3}
    with Store(tmp_path / "s.sqlite") as store:
        assert [n for n in store.remarks().values() if "a step of 0.5 s is long for profile.duration = 4 s" in n]
