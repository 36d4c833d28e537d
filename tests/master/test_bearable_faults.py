"""Descriptions of others with faults that do not matter for a run: it goes on as if there were none, and says so once; `check` tells all."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import fmpy
import pytest
from bearable_faults import FAULTS2, FAULTS3
from faulty_fmus import description2, description3, library, library_path

from shaper_fmu import Simulation, System
from shaper_fmu.errors import ArchiveError, ModelError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.fmu import fmu_problems, load_fmu
from shaper_fmu.metrics.final import Final

CASES = [(2, name) for name in FAULTS2] + [(3, name) for name in FAULTS3]


def packed(path: Path, version: int, text: str, binary: Path | None = None, **more: bytes) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text.encode("utf-8"))
        archive.write(binary or library(f"faulty{version}"), library_path(version))
        for name, content in more.items():
            archive.writestr(name, content)
    return path


def described(version: int) -> str:
    """The description, whose inputs act on the outputs at once in FMI 3.0."""
    return description3("{faulty}") if version == 3 else description2("{faulty}")


def outputs(path: Path) -> tuple[dict[str, list[float]], list[str]]:
    system = System()
    system.add("x", path, input=3.0)
    found = system.simulate(0.5, 0.1, record=["x.output", "x.count_out"])
    notes = [note for note in found.notes if "deviates from the standard" in note]
    return {name: values.tolist() for name, values in found.values.items()}, notes


@pytest.fixture(scope="module")
def right(tmp_path_factory) -> dict[int, dict[str, list[float]]]:
    """What the FMUs give whose descriptions are right."""
    folder = tmp_path_factory.mktemp("right")
    found = {}
    for version in (2, 3):
        found[version], notes = outputs(packed(folder / f"right{version}.fmu", version, described(version)))
        assert notes == []
    assert (
        found[2] == {"x.output": [0.0, 2.0, 4.0, 6.0, 8.0, 10.0], "x.count_out": [0, 0, 0, 0, 0, 0]} or found[2]["x.output"][-1] > 0
    )
    return found


@pytest.mark.parametrize(("version", "name"), CASES)
def test_a_fault_that_does_no_harm_is_told_and_borne(version, name, tmp_path, right):
    change, words = (FAULTS3 if version == 3 else FAULTS2)[name]
    path = packed(tmp_path / "other.fmu", version, change(described(version)))
    found, notes = outputs(path)
    assert found == right[version]
    assert len(notes) == 1
    assert notes[0].startswith("other.fmu deviates from the standard, but can be run ('shaper-fmu check' lists all): ")
    problems = fmu_problems(path)
    assert any(re.search(words, problem) for problem in problems), problems
    assert not any("\n" in problem for problem in problems)


@pytest.mark.parametrize("version", [2, 3])
def test_bytes_that_are_no_utf8_are_read_as_windows_1252(version, tmp_path, right):
    text = described(version).replace('modelName="faulty"', 'modelName="Prüfstand"')
    path = packed(tmp_path / "other.fmu", version, "")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text.encode("cp1252"))
        archive.write(library(f"faulty{version}"), library_path(version))
    assert outputs(path)[0] == right[version]
    assert fmu_problems(path) == ["it is not in its declared encoding; read as cp1252"]
    assert load_fmu(path).description.modelName == "Prüfstand"


def test_two_variables_of_one_name_cannot_be_used_by_it(tmp_path):
    text = described(2).replace('name="count_out"', 'name="output"')
    system = System()
    system.add("x", packed(tmp_path / "twice.fmu", 2, text))
    with pytest.raises(ModelError, match=r"x\.output: twice\.fmu has no variable 'output'"):
        system.ports(["x.output"])
    assert list(system.simulate(0.2, 0.1).values) == ["x.flag_out"]


def test_entries_of_an_archive_that_mean_nothing_are_left_out(tmp_path, right):
    """The folder itself, what macOS adds, and backslashes of old tools on Windows."""
    more = {
        "./": b"",
        "__MACOSX/._modelDescription.xml": b"\0",
        "__MACOSX/Icon\r": b"",
        ".DS_Store": b"",
        "resources\\data\\a.txt": b"abc",
    }
    path = packed(tmp_path / "other.fmu", 2, described(2), None, **more)
    found, notes = outputs(path)
    assert found == right[2]
    fmu = load_fmu(path)
    kept = sorted(p.relative_to(fmu.folder).as_posix() for p in fmu.folder.rglob("*") if p.is_file())
    assert kept == [library_path(2), "modelDescription.xml", "resources/data/a.txt"]
    assert fmu_problems(path) == ["the entry 'resources\\\\data\\\\a.txt' has a backslash, read as /"]
    assert len(notes) == 1


def without(folder: Path, version: int, *functions: str) -> Path:
    """The FMU, whose library has these functions under other names."""
    content = library(f"faulty{version}").read_bytes()
    for name in functions:
        assert f"\0{name}\0".encode() in content
        content = content.replace(f"\0{name}\0".encode(), f"\0x{name[1:]}\0".encode())
    binary = folder / f"faulty{fmpy.sharedLibraryExtension}"
    binary.write_bytes(content)
    return packed(folder / "without.fmu", version, described(version), binary)


@pytest.mark.parametrize(
    ("version", "functions"),
    [
        (
            2,
            (
                "fmi2GetStringStatus",
                "fmi2Reset",
                "fmi2GetDirectionalDerivative",
                "fmi2CancelStep",
                "fmi2Terminate",
                "fmi2SetBoolean",
            ),
        ),
        (
            3,
            (
                "fmi3Reset",
                "fmi3GetDirectionalDerivative",
                "fmi3GetClock",
                "fmi3Terminate",
                "fmi3SetBoolean",
                "fmi3InstantiateModelExchange",
            ),
        ),
    ],
)
def test_functions_that_are_never_called_may_be_missing(version, functions, tmp_path, right):
    assert outputs(without(tmp_path, version, *functions))[0] == right[version]


@pytest.mark.parametrize("version", [2, 3])
def test_a_missing_function_that_is_called_is_told(version, tmp_path):
    """None is called at address 0: neither of those that every run needs, nor of those that this one does."""
    for name in ("DoStep", "EnterInitializationMode", f"Instantiate{'CoSimulation' if version == 3 else ''}"):
        path = without(tmp_path, version, f"fmi{version}{name}")
        with pytest.raises(
            SimulationError, match=rf"x: without\.fmu cannot be instantiated: its library lacks a function: fmi{version}{name}$"
        ):
            outputs(path)
    system = System()
    system.add("x", without(tmp_path, version, f"fmi{version}SetBoolean"))
    system.drive("x.flag_in", 1.0)
    with pytest.raises(ModelError, match=f"x: the library of without.fmu lacks the function fmi{version}SetBoolean"):
        system.simulate(0.2, 0.1)
    system = System()
    system.add("x", without(tmp_path, version, f"fmi{version}Reset"))
    with Simulation(system) as simulation:
        simulation.run(0.2, 0.1)
        with pytest.raises(SimulationError, match=f"lacks the function fmi{version}Reset"):
            simulation.run(0.2, 0.1)
    with pytest.raises(ModelError, match=r"lack the function to reset them need Simulation\.run"):
        Batch(system, Plan(stop_time=0.2, step=0.1), {"last": Final("x.output")}, [])


def test_a_file_that_is_there_twice_with_one_content_is_one(tmp_path, right):
    path = packed(tmp_path / "other.fmu", 2, described(2))
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("modelDescription.xml", described(2))
    assert outputs(path)[0] == right[2]
    assert fmu_problems(path) == ["the entry 'modelDescription.xml' is there 2 times, always the same"]
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
        archive.writestr("modelDescription.xml", described(2) + " ")
    with pytest.raises(ArchiveError, match=r"entry 'modelDescription\.xml' is there twice"):
        fmu_problems(path)
