"""Each command without each optional package: what is not there is told before the work, which is done without it where it can be.

The packages are hidden from a process of its own: they cannot be found, nor imported; no compiler is on the search path. This is a
checkout: with the wheel, which carries FMUs and the loop, more works without a compiler (tests/project/test_first_hour.py).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest
from command_line import FOR_THIS_PLATFORM, typed
from conftest import GAIN

from shaper_fmu import fmu_path
from shaper_fmu.ssp.archive import pack_ssp

OPTIONAL = ("matplotlib", "ziglang", "pyarrow", "distributed", "pandas", "xarray")
HIDDEN = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {hidden!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
import importlib.util, importlib.metadata
found, told = importlib.util.find_spec, importlib.metadata.version
def version(name):
    if name in {hidden!r}:
        raise importlib.metadata.PackageNotFoundError(name)
    return told(name)
importlib.metadata.version = version
importlib.util.find_spec = lambda name, package=None: None if name.split(".")[0] in {hidden!r} else found(name, package)
sys.meta_path.insert(0, Hidden())
import shaper_fmu.export.build
from shaper_fmu.export.native.toolchain import platform_named
shaper_fmu.export.build.USUAL_PLATFORMS = (platform_named("this").name,)  # as the fixture has built them
from shaper_fmu.cli.main import main
main()
"""
PICTURES = "note: matplotlib is not installed, so the page without pictures beside it: pip install 'shaper-fmu[report]'"
PANEL = "note: there is no compiler, so the page has no live panel: pip install 'shaper-fmu[native]'"
COMPILER = "compiled by ziglang, which is not installed: pip install 'shaper-fmu[native]'"
LOOP = "the master's loop, which is compiled once, is not there and cannot be compiled: install ziglang (pip install 'shaper-fmu[native]')"
FMUS = "note: matplotlib is not installed, so the FMUs' pages without pictures: pip install 'shaper-fmu[report]'"
REFUSED = "files of this ending need the package"
TUNE = "tune crane.fmu --input trolley_acceleration --output swing_angle --set initial_rope_length=5"

COMMANDS = {
    # what is typed: {what is missing: (exit code, words on stderr)}; with all else missing it ends well, without a word on it
    "list InputShaper": {},
    "info crane.fmu --drawing crane.svg": {},
    "check crane.fmu": {},
    "design zvd -f 5": {},
    "design zvd -f 5 --plot zvd.html": {"matplotlib": (0, PICTURES), "ziglang": (0, PANEL)},
    "design zv zvd -f 5 --plot kinds.html": {"matplotlib": (0, PICTURES)},
    "design zvd -f 5 --plot zvd.png": {"matplotlib": (2, REFUSED)},
    "live --output live.html": {"ziglang": (1, COMPILER)},
    "build Gain.py --platform this --output .": {
        "matplotlib": (0, FMUS), "ziglang": (1, COMPILER),
    },
    "build Gain.py --backend python --output .": {"matplotlib": (0, FMUS)},
    "build Gain.py --c out": {},
    "new system --plant crane.fmu --input trolley_acceleration --output swing_angle -f 0.2 --output-file s.ssp": {"ziglang": (1, COMPILER)},
    "new study crane.ssp --output-file again.toml": {},
    "run crane.fmu --until 1": {"ziglang": (1, LOOP)},
    "run crane.ssp --until 1 --report run.html": {"matplotlib": (0, PICTURES), "ziglang": (1, LOOP)},
    "run crane.fmu --until 1 --output run.csv": {"ziglang": (1, LOOP)},
    "run crane.fmu --until 1 --output run.parquet": {"pyarrow": (2, REFUSED), "ziglang": (1, LOOP)},
    "run crane.fmu --until 1 --input trolley_acceleration=a.parquet": {"pyarrow": (2, "need the package pyarrow")},
    "sweep study.toml --store s.sqlite --workers 0": {"ziglang": (1, LOOP)},
    "sweep study.toml --store d.sqlite --dask local": {"distributed": (2, "--dask needs the package distributed"), "ziglang": (1, LOOP)},
    "report done.sqlite --output sweep.html": {"matplotlib": (0, PICTURES)},
    "export done.sqlite --output runs.csv": {},
    "export done.sqlite --output runs.parquet": {"pyarrow": (2, REFUSED)},
    "pack crane.ssp --output packed.fmu": {"ziglang": (1, COMPILER)},
    TUNE: {"matplotlib": (0, PICTURES), "ziglang": (1, COMPILER)},
}  # fmt: skip
"""Every command that reads or writes; `reproduce` takes minutes, and is below."""


STUDY = """
name = "rope"
system = "crane.ssp"
stop_time = 1.0
step = 0.1
[vary."crane.initial_rope_length"]
values = [7.0, 8.0]
[compare]
ZV = { "shaper.shaper" = "zv" }
[metrics.top]
kind = "peak"
output = "crane.swing_angle"
"""


@pytest.fixture(scope="module")
def given(fmus, tmp_path_factory) -> Path:
    """What the commands take."""
    folder = tmp_path_factory.mktemp("given")
    pack_ssp(Path(__file__).parents[2] / "ssp" / "overhead_crane", fmus, folder / "crane.ssp", ["this"])
    shutil.copy(fmus / "OverheadCrane.fmu", folder / "crane.fmu")
    (folder / "Gain.py").write_text(GAIN.format(factor=2.0))
    (folder / "study.toml").write_text(STUDY)
    (folder / "a.parquet").write_bytes(b"PAR1")
    assert typed("sweep", "study.toml", "--store", "done.sqlite", "--workers", "0", cwd=folder).returncode == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(*FOR_THIS_PLATFORM)
        fmu_path("InputShaper")
    return folder


def typed_without(hidden: Iterable[str], line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    code = HIDDEN.format(hidden=tuple(hidden))
    environment = {**os.environ, "PATH": ""}
    return subprocess.run(
        [sys.executable, "-c", code, *line.split()],
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment,
        timeout=300,
        check=False,
    )


@pytest.mark.representatives(line=["run crane.ssp --until 1 --report run.html"])
@pytest.mark.parametrize("line", COMMANDS)
def test_what_a_command_does_not_need_is_not_missed(line, given, tmp_path):
    """All at once, so each alone, too."""
    shutil.copytree(given, tmp_path / "here")
    done = typed_without(set(OPTIONAL) - set(COMMANDS[line]), line, tmp_path / "here")
    expected = 2 if "a.parquet" in line else 0  # that is no table
    assert done.returncode == expected, done.stderr
    assert "not installed" not in done.stderr
    assert "no compiler" not in done.stderr


@pytest.mark.representatives(
    line=[
        "run crane.ssp --until 1 --report run.html",
        "design zvd -f 5 --plot zvd.png",
        "run crane.fmu --until 1 --output run.parquet",
    ]
)
@pytest.mark.parametrize(("line", "missing"), [(line, one) for line, needed in COMMANDS.items() for one in needed])
def test_what_is_missing_is_told_before_the_work(line, missing, given, tmp_path):
    code, words = COMMANDS[line][missing]
    shutil.copytree(given, tmp_path / "here")
    before = set((tmp_path / "here").rglob("*"))
    done = typed_without([missing], line, tmp_path / "here")
    said = done.stderr.splitlines()
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert [text for text in said if words in text], done.stderr
    made = {path.suffix for path in set((tmp_path / "here").rglob("*")) - before if "__pycache__" not in path.parts}
    if code:
        assert not made
    else:
        assert words in said[0]  # at the beginning
        assert "--report" not in line or ".html" in made
        assert ".png" not in made or missing != "matplotlib"
