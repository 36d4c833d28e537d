"""Why a system cannot be packed: each reason with what to do."""

from __future__ import annotations

from pathlib import Path

import pytest
from bare_fmus import CO, bare_fmu, fmi_1, fmi_2
from rich_fmus import THREE, rich_fmu

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.container.obstacles import obstacles
from shaper_fmu.master.structure import SystemStructure

ALL = ("linux64/bare.so", "win64/bare.dll", "darwin64/bare.dylib")
BALL = '<ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>'


def with_libraries(path: Path, *files: str) -> Path:
    """The FMU with libraries that nobody loads."""
    content = read_archive(path.read_bytes(), path.name)
    return write_archive(path, {**content, **{f"binaries/{file}": b"\xca\xfe\xba\xbe" for file in files}})


def plain(folder: Path, name: str, *files: str, kinds: str = CO) -> Path:
    return with_libraries(fmi_2(folder / f"{name}.fmu", kinds, BALL), *(files or ALL))


def told(path: Path, **options: object) -> list[str]:
    system = SystemStructure()
    system.add("plant", path, **options)
    return obstacles(system, 2)


def test_nothing_stands_against_fmus_with_libraries(tmp_path):
    assert told(plain(tmp_path, "a")) == []


@pytest.mark.parametrize("slave", [True, False])
def test_fmi_1_is_refused(tmp_path, slave):
    (problem,) = [
        text for text in told(with_libraries(fmi_1(tmp_path / "tank.fmu", slave), "linux64/tank.so")) if "FMI 1.0" in text
    ]
    assert problem == "plant: tank.fmu is of FMI 1.0, which a container cannot run: export it as FMI 2.0 or 3.0"


def test_model_exchange_is_refused(tmp_path):
    exchange = '<ModelExchange modelIdentifier="bare"/>'
    reason = "plant: {}.fmu is used by model exchange, which needs the master's solver: "
    assert told(plain(tmp_path, "one", kinds=exchange)) == [reason.format("one") + "export it for co-simulation"]
    chosen = told(plain(tmp_path, "two", kinds=exchange + CO), interface="model_exchange")
    assert chosen == [reason.format("two") + "use it by co-simulation"]


def test_an_fmu_that_needs_its_tool_is_no_obstacle(tmp_path):
    kinds = '<CoSimulation modelIdentifier="bare" needsExecutionTool="true"/>'
    assert told(plain(tmp_path, "a", kinds=kinds)) == []  # it is told, see test_an_fmu_that_needs_a_tool


def test_inputs_that_python_drives_are_refused(tmp_path):
    system = SystemStructure()
    path = with_libraries(rich_fmu(tmp_path, 2), "linux64/rich.so")
    system.add("a", path)
    system.drive("a.angle", lambda t: t)
    system.drive("a.on", ([0.0, 1.0], [0.0, 1.0]))
    assert obstacles(system, 3) == [
        "a.angle is driven by a function of Python, which a container does not have: give a table, or leave it free",
        "a.on is driven by a table of values that are not real numbers, which only the master reads: leave it free",
    ]
    driven = SystemStructure()
    driven.add("a", path)
    driven.drive("a.angle", ([0.0, 1.0], [0.0, 1.0]))
    assert obstacles(driven, 3) == []


def test_a_platform_must_be_common_to_all(tmp_path):
    """FMI 2.0 and 3.0 call the folders differently; darwin64 may be for both processors, and begins so then."""
    three = bare_fmu(tmp_path / "three.fmu", THREE)
    system = SystemStructure()
    system.add("windows", plain(tmp_path, "a", "win64/bare.dll"))
    system.add("linux", with_libraries(three, "x86_64-linux/rich.so", "aarch64-linux/rich.so"))
    (problem,) = obstacles(system, 2)
    assert problem == (
        "there is no platform for which all FMUs have a library: windows has x86_64-windows; linux has x86_64-linux, aarch64-linux"
    )
    system.add("none", plain(tmp_path, "b", "linux64/other.so"))
    assert obstacles(system, 2) == ["none: b.fmu has no library bare for a platform that is known here; it has linux64/other.so"]
    shared = SystemStructure()
    shared.add("a", plain(tmp_path, "c", "darwin64/bare.dylib"))
    shared.add("b", with_libraries(bare_fmu(tmp_path / "four.fmu", THREE.replace("x2", "x3")), "aarch64-darwin/rich.dylib"))
    assert obstacles(shared, 2) == []


def test_the_version_must_be_one_that_containers_have(tmp_path):
    system = SystemStructure()
    system.add("a", plain(tmp_path, "a"))
    assert obstacles(system, 1) == ["a container is of FMI 2.0 or 3.0 (fmi=2 or fmi=3), not 1"]
