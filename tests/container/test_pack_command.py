"""`shaper-fmu pack` and `to_fmu`: what is written, and that it gives what `run` gives."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from command_line import typed
from fmpy.validation import validate_fmu
from ssp_archives import archive, component, connection, connectors, linear, ssd, system

from shaper_fmu import System
from shaper_fmu.archives import read_archive
from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.archive import load_ssp

W = 10.0  # of a mass of 1 kg on a spring of 100 N/m
fmi_versions = pytest.mark.parametrize("fmi", [2, 3])


def shaped(fmus: Path) -> System:
    found = System("shaped")
    found.add("shaper", fmus / "InputShaper.fmu", natural_frequency=[W])
    found.add("plant", fmus / "MassSpringDamper.fmu", damping=0.0)
    found.connect("shaper.shaped", "plant.force")
    return found


def push(folder: Path, fmus: Path) -> Path:
    """An archive with connectors of its own: 1 kN and half of it more, in mm, and a parameter."""
    root = system(
        connectors("push input kN", "mass parameter g", "place output mm"),
        component("shaper", "InputShaper") + component("plant", "MassSpringDamper"),
        connection("push", "shaper.command", linear(1.5)) + connection("shaper.shaped", "plant.force")
        + connection("mass", "plant.mass") + connection("plant.position", "place"),
    )  # fmt: skip
    return archive(folder, fmus, ssd(root), "InputShaper", "MassSpringDamper")


@fmi_versions
def test_a_packed_system_gives_what_run_gives(fmus, tmp_path, fmi):
    """At the communication points of the host, which are five times as far apart."""
    path = push(tmp_path, fmus)
    settings = ["--set", "shaper.natural_frequency[1]=7", "--set", "mass=2000"]
    done = typed("pack", path, "--fmi", str(fmi), "--step", "0.01", *settings, "--output", "out/x.fmu", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    packed = tmp_path / "out" / "x.fmu"
    assert "wrote out/x.fmu" in done.stdout
    assert "platforms: x86_64" in done.stdout or "platforms: aarch64" in done.stdout
    assert all(name in done.stdout for name in ("InputShaper.fmu", "MassSpringDamper.fmu"))
    assert validate_fmu(str(packed)) == []
    loaded = load_ssp(path)
    loaded.set("shaper.natural_frequency[1]", 7)
    loaded.set("mass", 2000)
    loaded.drive("push", 0.002)
    expected = loaded.simulate(1.0, 0.01)
    found = fmpy.simulate_fmu(str(packed), stop_time=1.0, output_interval=0.05, start_values={"push": 0.002})
    assert found["place"] == pytest.approx(expected["place"][::5], abs=1e-12 * float(np.max(np.abs(expected["place"]))))
    described = {v.name: v for v in fmpy.read_model_description(packed).modelVariables}
    assert (described["push"].unit, described["place"].unit, described["mass"].start) == ("kN", "mm", "2000.0")


@fmi_versions
@pytest.mark.parametrize("step", [0.001, 0.05])
def test_an_edge_inside_is_exact_whatever_the_host_steps(fmus, tmp_path, fmi, step):
    """After a ZV-shaped step of 1 N the undamped mass rests at F/k = 0.01 m: what is left is below 1e-10 of it."""
    path = shaped(fmus).to_fmu(tmp_path / "x.fmu", fmi)
    outputs = ["plant.position", "plant.velocity"]
    found = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=step, start_values={"shaper.command": 1.0}, output=outputs)
    after = found[found["time"] > np.pi / W + step]
    assert np.max(np.abs(after["plant.position"] - 0.01)) < 1e-12
    assert np.max(np.abs(after["plant.velocity"])) < 1e-10 * 0.01 * W


def test_more_variables_and_other_names(fmus, tmp_path):
    archived = shaped(fmus).to_ssp(tmp_path / "s.ssp", stop_time=1.0, step=0.01)
    done = typed(
        "pack", archived, "--expose", "plant.mass", "--expose", "shaper.natural_frequency[1]", "--rename", "plant.position=x",
        "--name", "My machine", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    described = fmpy.read_model_description(tmp_path / "s.fmu")
    names = [v.name for v in described.modelVariables]
    assert names[0] == "shaper.command"
    assert {"x", "plant.mass", "shaper.natural_frequency[1]"} <= set(names)
    assert "plant.position" not in names
    assert (described.modelName, described.defaultExperiment.stopTime) == ("My machine", "1.0")
    files = read_archive((tmp_path / "s.fmu").read_bytes(), "s.fmu")
    assert any(name.endswith("MassSpringDamper/modelDescription.xml") for name in files)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--expose", "plant.mas"], "Did you mean 'mass'?"),
        (["--rename", "plant.y=x"], "plant.y: there is no such variable to rename"),
        (["--rename", "plant.mass=m"], "Parameters and local variables have to be exposed, too."),
        (["--rename", "plant.position"], "is not of the form plant.position=x"),
        (["--set", "plant.mas=1"], "Did you mean 'mass'?"),
        (["--platform", "x86-linux"], "there is no platform 'x86-linux'"),
        (["--step", "0"], "outside its domain"),
        (["--output", "x.ssp"], "must end with .fmu"),
    ],
)
def test_wrong_usage_exits_with_2(fmus, tmp_path, options, words):
    archived = shaped(fmus).to_ssp(tmp_path / "s.ssp", stop_time=1.0, step=0.01)
    done = typed("pack", archived, *options, cwd=tmp_path)
    assert done.returncode == 2
    assert words in " ".join(done.stderr.split()).replace("│ │ ", "")
    assert not (tmp_path / "s.fmu").exists()


def exchange_archive(folder: Path, fmus: Path) -> Path:
    root = system("", component("plant", "MassSpringDamper").replace("source=", 'implementation="ModelExchange" source='))
    return archive(folder, fmus, ssd(root), "MassSpringDamper")


def test_what_cannot_be_packed_is_told_by_all_commands(fmus, tmp_path):
    path = exchange_archive(tmp_path, fmus)
    reason = "plant: MassSpringDamper.fmu is used by model exchange, which needs the master's solver: use it by co-simulation"
    done = typed("pack", path, "--step", "0.01", cwd=tmp_path)
    assert (done.returncode, done.stderr.strip()) == (1, f"error: {reason}")
    checked = typed("check", path, "--pack", cwd=tmp_path)
    assert (checked.returncode, checked.stdout.strip()) == (1, f"{path}: pack: {reason}")
    assert typed("check", path, cwd=tmp_path).returncode == 0
    assert reason in " ".join(typed("info", path, "--json", cwd=tmp_path).stdout.split())
    right = shaped(fmus).to_ssp(tmp_path / "right.ssp", stop_time=1.0, step=0.01)
    assert typed("check", right, fmus / "MassSpringDamper.fmu", "--pack", cwd=tmp_path).returncode == 0


def test_to_fmu_refuses_what_a_container_cannot_have(fmus, tmp_path):
    found = shaped(fmus)
    found.drive("shaper.command", lambda t: t)
    with pytest.raises(ModelError, match=r"shaper\.command is driven by a function of Python"):
        found.to_fmu(tmp_path / "x.fmu")
    assert not (tmp_path / "x.fmu").exists()


@pytest.mark.parametrize("version", ["3", "2.0", 4])
def test_another_version_of_fmi_is_told(fmus, tmp_path, version):
    path = push(tmp_path, fmus)
    for found in (shaped(fmus), load_ssp(path)):
        with pytest.raises(ModelError, match="is not a version of FMI that a container can have: give 2 or 3"):
            found.to_fmu(tmp_path / "x.fmu", version)
    assert not (tmp_path / "x.fmu").exists()


def test_one_name_to_expose_and_a_platform_twice(fmus, tmp_path):
    path = shaped(fmus).to_fmu(tmp_path / "x.fmu", expose="plant.mass")
    assert "plant.mass" in [v.name for v in fmpy.read_model_description(path).modelVariables]
    archived = shaped(fmus).to_ssp(tmp_path / "s.ssp")
    done = typed("pack", archived, "--platform", "this", "--platform", "this", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("-linux ...") + done.stderr.count("-windows ...") + done.stderr.count("-darwin ...") == 1


def test_the_fmus_without_a_platform_are_named(fmus, tmp_path):
    with pytest.raises(ModelError, match=r"a library for i686-windows \(none in shaper, plant\); all have those for x86_64-"):
        shaped(fmus).to_fmu(tmp_path / "x.fmu", platforms=["i686-windows"])
    assert not (tmp_path / "x.fmu").exists()


def test_a_connector_that_leads_nowhere_is_told(fmus, tmp_path):
    root = system(
        connectors("push input N", "unused input N"), component("plant", "MassSpringDamper"), connection("push", "plant.force")
    )
    path = archive(tmp_path, fmus, ssd(root), "MassSpringDamper")
    done = typed("pack", path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "note: not shown: unused leads nowhere" in done.stderr


def test_start_values_that_the_fmus_refuse_are_told(fmus, tmp_path):
    """A mass below zero is judged by the FMU alone, at its initialization: the file is there, and the exit code says that it is not good."""
    path = push(tmp_path, fmus)
    done = typed("pack", path, "--set", "plant.mass=-1", "--output", "x.fmu", cwd=tmp_path)
    assert done.returncode == 1
    assert (tmp_path / "x.fmu").is_file()
    assert "its system does not start here with these values" in done.stdout
    assert "mass = -1 kg" in done.stdout


def test_a_mean_over_the_step_is_told_with_what_to_connect(fmus, tmp_path):
    system_ = System("mean")
    system_.add("shaper", fmus / "InputShaper.fmu", natural_frequency=[W])
    system_.add("plant", fmus / "MassSpringDamper.fmu", damping=0.0)
    system_.connect("shaper.shaped_mean", "plant.force")
    done = typed("pack", system_.to_ssp(tmp_path / "mean.ssp"), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "connect shaper.shaped instead to have them exact" in done.stderr
    page = read_archive((tmp_path / "mean.fmu").read_bytes(), "mean")["documentation/index.html"].decode()
    assert "connect shaper.shaped instead" in page
    assert "its steps end at the events inside" not in page


def test_the_name_of_an_fmu_ends_so(fmus, tmp_path):
    with pytest.raises(ModelError, match="the name of an FMU ends in"):
        shaped(fmus).to_fmu(tmp_path / "x.zip")
