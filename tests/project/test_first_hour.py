"""The first hour of a new user: a fresh environment from the wheel, then look, decide, run, sweep and report; and the sdist.

Nothing of this checkout is there but the wheel.
"""

from __future__ import annotations

import subprocess
import tarfile
from pathlib import Path

import pytest
from test_dist import ROOT, environment, run, wheel  # noqa: F401 - a fixture

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def user(wheel, tmp_path_factory):  # noqa: F811
    """What the user types, in a folder of his, without compiler or checkout; returns what is printed."""
    folder = tmp_path_factory.mktemp("user")
    python = environment(wheel.parent / "user", f"{wheel}[report]")
    variables = {"PATH": str(python.parent), "HOME": str(folder), "SHAPER_FMU_CACHE": str(folder / "cache"), "MPLBACKEND": "agg"}

    def type_(*words: str) -> str:
        command = [str(python.parent / words[0]), *words[1:]]
        done = subprocess.run(command, capture_output=True, text=True, timeout=900, cwd=folder, env=variables, check=False)
        assert done.returncode == 0, f"{words}: {done.stdout}\n{done.stderr}"
        assert "Traceback" not in done.stderr
        return done.stdout

    type_.folder = folder  # pyright: ignore[reportFunctionMemberAccess]
    return type_


def test_the_first_hour(user):
    folder: Path = user.folder
    user("shaper-fmu", "build", "OverheadCrane", "--output", ".")  # the wheel's own
    assert "trolley_acceleration" in user("shaper-fmu", "info", "OverheadCrane.fmu", "--drawing", "crane.svg")
    said = user("shaper-fmu", "design", "zv", "zvd", "ei", "-f", "0.2", "-z", "1%", "--plot", "kinds.html")
    assert "damping ratio 0.01" in said
    given = ["--input", "trolley_acceleration=step:0.1@1", "--until", "10", "--output", "run.csv", "--report", "run.html"]
    user("shaper-fmu", "run", "OverheadCrane.fmu", *given)
    system = ["--plant", "OverheadCrane.fmu", "--input", "trolley_acceleration", "--output", "swing_angle"]
    user("shaper-fmu", "new", "system", *system, "-w", "1.4", "--output-file", "crane.ssp")
    user("shaper-fmu", "run", "crane.ssp")
    user("shaper-fmu", "new", "study", "crane.ssp")
    assert "15 of 15 runs done" in user("shaper-fmu", "sweep", "study.toml", "--store", "s.sqlite", "--workers", "0")
    user("shaper-fmu", "report", "s.sqlite", "--output", "sweep.html")
    user("shaper-fmu", "export", "s.sqlite", "--output", "runs.csv")
    for page in ("kinds.html", "run.html", "sweep.html"):
        assert 10_000 < (folder / page).stat().st_size < 1_000_000, page


def test_the_sdist(tmp_path):
    """It holds what building and testing need, and builds into a package that runs."""
    build = environment(tmp_path / "builder", "hatchling")
    run([str(build), "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)], cwd=ROOT)
    archive = next(tmp_path.glob("shaper_fmu-*.tar.gz"))
    with tarfile.open(archive) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert names >= {"pyproject.toml", "README.md", "LICENSE", "Makefile", "plants/overhead_crane.py", "tests/conftest.py"}
    python = environment(tmp_path / "environment", str(archive))
    said = run([str(python.parent / "shaper-fmu"), "design", "zvd", "-f", "5"], cwd=tmp_path)
    assert "0.2" in said
    said = run([str(python), "-c", "import shaper_fmu; print(*shaper_fmu.components())"], cwd=tmp_path)
    assert "OverheadCrane" in said
