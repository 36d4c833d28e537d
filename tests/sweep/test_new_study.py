"""`shaper-fmu new study`: the study has the system's own names, and its sweep runs as it stands."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest
from command_line import typed

from shaper_fmu import System
from shaper_fmu.errors import StudyError
from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.ssp.export import write_system
from shaper_fmu.sweep import Store, read_study
from shaper_fmu.sweep.template import study_text

SYSTEMS = Path(__file__).parents[2] / "ssp"


@pytest.fixture(scope="module")
def desk(fmus, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("desk")
    for name in ("overhead_crane", "nested_crane"):
        pack_ssp(SYSTEMS / name, fmus, folder / f"{name}.ssp")
    alone = System("alone")
    alone.add("plant", fmus / "MassSpringDamper.fmu", force=2.0)
    write_system(alone, folder / "alone.ssp")  # without shaper, stop time and step
    return folder


NAMES = {  # system: what varies, its nominal value, what is measured, cases
    "overhead_crane": ("crane.initial_rope_length", 8.0, "crane.swing_angle", ["unshaped", "ZV", "ZVD"]),
    "nested_crane": ("machine.crane.initial_rope_length", 8.0, "machine.crane.swing_angle", ["unshaped", "ZV", "ZVD"]),
    "alone": ("plant.mass", 1.0, "plant.position", ["all"]),
}


@pytest.mark.representatives(name=["overhead_crane"])
@pytest.mark.parametrize("name", NAMES)
def test_the_sweep_of_it_runs(desk, tmp_path, name):
    shutil.copy(desk / f"{name}.ssp", tmp_path)
    done = typed("new", "study", f"{name}.ssp", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    varied, nominal, output, cases = NAMES[name]
    study = read_study(tmp_path / "study.toml")
    assert [*study.vary] == [varied]
    vary = study.vary[varied]
    assert (vary.nominal, vary.low, vary.high, vary.points) == (
        nominal,
        pytest.approx(0.8 * nominal),
        pytest.approx(1.2 * nominal),
        5,
    )
    assert [*study.compare] == cases
    assert {metric.output for metric in study.metrics.values()} == {output}
    done = typed("sweep", "study.toml", "--store", "s.sqlite", "--workers", "0", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    with Store(tmp_path / "s.sqlite") as store:
        assert store.counts() == {"done": 5 * len(cases)}
    text = (tmp_path / "study.toml").read_text()
    if name == "alone":  # the formula: static 2 N / 100 N/m, and what overshoots it: 1 + exp(-pi zeta / sqrt(1 - zeta^2))
        assert "the system declares none: correct it" in text
        done = typed("export", "s.sqlite", "--output", "r.csv", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        head, *rows = [line.split(",") for line in (tmp_path / "r.csv").read_text().splitlines()]
        row = next(row for row in rows if float(row[head.index("plant.mass")]) == 1.0)
        zeta = 1.0 / (2.0 * math.sqrt(100.0))
        expected = 0.02 * (1.0 + math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)))
        assert float(row[head.index("peak_position")]) == pytest.approx(expected, rel=1e-3)
    else:
        assert "crane.gravity = 9.81 m/s2" in text
        assert "shaper.shaper = zvd (of none, zv," in text or "shaper.shaper = zv (of none, zv," in text


def test_of_a_folder(tmp_path):
    shutil.copytree(SYSTEMS / "overhead_crane", tmp_path / "crane")
    shutil.rmtree(tmp_path / "crane" / "reference", ignore_errors=True)
    (tmp_path / "crane" / "study.toml").unlink()
    done = typed("new", "study", "crane", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert read_study(tmp_path / "crane" / "study.toml").system == "../crane.ssp"  # which `sweep` builds


def test_nothing_is_overwritten(desk, tmp_path):
    (tmp_path / "study.toml").write_text("# mine\n")
    done = typed("new", "study", desk / "alone.ssp", cwd=tmp_path)
    assert (done.returncode, "study.toml is there already" in done.stderr) == (2, True)
    assert (tmp_path / "study.toml").read_text() == "# mine\n"
    assert typed("new", "study", desk / "alone.ssp", "--force", cwd=tmp_path).returncode == 0
    assert (tmp_path / "study.toml").read_text() != "# mine\n"


def test_nothing_to_vary(fmus):
    with pytest.raises(StudyError, match="nothing can be varied"):
        study_text(System("empty"), "empty.ssp", None, None)
