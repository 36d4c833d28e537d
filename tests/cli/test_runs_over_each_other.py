"""`shaper-fmu run --over FILE`: what the earlier run wrote is what is shown beside the new one."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from command_line import typed

from shaper_fmu.ssp.archive import pack_ssp


@pytest.fixture(scope="module")
def folder(fmus, tmp_path_factory) -> Path:
    """A crane, and the table of its unshaped run."""
    folder = tmp_path_factory.mktemp("over")
    pack_ssp(Path(__file__).parents[2] / "ssp" / "overhead_crane", fmus, folder / "crane.ssp", ["this"])
    done = typed("run", "crane.ssp", "--parameter-set", "unshaped", "--output", "unshaped.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_table_and_the_page(folder):
    """The swing at the end: that of the table's last row, in degrees, beside the shaped one, which is a thousandth of it."""
    done = typed("run", "crane.ssp", "--over", "without a shaper=unshaped.csv", "--report", "both.html", cwd=folder)
    assert done.returncode == 0, done.stderr
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in done.stdout.splitlines() if line.startswith("│")]
    shown = {row[0]: row[1:] for row in rows}
    with open(folder / "unshaped.csv", newline="") as stream:
        *_, last = csv.DictReader(stream)
    here, there, unit = shown["crane.swing_angle"]
    assert (float(there), unit) == (pytest.approx(float(last["crane.swing_angle"]) * 180.0 / 3.141592653589793, rel=1e-5), "deg")
    assert abs(float(here)) < 0.01 * abs(float(there))
    assert shown["profile.next_event_time"][:2] == ["never", "never"]
    page = (folder / "both.html").read_text()
    assert "crane.swing_angle, this run" in page
    assert "crane.swing_angle, without a shaper" in page
    assert len(page) < 1_000_000


def test_the_same_run_is_the_same(folder):
    given = ["run", "crane.ssp", "--parameter-set", "unshaped", "--over", "unshaped.csv"]
    done = typed(*given, cwd=folder)
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in done.stdout.splitlines() if line.startswith("│")]
    assert len(rows) > 10
    assert all(row[1] == row[2] for row in rows)


MISTAKES = {
    "--over none.csv": "none.csv: No such file or directory",
    "--over crane.ssp": "must end with .csv or .parquet",
    "--over words.csv": "no table of numbers under one line of names",
    "--over untimed.csv": "its first column is not the time",
    "--over other.csv": "other has no variable of this run: plant.position",
    "--over unshaped.csv --over unshaped.csv": "unshaped is the name of another run; write NAME=unshaped.csv",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes(line, folder):
    (folder / "words.csv").write_text("time,x\n0,one\n")
    (folder / "untimed.csv").write_text("x,y\n0,1\n")
    (folder / "other.csv").write_text("time,plant.position\n0,1\n")
    done = typed("run", "crane.ssp", *line.split(), "--until", "1", cwd=folder)
    said = " ".join(done.stderr.split())
    assert (done.returncode, MISTAKES[line] in said) == (2, True), said
