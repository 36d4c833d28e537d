"""One verdict: what `check` calls an error stops the reading or the run of an archive, in the same words, and nothing else does."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from broken_archives import BROKEN, PLANT, PROFILE, PULSE, SHAPER, part
from right_system import SSD, system_files, wrong_files
from ssp_archives import binding, component, connection, connectors, ssd, ssv, system
from test_ssp_check import changed_at_random
from wrong_systems import WRONG

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.errors import ArchiveError, ModelError, ShaperFmuError
from shaper_fmu.master.run_options import number_of_steps
from shaper_fmu.ssp.archive import load_ssp, variants
from shaper_fmu.ssp.check import file_findings
from shaper_fmu.ssp.findings import Finding, Weight
from shaper_fmu.ssp.loaded import SspSystem
from shaper_fmu.ssp.parameter_sets import apply_parameter_set

OF_THE_FMU = ("the FMU's m", "not a finite number")
"""Values outside of its limits an FMU may refuse when it runs, as ours do, or take."""
WEIGHTS = {"load": Weight.LOAD, "run": Weight.RUN}


@pytest.fixture(scope="module")
def right(fmus) -> dict[str, bytes]:
    return system_files(fmus)


@pytest.fixture(scope="module")
def parts(fmus) -> dict[str, bytes]:
    return {f"resources/{name}.fmu": (fmus / f"{name}.fmu").read_bytes() for name in (PLANT, PULSE, PROFILE, SHAPER)}


def broken(name: str, parts: dict[str, bytes]) -> dict[str, bytes]:
    """The files of an archive of broken_archives.py."""
    case = BROKEN[name]
    files = {**parts, SSD: ssd(case.root, case.version), **case.files}
    if case.change is not None:
        case.change(files)
    return files


def run(loaded: SspSystem) -> None:
    """What the command does, as far as it is checked, and a first step."""
    structure = loaded.structure
    start, stop, step = structure.start_time or 0.0, structure.stop_time or 1.0, structure.step_size or 0.01
    number_of_steps(loaded.system, start, stop, step)
    loaded.simulate(start + step, step, start_time=start)


def loaded_variants(files: dict[str, bytes], path: Path) -> tuple[list[str], list[SspSystem]]:
    """What loading the variants of an archive says where it is refused, and those that can be loaded."""
    said, found = [], []
    write_archive(path, files)
    for variant in variants(files):
        try:
            found.append(load_ssp(path, variant))
        except ModelError as error:
            said += error.problems
        except ArchiveError as error:
            said.append(str(error))
    return said, found


def _is_refused(loaded: SspSystem, path: Path) -> bool:
    try:
        run(loaded)
        for name in loaded.parameter_sets:
            apply_parameter_set(load_ssp(path), name)
    except ShaperFmuError:
        return True
    return False


def check_loading(files: dict[str, bytes], path: Path) -> tuple[list[Finding], list[SspSystem]]:
    """Compare the findings with what loading says; returns them, and what can be loaded."""
    found = file_findings(files)
    said, loaded = loaded_variants(files, path)
    assert sorted(set(said)) == sorted({str(finding) for finding in found if finding.weight == Weight.LOAD})
    told = {str(finding) for finding in found}
    assert all({str(finding) for finding in one.findings} <= told for one in loaded)
    return found, [] if said else loaded


def check_doors(files: dict[str, bytes], path: Path) -> list[Finding]:
    """Compare the findings with what loading and running say; returns them."""
    found, loaded = check_loading(files, path)
    if loaded and not any(words in finding.message for finding in found for words in OF_THE_FMU):
        assert _is_refused(loaded[0], path) == any(finding.weight == Weight.RUN for finding in found)
    return found


@pytest.mark.parametrize("name", WRONG)
def test_what_check_calls_an_error_stops_a_wrong_system(right, tmp_path, name):
    assert check_doors(wrong_files(WRONG[name], right), tmp_path / "wrong.ssp")


@pytest.mark.parametrize("name", BROKEN)
def test_what_check_calls_an_error_stops_a_broken_archive(parts, tmp_path, name):
    """And what it calls a note is told and does not; nothing else is told."""
    found = check_doors(broken(name, parts), tmp_path / "broken.ssp")
    left = list(found)
    for words, weight in BROKEN[name].found.items():
        (one,) = [finding for finding in found if words in str(finding)]
        assert one.weight == WEIGHTS.get(weight, one.weight)
        assert one.stops == (weight in WEIGHTS)
        left.remove(one)
    assert [str(one) for one in left if one.stops] == []


def test_whatever_is_changed_has_one_verdict(right, tmp_path):
    """Elements and attributes taken away, doubled, moved, renamed: never a crash, nor two answers."""
    chance, loadable = random.Random(20091), 0
    for _ in range(200):
        found, loaded = check_loading(changed_at_random(right, chance), tmp_path / "changed.ssp")
        loadable += bool(loaded)
        assert bool(loaded) != any(finding.weight == Weight.LOAD for finding in found)
    assert 20 < loadable < 180


def load(parts: dict[str, bytes], folder: Path, root: str, **files: bytes) -> SspSystem:
    content = {key.replace("__", "/").replace("_", "."): value for key, value in files.items()}
    return load_ssp(write_archive(folder / "x.ssp", {**parts, SSD: ssd(root), **content}))


def test_notes_tell_what_is_borne(parts, tmp_path):
    """A value that nothing takes in full, the rest in one note; and all of it as findings."""
    loaded = load(parts, tmp_path, system("", component("train", PULSE) + component("plant", PLANT, binding("mas Real 1")), connection("train.pulse", "plant.force")))  # fmt: skip
    value, rest = loaded.notes
    assert value.endswith("parameter mas: plant has nothing called 'mas', so the value has no effect. Did you mean 'mass'?")
    assert rest.startswith(
        "x.ssp deviates from the standard, but can be run ('shaper-fmu check' lists all): SystemStructure.ssd, line"
    )
    assert "train has no connector 'pulse'" in rest
    assert "plant has no connector 'force'" in rest
    assert [finding.weight for finding in loaded.findings if "has no connector" in finding.message] == [Weight.DEVIATION] * 2


def test_a_source_counts_more_than_what_is_inline(parts, tmp_path):
    """SSP 1.0, section 5.4.5: values are inline only if there is no source."""
    both = binding("mass Real 2").replace("<ssd:ParameterBinding", '<ssd:ParameterBinding source="p.ssv"')
    loaded = load(parts, tmp_path, system("", component("plant", PLANT, both)), p_ssv=ssv("mass Real 3").encode())
    assert loaded.system.start_values["plant"]["mass"] == 3.0
    assert any("parameter binding of plant has both a source and values inline" in note for note in loaded.notes)


def test_a_set_inside_an_fmu_is_found(parts, tmp_path):
    """`sourceBase="component"`: relative to the component, which is the FMU, not its path in the archive."""
    path = f"resources/{PLANT}.fmu"
    inner = {**read_archive(parts[path], path), "resources/own.ssv": ssv("mass Real 7").encode()}
    files = {**parts, path: write_archive(tmp_path / "plant.fmu", inner).read_bytes()}
    bound = '<ssd:ParameterBinding source="resources/own.ssv" sourceBase="component"/>'
    loaded = load(files, tmp_path, system("", component("plant", PLANT, bound)))
    assert loaded.system.start_values["plant"]["mass"] == 7.0
    assert loaded.findings == ()
    assert file_findings({**files, SSD: ssd(system("", component("plant", PLANT, bound)))}) == []


def test_units_of_one_name_that_two_files_define_otherwise_are_told(parts, tmp_path):
    """The FMU's N is kg m/s2, the description's is here m: no conversion is made up, and it is no secret."""
    root = system(connectors("force input N"), component("plant", PLANT), connection("force", "plant.force"))
    text = ssd(root).replace(b'<ssc:BaseUnit kg="1" m="1" s="-2"/>', b'<ssc:BaseUnit m="1"/>')
    loaded = load_ssp(write_archive(tmp_path / "x.ssp", {**parts, SSD: text}))
    assert any("force -> plant.force: unit N does not convert to N" in str(finding) for finding in loaded.findings)


def test_a_declared_unit_counts_where_the_fmu_tells_none(parts, tmp_path):
    """By the standard's schema of units: the FMU's is the default. The pulse has none, so that one of kN is 1000 N."""
    pushed = part("train", PULSE, "pulse output kN"), part("plant", PLANT, "force input N")
    loaded = load(parts, tmp_path, system("", "".join(pushed), connection("train.pulse", "plant.force")))
    assert loaded.system.unit(("train", "pulse")) == ""
    assert loaded.system.scalings == {("plant", "force"): (1000.0, 0.0)}
    pushed = part("train", PULSE, "pulse output m"), part("plant", PLANT, "force input N")
    with pytest.raises(ModelError, match=r"train\.pulse -> plant\.force: unit m does not convert to N"):
        load(parts, tmp_path, system("", "".join(pushed), connection("train.pulse", "plant.force")))


def test_a_library_that_is_cut_off_is_told(parts, tmp_path):
    """A run refuses it, since to load it would end the process."""
    path = f"resources/{PLANT}.fmu"
    inner = read_archive(parts[path], path)
    for name in (name for name in inner if name.startswith("binaries/")):
        inner[name] = inner[name][: len(inner[name]) // 2]
    files = {**parts, path: write_archive(tmp_path / "plant.fmu", inner).read_bytes()}
    (found,) = check_doors({**files, SSD: ssd(system("", component("plant", PLANT)))}, tmp_path / "x.ssp")
    assert found.weight == Weight.RUN
    assert found.message.startswith("component 'plant': MassSpringDamper.fmu: ")
    assert "is cut off: it has" in found.message


def test_a_run_of_no_length_is_no_error(parts, tmp_path):
    """The master takes it; the check says that the end is not after the beginning."""
    text = ssd(system("", component("plant", PLANT))).replace(b'stopTime="1"', b'stopTime="0"')
    (found,) = file_findings({**parts, SSD: text})
    assert (found.weight, "stopTime = 0 s is not after startTime = 0 s" in found.message) == (Weight.DEVIATION, True)
    load_ssp(write_archive(tmp_path / "x.ssp", {**parts, SSD: text})).simulate(0.0, 0.1)


def test_a_description_in_itself_is_refused_by_both(parts, tmp_path):
    element = '<ssd:Component name="{}" type="application/x-ssp-definition" source="SystemStructure.ssd"/>'
    for names, words in (("a", "system 'a' is nested deeper than 32 levels, or in itself"), ("ab", "more than 20000 elements")):
        files = {**parts, SSD: ssd(system("", "".join(element.format(name) for name in names)))}
        assert words in " ".join(str(finding) for finding in check_doors(files, tmp_path / "x.ssp") if finding.stops)


def test_a_fault_of_a_part_is_told_once_under_its_file(parts):
    """Whether it is read as a variant of its own or as a part of another: in the words of its file."""
    inner = ssd(system(connectors("f input"), component("plant", PLANT), connection("f", "plant.forze")))
    kind = 'type="application/x-ssp-definition"'
    twice = "".join(f'<ssd:Component name="{name}" {kind} source="part.ssd"/>' for name in ("one", "two"))
    found = [str(finding) for finding in file_findings({**parts, SSD: ssd(system("", twice)), "part.ssd": inner}) if finding.stops]
    assert len(found) == 1
    assert found[0].startswith("part.ssd, line 3: connection to plant.forze: plant has no connector 'forze'.")
