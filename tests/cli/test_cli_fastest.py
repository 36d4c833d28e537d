"""The command `design fastest`, and the floor of moves beside the other profiles."""

from __future__ import annotations

import csv
import json

import pytest
from command_line import typed

from shaper_fmu.design.fastest import fastest_move

LIMITS = ("--max-velocity", "1", "--max-acceleration", "3")


def test_the_segments_and_the_proof_are_printed_and_written(tmp_path):
    done = typed("design", "fastest", "-w", "5", *LIMITS, "--segments", "move.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    move = fastest_move(1.0, max_velocity=1.0, max_acceleration=3.0, modes=[5.0])
    assert f"{move.lower_bound:.9g} s" in done.stdout
    assert f"{move.duration:.9g} s" in done.stdout
    _, *rows = csv.reader((tmp_path / "move.csv").read_text().splitlines())
    assert [float(row[0]) for row in rows] == list(move.switch_times[:-1])
    assert [float(row[4]) for row in rows] == list(move.controls)


def test_several_modes_a_band_and_a_jerk_limit_as_json(tmp_path):
    options = ("-w", "14", "-z", "0.02", "--low", "4.9", "--high", "5.1", "--tolerance", "0.05", "--max-jerk", "60")
    done = typed("design", "fastest", *options, *LIMITS, "--segments", "move.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    read = json.loads((tmp_path / "move.json").read_text())
    assert [(one["low"], one["high"], one["tolerance"]) for one in read["modes"]] == [(14.0, 14.0, 0.05), (4.9, 5.1, 0.05)]
    assert all(one["residual"] <= 0.05 for one in read["modes"])
    assert read["duration"] <= 1.005 * read["lower_bound"]
    assert max(abs(one["jerk"]) for one in read["segments"]) <= 60.0


def test_a_limit_of_the_deflection_is_kept_and_told(tmp_path):
    """The acceleration that holds 0.144 m at 5 rad/s is 3.6 m/s2, beyond the limit: an on/off command without pulses."""
    options = ("-w", "5", "--deflection-limit", "0.144", "--on-off-pulses", "2")
    done = typed("design", "fastest", *options, *LIMITS, "--segments", "move.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "peak deflection [m]" in " ".join(done.stdout.split())
    read = json.loads((tmp_path / "move.json").read_text())
    assert read["modes"][0]["deflection_limit"] == 0.144
    assert abs(read["modes"][0]["peak_deflection"] - 0.144) < 1e-9
    assert {round(abs(one["acceleration"]), 9) for one in read["segments"]} == {0.0, 3.0}


def test_a_profile_tells_how_far_it_is_above_the_floor_with_every_shaper(tmp_path):
    """By the fastest move with 5 %: 1.42875 s, which no move is shorter than; the trapezoid's 4/3 s and the half period of ZV."""
    done = typed("design", "trapezoid", "-w", "5", *LIMITS, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    bound = fastest_move(1.0, max_velocity=1.0, max_acceleration=3.0, modes=[5.0], tolerance=0.05).lower_bound
    assert "Floor of moves" in done.stdout
    zv = next(line for line in done.stdout.splitlines() if " zv " in line)
    assert f"{(4.0 / 3.0 + 3.14159265 / 5.0) / bound - 1.0:.1%}"[:-1] in zv
    alone = next(line for line in done.stdout.splitlines() if " none " in line and "leaves" in line)
    assert "21.3 %" in alone


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fastest", "-w", "5", "--max-velocity", "1"), "--max-acceleration"),
        (("fastest", *LIMITS), "--natural-frequency"),
        (("fastest", "-w", "5", "--duration", "2", *LIMITS), "--duration"),
        (("fastest", "-w", "5", "--low", "4", *LIMITS), "--high"),
        (("fastest", "-w", "5", "--damping-range", "0", "0.1", *LIMITS), "--damping-range"),
        (("fastest", "-w", "5", "-w", "6", "-w", "7", "-z", "0", "-z", "0.1", *LIMITS), "--damping-ratio"),
        (("fastest", "--low", "4", "--high", "5", *LIMITS), "tolerance"),
        (("fastest", "--low", "4", "--high", "5", "--deflection-limit", "0.1", *LIMITS), "--deflection-limit"),
        (("fastest", "-w", "5", "--deflection-limit", "0.1", "--deflection-limit", "0.2", *LIMITS), "--deflection-limit"),
        (("fastest", "-w", "5", "--on-off-pulses", "2", *LIMITS), "--on-off-pulses"),
        (("trapezoid", "-w", "5", "--deflection-limit", "0.1", *LIMITS), "--deflection-limit"),
        (("fastest", "-w", "5", "--segments", "move.txt", *LIMITS), "csv"),
        (("cycloid", "-w", "5", "--duration", "2", "--max-jerk", "3"), "--max-jerk"),
        (("zv", "-w", "5", "--segments", "move.csv"), "--segments"),
    ],
)
def test_wrong_usage_names_the_option(arguments, words, tmp_path):
    done = typed("design", *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert words in done.stderr
