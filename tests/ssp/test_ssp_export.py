"""Systems built in Python, points of sweeps and templates as SSP archives that run again."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import FOR_THIS_PLATFORM, typed
from other_masters import Job, run_jobs
from test_native_interoperability import PACKAGES, require
from test_native_interoperability import pytestmark as where_the_masters_run

from shaper_fmu import System
from shaper_fmu.archives import read_archive
from shaper_fmu.errors import ModelError, StudyError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.export.native.toolchain import PLATFORMS, USUAL_PLATFORMS
from shaper_fmu.registry import find_component
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.ssp.read import read_parameter_set
from shaper_fmu.ssp.schemas import schema_problems
from shaper_fmu.ssp.template import write_template
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.points import write_point
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study

SYSTEMS = Path(__file__).parents[2] / "ssp"


@pytest.fixture
def for_this_platform(monkeypatch) -> None:
    monkeypatch.setattr(*FOR_THIS_PLATFORM)


@pytest.fixture
def crane(fmus) -> System:
    """With a scaled connection, an enumeration, arrays, and an instance of a nested system."""
    system = System("shaped crane")
    system.add("profile", fmus / "MotionProfile.fmu", profile="s_curve", distance=10.0, duration=8.0)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zvd", natural_frequency=[1.1, 3.0], shape_mode=[True, False])
    system.add("crane.hoist", fmus / "OverheadCrane.fmu", initial_rope_length=8.0, hoist_speed=0.1)
    system.connect("profile.acceleration", "shaper.command")
    system.connect("shaper.shaped_mean", "crane.hoist.trolley_acceleration", gain=0.5, offset=0.01)
    return system


def test_a_system_is_written_and_runs_again(crane, tmp_path):
    path = crane.to_ssp(tmp_path / "crane.ssp", stop_time=3.0, step=0.01)
    files = read_archive(path.read_bytes(), path.name)
    assert [schema_problems(files[name], name) for name in files if name.endswith((".ssd", ".ssv"))] == [[]] * 4
    loaded = load_ssp(path)
    assert (loaded.structure.stop_time, loaded.structure.step_size, loaded.structure.algorithm) == (3.0, 0.01, "jacobi")
    assert loaded.system.connections == crane.connections
    assert loaded.system.scalings == crane.scalings
    assert loaded.system.start_values == crane.start_values
    one, other = crane.simulate(3.0, 0.01), loaded.simulate(3.0, 0.01)
    assert {name: column.tobytes() for name, column in one.values.items()} == {n: c.tobytes() for n, c in other.values.items()}
    again = load_ssp(crane.to_ssp(tmp_path / "parallel.ssp", step=0.02, algorithm="parallel")).structure
    assert (again.stop_time, again.step_size, again.algorithm) == (None, 0.02, "parallel")


def test_arrays_of_fmi_3_need_version_2(tmp_path):
    """Elements without a value have their start value, 10 rad/s."""
    made = build_fmu(find_component("InputShaper"), tmp_path, fmi=3, platforms=["this"])
    system = System()
    system.add("shaper", made, natural_frequency=[1.5, 2.5], command=0.25)
    path = system.to_ssp(tmp_path / "three.ssp")
    files = read_archive(path.read_bytes(), path.name)
    assert [schema_problems(files[name], name) for name in ("SystemStructure.ssd", "resources/shaper.ssv")] == [[], []]
    loaded = load_ssp(path)
    assert loaded.structure.version == "2.0"
    frequencies = {f"natural_frequency[{i + 1}]": value for i, value in enumerate((1.5, 2.5, 10.0, 10.0))}
    assert loaded.system.start_values["shaper"] == {**frequencies, "command": 0.25}


def test_writing_is_reproducible(crane, tmp_path):
    one, other = (crane.to_ssp(tmp_path / name) for name in ("a.ssp", "b.ssp"))
    assert one.read_bytes() == other.read_bytes()


def test_an_fmu_is_in_the_archive_once(fmus, tmp_path):
    system = System()
    for name in ("a", "b"):
        system.add(name, fmus / "MassSpringDamper.fmu", force=1.0)
    files = read_archive(system.to_ssp(tmp_path / "two.ssp").read_bytes(), "two.ssp")
    assert [name for name in files if name.endswith(".fmu")] == ["resources/MassSpringDamper.fmu"]


def test_what_an_archive_cannot_hold_is_refused(crane, tmp_path):
    crane.add("other", crane.fmus["crane.hoist"])
    crane.drive("other.hoist_speed", lambda t: t)
    with pytest.raises(ModelError, match=r"input other\.hoist_speed is driven from outside"):
        crane.to_ssp(tmp_path / "no.ssp")
    assert not (tmp_path / "no.ssp").exists()


STUDY = """name = "rope"
system = "crane.ssp"
stop_time = 2.0
step = 0.01
[vary."crane.initial_rope_length"]
values = [6.0, 7.1]
[compare]
ZV = { "shaper.shaper" = "zv" }
ZVD = { "shaper.shaper" = "zvd" }
[metrics.swing]
kind = "final"
output = "crane.swing_angle"
"""


def test_a_point_of_a_sweep_is_a_parameter_set(fmus, tmp_path):
    """Each run again, from its parameter set, gives the sweep's own metric."""
    pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / "crane.ssp")
    (tmp_path / "study.toml").write_text(STUDY)
    store = tmp_path / "s.sqlite"
    run_study(read_study(tmp_path / "study.toml"), store)
    with Store(store) as opened:
        runs = opened.runs()
    assert len({run.metrics["swing"] for run in runs}) == len(runs) == 6  # two cases at two lengths and the nominal one
    for run in runs:
        path = tmp_path / f"{run.id}.ssv"
        values = write_point(store, run.id, path)
        assert values == {"shaper.shaper": run.compared.lower(), **run.varied}
        assert schema_problems(path.read_bytes(), path.name) == []
        loaded = load_ssp(tmp_path / "crane.ssp")
        apply_parameter_set(loaded, path)
        assert loaded.simulate(2.0, 0.01)["crane.swing_angle"][-1] == run.metrics["swing"]
    with pytest.raises(StudyError, match="there is no run 99"):
        write_point(store, 99, tmp_path / "99.ssv")
    last = next(run for run in runs if run.compared == "ZVD" and run.varied["crane.initial_rope_length"] == 7.1)
    done = typed("export", "s.sqlite", "--run", str(last.id), "--output", "point.ssv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    parameters = read_parameter_set((tmp_path / "point.ssv").read_bytes(), "point.ssv").parameters
    assert [(p.name, p.type, p.value, p.unit) for p in parameters] == [
        ("shaper.shaper", "Enumeration", "zvd", None),
        ("crane.initial_rope_length", "Real", "7.1", "m"),
    ]
    wrong = typed("export", "s.sqlite", "--output", "point.ssv", cwd=tmp_path)
    assert (wrong.returncode, "give --run" in wrong.stderr) == (2, True)


def test_a_template_shapes_a_plant(fmus, tmp_path, for_this_platform):
    """ZV leaves nothing of the plant's vibration but what holding its mean over a step costs; unshaped there is more."""
    written = write_template(fmus / "MassSpringDamper.fmu", "force", "position", tmp_path / "shaped.ssp", damping_ratio=0.0)
    assert (written.natural_frequency, written.known, written.profile_output) == (pytest.approx(10.0, rel=1e-12), True, "position")
    residual = {}
    for which in (None, "unshaped"):
        loaded = load_ssp(written.path)
        loaded.set("plant.damping", 0.0)
        loaded.set("profile.profile", "trapezoid")
        if which is not None:
            apply_parameter_set(loaded, which)
        position = loaded.simulate(written.stop_time, loaded.structure.step_size or math.nan)["plant.position"]
        residual[which] = np.ptp(position[-len(position) // 4 :])
    assert residual[None] < 1e-3 * residual["unshaped"]


@pytest.mark.thorough
def test_a_template_runs_on_all_usual_platforms(fmus, tmp_path):
    files = read_archive(
        write_template(fmus / "MassSpringDamper.fmu", "force", "position", tmp_path / "s.ssp").path.read_bytes(), "s"
    )
    for name in ("MotionProfile", "InputShaper"):
        folders = {
            path.split("/")[1] for path in read_archive(files[f"resources/{name}.fmu"], name) if path.startswith("binaries/")
        }
        assert {PLATFORMS[platform].fmi2_folder for platform in USUAL_PLATFORMS} <= folders


@where_the_masters_run
@pytest.mark.parametrize("master", PACKAGES)
def test_a_template_runs_in_other_masters(fmus, master, tmp_path, for_this_platform):
    """With ZV, the shaper's start value, no enumeration is in it; the values are those of our "parallel" on the grid."""
    require(master)
    written = write_template(fmus / "MassSpringDamper.fmu", "force", "position", tmp_path / "shaped.ssp")
    step = load_ssp(written.path).structure.step_size or math.nan
    job = Job(str(written.path), step, round(written.stop_time / step), [("plant", "position", "real")])
    found = np.array(run_jobs(master, {"shaped": job}, tmp_path)["shaped"].rows)[:, 0]
    ours = load_ssp(written.path).simulate(written.stop_time, step, algorithm="parallel", exact=False)["plant.position"][1:]
    assert np.abs(found - ours).max() <= 1e-9 * np.abs(ours).max()


@pytest.mark.parametrize(
    ("input_", "output", "words"),
    [
        ("forze", "position", r"has no input 'forze' of real numbers. Did you mean 'force'\?"),
        ("force", "mass", "has no output 'mass' of real numbers"),
    ],
)
def test_a_template_needs_the_plants_names(fmus, tmp_path, input_, output, words):
    with pytest.raises(ModelError, match=words):
        write_template(fmus / "MassSpringDamper.fmu", input_, output, tmp_path / "x.ssp")
    assert not (tmp_path / "x.ssp").exists()


def test_the_template_on_the_command_line(fmus, tmp_path):
    shutil.copy(fmus / "OverheadCrane.fmu", tmp_path / "crane.fmu")
    names = ["--plant", "crane.fmu", "--input", "trolley_acceleration", "--output", "swing_angle"]
    done = typed("new", "system", *names, "--output-file", "s.ssp", "--shaper", "ei", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "profile.acceleration -> shaper -> plant.trolley_acceleration" in done.stdout
    for arguments in (("check", "s.ssp"), ("run", "s.ssp", "--stop-time", "1"), ("run", "s.ssp", "--set", "profile.distance=2")):
        done = typed(*arguments, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
    wrong = typed("new", "system", *names, "--shaper", "zvv", cwd=tmp_path)
    assert (wrong.returncode, "'zvv' is none of" in wrong.stderr) == (2, True)
