"""The crane of ssp/nested_crane: the rich features of SSP give the values of the flat archive, and what its page says."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from command_line import typed

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.ssp.archive import load_ssp, pack_ssp, read_variant, variants
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.ssp.names import VERSIONS
from shaper_fmu.ssp.parameter_sets import apply_parameter_set, parameter_set_problems
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study
from shaper_fmu.sweep.variation import Vary

SYSTEMS = Path(__file__).parents[2] / "ssp"
FOLDER = SYSTEMS / "nested_crane"


@pytest.fixture(scope="module")
def archive(fmus, tmp_path_factory) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path_factory.mktemp("nested") / "nested_crane.ssp")


def test_it_is_right_and_has_two_variants_in_two_versions(archive):
    assert check_ssp(archive) == []
    files = read_archive(archive.read_bytes(), archive.name)
    assert variants(files) == ["SystemStructure.ssd", "Hoisting.ssd"]
    assert tuple(read_variant(files, name).version for name in variants(files)) == VERSIONS
    for variant in (None, "Hoisting"):
        loaded = load_ssp(archive, variant)
        assert (loaded.notes, parameter_set_problems(loaded)) == ((), [])
        assert (loaded.inputs, loaded.outputs) == (["distance"], ["swing", "load_error"])


def test_it_gives_the_flat_cranes_values_to_the_last_bit(archive, fmus, tmp_path):
    nested = load_ssp(archive).simulate(25.0, 0.01)
    flat = load_ssp(pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / "flat.ssp")).simulate(25.0, 0.01)
    for inner, outer in (("command.shaper", "shaper"), ("machine.crane", "crane")):
        for name in (name for name in flat.values if name.startswith(f"{outer}.")):
            assert nested[name.replace(outer, inner, 1)].tobytes() == flat[name].tobytes()
    np.testing.assert_allclose(nested["swing"], np.degrees(flat["crane.swing_angle"]), rtol=1e-15)
    np.testing.assert_allclose(nested["load_error"], 1000.0 * flat["crane.load_position"] - 10_000.0, rtol=0.0, atol=4e-12)
    assert (nested.units["swing"], nested.units["load_error"]) == ("deg", "mm")


def test_a_run_agrees_with_the_reference(archive):
    with (FOLDER / "reference.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    expected = np.array(rows, float).T
    assert expected.shape == (5, 501)
    results = load_ssp(archive).simulate(25.0, 0.01, record=header[1:])
    assert set(results.values) == set(header[1:])
    for name, column in zip(header, expected, strict=True):
        np.testing.assert_allclose(results[name][::5], column, rtol=1e-11, atol=1e-11)  # 12 digits


@pytest.mark.parametrize(("variant", "row"), [(None, "| default |"), ("Hoisting", "| `Hoisting` | 1")])
def test_the_variants_leave_what_the_page_says(archive, variant, row):
    """The rows of the page's last table, to the digits that it prints."""
    (line,) = [text for text in (FOLDER / "README.md").read_text().splitlines() if text.startswith(row)]
    printed = [text.strip().removesuffix(" deg") for text in line.split("|")[2:4]]
    for sets, text in zip((["unshaped"], []), printed, strict=True):
        loaded = load_ssp(archive, variant)
        for which in sets:
            apply_parameter_set(loaded, which)
        results = loaded.simulate(25.0, 0.01)
        settled = np.flatnonzero(results["command.shaper.shaped_mean"])[-1] + 2
        swing = np.ptp(results["swing"][settled:]) / 2.0
        assert f"{swing:.{len(text.partition('.')[2])}f}" == text


def test_the_distance_is_set_in_its_own_unit(archive):
    loaded = load_ssp(archive)
    loaded.set("distance", "2500")
    assert loaded.system.start_values["command.profile"]["distance"] == 2.5
    end = loaded.simulate(25.0, 0.01, record=["load_error"])["load_error"][-1]
    assert end == pytest.approx(2500.0 - 10_000.0, abs=1.0)


def test_variants_sets_and_connectors_on_the_command_line(archive, tmp_path):
    """OSP's annotation alone asks for the algorithm of libcosim."""
    options = ["--variant", "Hoisting", "--parameter-set", "unshaped", "--set", "distance=2500", "--output", "r.csv"]
    done = typed("run", str(archive), *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    header, *rows = csv.reader((tmp_path / "r.csv").read_text().splitlines())
    last = dict(zip(header, map(float, rows[-1]), strict=True))
    assert last["command.profile.position"] == 2.5
    assert last["machine.crane.rope_length"] == pytest.approx(8.0 - 0.1 * 25.0, rel=1e-9)
    assert last["load_error"] == pytest.approx(1000.0 * last["machine.crane.load_position"] - 10_000.0, rel=1e-12)
    wrong = typed("run", str(archive), "--variant", "Hoisted", cwd=tmp_path)
    assert (wrong.returncode, "Did you mean 'Hoisting'?" in wrong.stderr) == (2, True)
    files = read_archive(archive.read_bytes(), archive.name)
    text = files["SystemStructure.ssd"].decode()
    begin, end = text.index("<oms:FixedStepMaster"), text.index("</oms:SimulationInformation>")
    files["SystemStructure.ssd"] = (text[:begin] + text[end:]).encode()
    write_archive(tmp_path / "osp.ssp", files)
    done = typed("run", "osp.ssp", "--stop-time", "1", cwd=tmp_path)
    assert "note: algorithm parallel, as the annotation of OSP says" in done.stderr


def test_a_sweep_over_its_inner_instances_gives_the_flat_cranes_metrics(archive, fmus, tmp_path):
    flat = pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / "flat.ssp")
    found = []
    for path, inner in ((flat, "crane"), (archive, "machine.crane")):
        study = Study(
            "rope", str(path), 25.0, 0.05, {f"{inner}.initial_rope_length": Vary(values=[6.0, 7.0], nominal=6.0)},
            {"swing": Peak(f"{inner}.swing_angle")}, {"as it is": {}},
        )  # fmt: skip
        run_study(study, tmp_path / f"{inner}.sqlite")
        with Store(tmp_path / f"{inner}.sqlite") as store:
            found.append([run.metrics["swing"] for run in store.runs("done")])
    assert len(found[0]) == 2
    assert found[0] == found[1]
