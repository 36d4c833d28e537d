"""Each writer of the command line: a file that another call made, or that was changed since, is kept; the same call may repeat itself."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from command_line import typed
from test_cli_sweep import STUDY
from test_cli_usage import MODES

from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep import Store

SYSTEMS = Path(__file__).parents[2] / "ssp"
PLANT = ["--plant", "plant.fmu", "--input", "force", "--output", "position"]
FIRST = ["run --output", "design --plot", "design --segments", "export", "new study", "info"]

WRITERS = {  # what is called, the file that it writes, and how another call of it differs
    "run --output": (["run", "plant.fmu", "--until", "1", "--output", "r.csv"], "r.csv", ["--set", "mass=2"]),
    "run --output parquet": (["run", "crane.ssp", "--output", "r.parquet"], "r.parquet", ["--grid"]),
    "run --report": (["run", "plant.fmu", "--until", "1", "--report", "r.html"], "r.html", ["--set", "mass=2"]),
    "design --plot": (["design", "zv", "-w", "5", "--plot", "p.html"], "p.html", ["-z", "0.1"]),
    "design --plot picture": (["design", "zv", "-w", "5", "--plot", "p.png"], "p.png", ["-z", "0.1"]),
    "design --modes --plot": (["design", "zv", "--modes", "modes.toml", "--plot", "m.html"], "m.html", ["--settling"]),
    "design --segments": (["design", "fastest", "-w", "5", "--max-acceleration", "3", "--segments", "s.csv"], "s.csv", ["-z", "0.1"]),
    "new system": (["new", "system", *PLANT, "--output-file", "n.ssp"], "n.ssp", ["-w", "3"]),
    "new study": (["new", "study", "crane.ssp", "--output-file", "n.toml"], "n.toml", []),
    "pack": (["pack", "crane.ssp", "--platform", "this"], "crane.fmu", ["--grid"]),
    "wrap": (["wrap", "plant.fmu", "--input", "force", "-f", "1", "--platform", "this"], "plant_shaped.fmu", ["--shaper", "zvd"]),
    "report": (["report", "s.sqlite", "--output", "s.html"], "s.html", []),
    "export": (["export", "s.sqlite", "--output", "e.csv"], "e.csv", []),
    "export parquet": (["export", "s.sqlite", "--output", "e.parquet"], "e.parquet", []),
    "export --run": (["export", "s.sqlite", "--run", "1", "--output", "e.ssv"], "e.ssv", []),
    "info": (["info", "crane.ssp", "--drawing", "d.svg"], "d.svg", ["--all"]),
    "live": (["live", "--output", "l.html"], "l.html", ["--plant", "MassSpringDamper"]),
    "build": (["build", "MassSpringDamper", "--output", "."], "MassSpringDamper.fmu", ["--fmi", "3"]),
    "build a system": (["build", "folder"], "folder.ssp", []),
    "build --c": (["build", "MassSpringDamper", "--c", "."], "MassSpringDamper.c", []),
    "build --wasm": (["build", "MassSpringDamper", "--wasm", "."], "MassSpringDamper.wasm", []),
}  # fmt: skip


@pytest.fixture(scope="module")
def desk(fmus, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    shutil.copytree(SYSTEMS / "overhead_crane", folder / "folder")
    (folder / "fmus").symlink_to(fmus)
    shutil.copy(fmus / "MassSpringDamper.fmu", folder / "plant.fmu")
    (folder / "modes.toml").write_text(MODES)
    (folder / "study.toml").write_text(STUDY.replace("points = 5", "points = 2").replace("step = 0.05", "step = 0.5"))
    assert typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=folder).returncode == 0
    return folder


@pytest.fixture(autouse=True)
def records(tmp_path, monkeypatch):
    """Records of calls of its own, so that nothing is known of a file before; compiled code is as it was."""
    from shaper_fmu.cli import made

    monkeypatch.setattr(made, "cache_folder", lambda: tmp_path / "cache")


def refused(words: list[str], path: Path, cwd: Path) -> None:
    before = path.read_bytes()
    done = typed(*words, cwd=cwd)
    said = " ".join(done.stderr.split())
    assert done.returncode == 2, said
    assert f"{path.name} is there already" in said
    assert "--force to overwrite it" in said
    assert path.read_bytes() == before


@pytest.mark.representatives(writer=FIRST)
@pytest.mark.parametrize("writer", WRITERS)
def test_a_file_of_another_call_is_kept(desk, writer):
    words, name, other = WRITERS[writer]
    path = desk / name
    path.write_text("mine")
    refused(words, path, desk)
    done = typed(*words, "--force", cwd=desk)
    assert done.returncode == 0, done.stderr
    assert path.read_bytes() != b"mine"
    done = typed(*words, cwd=desk)  # the same call
    assert done.returncode == 0, done.stderr
    if other:
        refused([*words, *other], path, desk)
    with path.open("ab") as stream:
        stream.write(b"\nmine, too")
    if writer != "build":  # an FMU of ours may be built anew
        refused(words, path, desk)
    path.unlink()
    done = typed(*words, cwd=desk)
    assert done.returncode == 0, done.stderr


def test_pages_of_papers(tmp_path):
    """Before any of them is reproduced, which takes long."""
    (tmp_path / "reproduce_pwm.html").write_text("mine")
    for name in ("pwm", "all"):
        refused(["reproduce", name, "--output", "."], tmp_path / "reproduce_pwm.html", tmp_path)


def test_a_store_of_another_study(desk, tmp_path):
    shutil.copy(desk / "s.sqlite", tmp_path)
    shutil.copy(desk / "crane.ssp", tmp_path)
    with Store(tmp_path / "s.sqlite") as store:
        before = store.study().as_json(), store.counts()
    (tmp_path / "study.toml").write_text((desk / "study.toml").read_text().replace("points = 2", "points = 3"))
    done = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=tmp_path)
    assert done.returncode != 0, done.stdout
    with Store(tmp_path / "s.sqlite") as store:
        assert (store.study().as_json(), store.counts()) == before


def test_an_empty_file_is_no_loss(desk, tmp_path):
    (tmp_path / "r.csv").touch()
    assert typed("run", desk / "plant.fmu", "--until", "1", "--output", "r.csv", cwd=tmp_path).returncode == 0
