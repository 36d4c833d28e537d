"""The files for machines: C that is compiled and run, the table of impulses, and the command that writes them."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from command_line import typed

from shaper_fmu.machines import machine_settings
from shaper_fmu.machines.names import MACHINES
from shaper_fmu.tune import ModeBox, Requirements, choose

W, ZETA = 251.0, 0.05

MAIN = """
#include "TunedShaper.h"
#include <stdio.h>
int main(void) {
    static TunedShaper m;
    Fault fault;
    TunedShaper_init(&m);
    int status = TunedShaper_start(&m, 0.0, &fault);
    m.command = 1.0;
    for (int i = 0; i < 40 && !status; i++) {
        status = TunedShaper_step(&m, i * 0.001, 0.001, &fault);
        printf("%.17g %.17g\\n", m.shaped, m.shaped_mean);
    }
    return status;
}
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Free vibration of a mode, with noise of a thousandth."""
    path = tmp_path_factory.mktemp("recording") / "ring.csv"
    t = np.arange(0.0, 1.0, 1 / 3200)
    x = np.exp(-ZETA * W * t) * np.cos(W * np.sqrt(1 - ZETA**2) * t) + 1e-3 * np.random.default_rng(0).normal(size=t.size)
    np.savetxt(path, np.c_[t, x], delimiter=",", header="time,accel_x", comments="")
    return path


def test_the_c_shapes_a_step_as_the_table_of_impulses_says(tmp_path):
    choice = choose([ModeBox.around(W, ZETA, 0.08)], Requirements(kinds=("si",)), floor=False)
    for machine in ("c", "csv"):
        machine_settings(machine, choice).write(tmp_path)
    (tmp_path / "main.c").write_text(MAIN)
    files = [str(tmp_path / "main.c"), str(tmp_path / "c" / "TunedShaper.c"), f"-I{tmp_path / 'c'}"]
    for more in ([], ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]):
        subprocess.run(["gcc", "-ffp-contract=off", *more, *files, "-o", str(tmp_path / "run"), "-lm"], check=True)
    out = subprocess.run([str(tmp_path / "run")], check=True, capture_output=True, text=True).stdout
    shaped, mean = np.array([line.split() for line in out.splitlines()], float).T
    header, *rows = (tmp_path / "impulses.csv").read_text().splitlines()
    assert header == "delay [s],amplitude"
    delays, amplitudes = np.array([row.split(",") for row in rows], float).T
    assert delays.tolist() == list(choice.nearest.sequence.delays)
    ends = np.arange(1, 41) * 0.001
    np.testing.assert_allclose(shaped, [amplitudes[delays <= t + 1e-12].sum() for t in ends], rtol=0, atol=1e-15)
    shares = np.clip((ends[:, None] - delays) / 0.001, 0.0, 1.0)  # of the cycle after each impulse
    np.testing.assert_allclose(mean, shares @ amplitudes, rtol=0, atol=1e-12)


def test_tune_writes_for_machines_and_its_exit_code_tells_whether_all_hold(recording, tmp_path):
    good = typed("tune", recording, "--no-report", "--for", "klipper", "--for", "st", "--for", "csv", cwd=tmp_path)
    assert good.returncode == 0, good.stderr
    for name in ("klipper.cfg", "shaped_command.st", "impulses.csv"):
        assert f"wrote ring_tuned/{name}\n" in good.stdout
        assert (tmp_path / "ring_tuned" / name).is_file()
    assert "klipper: zvd at 39.9" in good.stdout
    assert "it leaves at most 2.09 %" in " ".join(good.stdout.split())
    bad = typed("tune", recording, "--no-report", "--for", "marlin", "--axis", "y", cwd=tmp_path)
    assert bad.returncode == 1
    assert "marlin: NOT HELD: no shaper of Marlin (standard motion) keeps the tolerance of 5 %" in " ".join(bad.stdout.split())
    assert "marlin.gcode (not held)" in bad.stdout
    text = (tmp_path / "ring_tuned" / "marlin.gcode").read_text()
    assert "M593 Y F39.8" in text
    assert "NOT HELD" in text.splitlines()[0]


def test_what_cannot_be_written_is_told_and_loses_nothing_else(recording, tmp_path):
    found = typed("tune", recording, "--no-report", "--for", "st", "--cycle", "1e-7", "--for", "csv", cwd=tmp_path)
    assert found.returncode == 1
    assert "st: a cycle of 1e-07 s keeps" in found.stderr
    assert (tmp_path / "ring_tuned" / "impulses.csv").is_file()
    assert not (tmp_path / "ring_tuned" / "shaped_command.st").exists()
    assert typed("tune", recording, "--for", "kliper", cwd=tmp_path).returncode == 2
    of_move = typed("tune", recording, "--move", "1", "--max-acceleration", "5", "--for", "klipper", cwd=tmp_path)
    assert of_move.returncode == 2
    assert "leave --move out" in " ".join(of_move.stderr.split())


def test_every_machine_has_a_part_of_the_page():
    page = (Path(__file__).parents[2] / "docs" / "machines.md").read_text(encoding="utf-8")
    for machine in MACHINES:
        assert f"`{machine}`" in page
