"""Parameter sets for whole systems: in the archive, in files, on the command line; and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import typed

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.ssp.archive import SspSystem, load_ssp, pack_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set, parameter_set_problems

FOLDER = Path(__file__).parents[2] / "ssp" / "pwm_mass_spring"


def ssv(*parameters: str) -> bytes:
    """A parameter set file; each parameter as 'name|element'."""
    lines = [f'<ssv:Parameter name="{name}">{element}</ssv:Parameter>' for name, element in (p.split("|") for p in parameters)]
    head = '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="t">'
    return f"{head}\n<ssv:Parameters>\n{chr(10).join(lines)}\n</ssv:Parameters></ssv:ParameterSet>".encode()


@pytest.fixture
def archive(fmus, tmp_path) -> Path:
    return pack_ssp(FOLDER, fmus, tmp_path / "pwm.ssp")


@pytest.fixture
def loaded(archive) -> SspSystem:
    return load_ssp(archive)


def test_the_folder_is_packed(archive):
    inside = [name for name in read_archive(archive.read_bytes(), "pwm.ssp") if name.startswith("parameter_sets/")]
    assert inside == [f"parameter_sets/{path.name}" for path in sorted((FOLDER / "parameter_sets").iterdir())]
    assert len(inside) >= 3


@pytest.mark.parametrize("which", ["short", "short.ssv", FOLDER / "parameter_sets" / "short.ssv"])
def test_a_set_goes_over_the_systems_own_values(loaded, which):
    before = {name: dict(values) for name, values in loaded.system.start_values.items()}
    apply_parameter_set(loaded, which)
    assert loaded.system.start_values["plant"] == before["plant"]
    assert loaded.system.start_values["train"] == {**before["train"], "design": 1, "duration": 0.1222}  # the rest is as it was


def test_enumerations_go_by_name_and_a_later_set_wins(loaded):
    apply_parameter_set(loaded, "zv")
    assert loaded.system.start_values["train"]["design"] == 6
    apply_parameter_set(loaded, "half_period")
    assert loaded.system.start_values["train"]["design"] == 1


def test_the_sets_of_the_archive_have_no_problems(loaded):
    assert parameter_set_problems(loaded) == []


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (
            ["duration|<ssv:Real value='1'/>"],
            r"line 3: parameter duration: the system has nothing called 'duration'.*Did you mean 'train.duration'\?",
        ),
        (["trian.duration|<ssv:Real value='1'/>"], r"line 3: .*'trian.duration'.*Did you mean 'train.duration'\?"),
        (["train.durration|<ssv:Real value='1'/>"], r"line 3: .*'train.durration'.*Did you mean 'train.duration'\?"),
        (
            ["train.duration|<ssv:Real value='long'/>"],
            "line 3: parameter train.duration -> train.duration: 'long' is not a value of kind real",
        ),
        (
            ["train.duration|<ssv:Real value='1' unit='ms'/>"],
            "line 3: parameter train.duration: unit 'ms' is not declared in Units",
        ),
        (
            ["plant.force|<ssv:Real value='1'/>"],
            "line 3: parameter plant.force -> plant.force: plant.force is fed by train.pulse; setting",
        ),
        (["train.duration|"], "line 3: element 'ssv:Parameter': Missing child element"),
    ],
)
def test_wrong_sets_are_refused_in_words_and_change_nothing(loaded, tmp_path, parameters, words):
    before = {name: dict(values) for name, values in loaded.system.start_values.items()}
    path = tmp_path / "wrong.ssv"
    path.write_bytes(ssv(*parameters, "plant.mass|<ssv:Real value='2'/>"))
    with pytest.raises(ModelError, match=rf"wrong\.ssv, {words}"):
        apply_parameter_set(loaded, path)
    assert loaded.system.start_values == before


def test_all_problems_are_told_at_once(loaded, tmp_path):
    (tmp_path / "wrong.ssv").write_bytes(ssv("mass|<ssv:Real value='1'/>", "plant.mas|<ssv:Real value='1'/>"))
    with pytest.raises(ModelError) as found:
        apply_parameter_set(loaded, tmp_path / "wrong.ssv")
    assert len(found.value.problems) == 2


def test_a_missing_set_names_the_nearest(loaded, archive, tmp_path):
    with pytest.raises(
        ArchiveError, match=r"shrot: there is no such file, and the archive has none of that name. Did you mean 'short'\?"
    ):
        apply_parameter_set(loaded, "shrot")
    files = read_archive(archive.read_bytes(), archive.name)
    without = {name: content for name, content in files.items() if not name.startswith("parameter_sets/")}
    with pytest.raises(ArchiveError, match="the archive has no parameter sets"):
        apply_parameter_set(load_ssp(write_archive(tmp_path / "without.ssp", without)), "short")


def test_a_file_that_is_no_set_is_refused(loaded, tmp_path):
    (tmp_path / "x.ssv").write_text("duration = 1")
    with pytest.raises(ArchiveError, match=r"x\.ssv: not well-formed"):
        apply_parameter_set(loaded, tmp_path / "x.ssv")
    with pytest.raises(ModelError, match=r"not an SSP parameter set"):
        apply_parameter_set(loaded, FOLDER / "SystemStructure.ssd")


def test_run_and_check_on_the_command_line(archive):
    options = ["--parameter-set", "short", "--set", "train.frequency_ratio=13", "--output", "r.csv"]
    done = typed("run", archive.name, *options, cwd=archive.parent)
    assert done.returncode == 0, done.stderr
    header, *rows = (archive.parent / "r.csv").read_text().splitlines()
    reference = [float(row.split(",")[header.split(",").index("train.reference")]) for row in rows]
    assert (
        reference.index(526.59234576) == 123
    )  # its end: first communication point, in ms, at or after the travel time of 122.2 ms
    missing = typed("run", archive.name, "--parameter-set", "shot", cwd=archive.parent)
    assert (missing.returncode, missing.stderr.count("\n")) == (2, 1)
    assert "Did you mean 'short'?" in missing.stderr
    files = read_archive(archive.read_bytes(), archive.name)
    files["parameter_sets/wrong.ssv"] = ssv("plant.mas|<ssv:Real value='1'/>")
    write_archive(archive.with_name("wrong.ssp"), files)
    checked = typed("check", "pwm.ssp", "wrong.ssp", cwd=archive.parent)
    assert checked.returncode == 1
    assert "wrong.ssp: parameter_sets/wrong.ssv, line 3: " in checked.stdout
    assert "pwm.ssp: " not in checked.stdout
