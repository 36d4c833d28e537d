"""The wheel: what `make dist` builds gives its user every native FMU, without compiler, ziglang or source checkout."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest
from made_once import made_once

import shaper_fmu
from shaper_fmu import fmu_path
from shaper_fmu.live import write_live_page
from shaper_fmu.live.panel import TITLE
from shaper_fmu.live.shipped import shipped_components
from shaper_fmu.registry import components

ROOT = Path(__file__).parents[2]
PACKED = ("shaper_fmu", "plants", "pyproject.toml", "README.md", "LICENSE")

USER = """
import hashlib, importlib.util, json, subprocess, sys, sysconfig
assert importlib.util.find_spec("ziglang") is None
from shaper_fmu import System, components, fmu_path
found = {f"{name}{fmi}": hashlib.sha256(fmu_path(name, fmi=fmi).read_bytes()).hexdigest() for name in components() for fmi in (2, 3)}
assert "site-packages" in str(fmu_path("InputShaper", fmi=3))
system = System("shaped")
system.add("shaper", fmu_path("InputShaper"), natural_frequency=[10.0])
system.add("plant", fmu_path("MassSpringDamper"), damping=0.0)
system.drive("shaper.command", [(0.0, 100.0)])
system.connect("shaper.shaped_mean", "plant.force")
from shaper_fmu.master import loop_library
assert "site-packages" in str(loop_library._shipped())
assert loop_library._built_by_a_compiler() is None
from shaper_fmu.container.build import pack
from shaper_fmu.container.interface import outer_variables
packed = pack(system, outer_variables(system, 2), "shaped.fmu")  # the container's library is the wheel's
assert len(packed.platforms) == 5, packed
found["position"] = float(system.simulate(stop_time=1.0, step=0.01)["plant.position"][-1]).hex()
print(json.dumps(found))
"""


def pip() -> list[str]:
    """A pip that can install into another environment; this environment may have none."""
    for python in (sys.executable, sys._base_executable):  # pyright: ignore[reportAttributeAccessIssue]
        if subprocess.run([python, "-m", "pip", "--version"], capture_output=True, check=False).returncode == 0:
            return [python, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    pytest.fail("no pip")


def run(command: list[str], **options) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, **options)
    assert done.returncode == 0, f"{command}: {done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def wheel(tmp_path_factory) -> Path:
    """The wheel, as `make dist` builds it."""
    found = next(made_once(tmp_path_factory, "dist", _build_wheel).glob("*.whl"))
    assert found.name.startswith(f"shaper_fmu-{shaper_fmu.__version__}-")
    return found


def _build_wheel(folder: Path) -> None:
    source = folder / "source"
    for name in PACKED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__", "shipped"))
        else:
            shutil.copy(ROOT / name, source)
    for part in ("export.build", "master.loop_library", "container.library", "live.shipped"):
        run([sys.executable, "-m", f"shaper_fmu.{part}"], cwd=source, env={**os.environ, "PYTHONPATH": str(source)})
    run([*pip(), "wheel", "--no-deps", "--wheel-dir", str(folder), "."], cwd=source)
    shutil.rmtree(source)


@pytest.fixture(scope="module")
def clean(wheel, tmp_path_factory) -> Path:
    """A fresh environment with nothing but the wheel and what it requires."""
    return made_once(tmp_path_factory, "clean", lambda folder: environment(folder, str(wheel))) / "bin" / "python"


def environment(folder: Path, *requirements: str) -> Path:
    """The python of a fresh environment with what is required."""
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    run([*pip(), "--python", str(python), "install", *requirements])
    return python


def test_the_wheel_hands_out_all_native_fmus_and_they_run(clean, tmp_path):
    (tmp_path / "plants").mkdir()
    (tmp_path / "plants" / "__init__.py").write_text("raise RuntimeError('the user has plants, too')\n")
    environment = {"PATH": "", "HOME": str(tmp_path), "SHAPER_FMU_CACHE": str(tmp_path / "cache")}
    found = json.loads(run([str(clean), "-c", USER], cwd=tmp_path, env=environment))
    position = float.fromhex(found.pop("position"))
    assert position == pytest.approx(1.0, abs=1e-3)  # ZV on its own mode: 100 N on 100 N/m, at rest
    built = {
        f"{name}{fmi}": hashlib.sha256(fmu_path(name, fmi=fmi).read_bytes()).hexdigest() for name in components() for fmi in (2, 3)
    }
    assert found == built


def test_build_without_a_compiler_hands_them_out_and_says_what_it_cannot_do(clean, tmp_path):
    command = [str(clean.parent / "shaper-fmu"), "build"]
    environment = {"PATH": "", "HOME": str(tmp_path), "SHAPER_FMU_CACHE": str(tmp_path / "cache")}
    run([*command, "InputShaper", "--fmi", "3", "--output", "out"], cwd=tmp_path, env=environment)
    assert (tmp_path / "out" / "InputShaper.fmu").read_bytes() == fmu_path("InputShaper", fmi=3).read_bytes()
    shutil.copy(ROOT / "examples" / "my_plant.py", tmp_path)
    done = subprocess.run([*command, "my_plant.py"], capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    assert done.returncode == 1
    assert "native FMUs are compiled by ziglang, which is not installed: pip install 'shaper-fmu[native]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_pages_are_written_without_a_compiler(clean, tmp_path):
    """The kernels came with the wheel, the same as a checkout compiles; for a plant of one's own there is no compiler."""
    environment = {"PATH": "", "HOME": str(tmp_path), "SHAPER_FMU_CACHE": str(tmp_path / "cache")}
    command = str(clean.parent / "shaper-fmu")
    run([command, "live"], cwd=tmp_path, env=environment)
    write_live_page(tmp_path / "own.html")
    assert (tmp_path / "live.html").read_text() == (tmp_path / "own.html").read_text()
    done = run([command, "design", "zvd", "-w", "5", "--plot", "zvd.html"], cwd=tmp_path, env=environment)
    assert "compiler" not in done
    assert TITLE in (tmp_path / "zvd.html").read_text()
    shutil.copy(ROOT / "examples" / "my_plant.py", tmp_path)
    refused = subprocess.run(
        [command, "live", "--plant", "my_plant.py", "--output", "mine.html"], capture_output=True, text=True, cwd=tmp_path,
        env=environment, check=False,
    )  # fmt: skip
    assert refused.returncode == 1
    assert "pip install 'shaper-fmu[native]'" in refused.stderr


def test_the_shipped_kernels_are_small(wheel):
    """A few 100 kB in the wheel."""
    with zipfile.ZipFile(wheel) as archive:
        sizes = [one.compress_size for one in archive.infolist() if one.filename.startswith("shaper_fmu/shipped/wasm/")]
    assert len(sizes) == len(shipped_components())
    assert sum(sizes) < 400_000
