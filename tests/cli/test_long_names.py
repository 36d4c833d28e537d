"""Names and paths of 200 letters stay whole in what each command prints into a pipe, whatever width the environment tells."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import GAIN
from test_cli_sweep import STUDY

from shaper_fmu import System
from shaper_fmu.export.model_description import visible_variables
from shaper_fmu.registry import components
from shaper_fmu.ssp.archive import pack_ssp

MAIN = "from shaper_fmu.cli.main import main; main()"
LONG = "long_" * 40
CRANE = Path(__file__).parents[2] / "ssp" / "overhead_crane"


def said(*arguments: str | Path, cwd: Path, code: int = 0) -> str:
    """What a command prints into pipes."""
    environment = {**os.environ, "COLUMNS": "40"}
    words = [sys.executable, "-c", MAIN, *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", cwd=cwd, env=environment, timeout=900)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def workshop(fmus, tmp_path_factory) -> Path:
    """A system, a study, a step response and a component, with long names."""
    folder = tmp_path_factory.mktemp("long")
    system = System()
    system.add(LONG, fmus / "MassSpringDamper.fmu")
    system.to_ssp(folder / f"{LONG}.ssp", stop_time=0.1, step=0.01)
    pack_ssp(CRANE, fmus, folder / "crane.ssp")
    study = STUDY.replace("points = 5", "points = 2").replace("ZV = ", f"{LONG}ZV = ")
    (folder / f"{LONG}.toml").write_text(study)
    (folder / "modes.toml").write_text(
        f'outputs = ["{LONG}"]\nfinal = [1.0]\n'
        "[[modes]]\nnatural_frequency = 5.0\ndamping_ratio = 0.05\nresidue = [[-0.5, 0.0]]\n"
        "[[modes]]\nnatural_frequency = 20.0\ndamping_ratio = 0.05\nresidue = [[-0.1, 0.0]]\n"
    )
    (folder / f"{LONG}.py").write_text(GAIN.format(factor=2))
    (folder / LONG).mkdir()
    (folder / f"{LONG}.txt").write_text("no archive")
    return folder


def test_list(workshop):
    text = said("list", *components(), cwd=workshop)
    for component in components().values():
        for variable in visible_variables(component):
            assert f" {variable.description} " in text


def test_run(workshop):
    text = said("run", f"{LONG}.ssp", "--output", f"{LONG}.csv", cwd=workshop)
    assert re.search(rf"^│ {LONG}.position +│", text, re.MULTILINE)
    assert f"wrote {LONG}.csv" in text


@pytest.mark.thorough
def test_check(workshop):
    text = said("check", f"{LONG}.txt", f"{LONG}.ssp", cwd=workshop, code=1)
    assert text.startswith(f"{LONG}.txt: ")
    assert len(text.splitlines()) == 1


@pytest.mark.thorough
def test_design(workshop):
    text = said("design", "zvd", "--natural-frequency", "5", "--plot", f"{LONG}.html", cwd=workshop)
    assert f"wrote {LONG}.html" in text


@pytest.mark.thorough
def test_modes(workshop):
    assert f"wrote {LONG}_modes.html" in said("design", "zv", "--modes", "modes.toml", "--plot", f"{LONG}_modes.html", cwd=workshop)


@pytest.mark.thorough
def test_sweep_and_report(workshop):
    text = said("sweep", f"{LONG}.toml", "--store", f"{LONG}.sqlite", "--workers", "0", cwd=workshop)
    assert f"│ {LONG}ZV " in text
    assert f"{LONG}.sqlite" in text
    assert f"wrote {LONG}/r.html" in said("report", f"{LONG}.sqlite", "--output", f"{LONG}/r.html", cwd=workshop)
    assert f"wrote {LONG}.csv" in said("export", f"{LONG}.sqlite", "--output", f"{LONG}.csv", cwd=workshop)


@pytest.mark.thorough
def test_tune(workshop):
    """The damped ringing of one mode: exp(-d t) cos w t."""
    time = np.linspace(0.0, 20.0, 4001)
    values = np.exp(-0.25 * time) * np.cos(5.0 * time)
    rows = (f"{t:.6f},{y:.12f}" for t, y in zip(time, values, strict=True))
    (workshop / "ring.csv").write_text("\n".join([f"time,{LONG}", *rows]))
    text = said("tune", "ring.csv", "--excitation-end", "0", "--output-folder", f"{LONG}_tuned", cwd=workshop)
    assert f"wrote {LONG}_tuned/report.html" in text


@pytest.mark.thorough
def test_new(workshop, fmus):
    names = [
        "--plant",
        fmus / "MassSpringDamper.fmu",
        "--input",
        "force",
        "--output",
        "position",
        "--output-file",
        f"{LONG}_new.ssp",
    ]
    text = said("new", "system", *names, cwd=workshop)
    assert f"wrote {LONG}_new.ssp: profile." in text
    assert f"try: shaper-fmu run {LONG}_new.ssp, and" in text


@pytest.mark.thorough
def test_build(workshop):
    assert f"built {LONG}/Gain.fmu" in said("build", f"{LONG}.py", "--output", LONG, cwd=workshop)
