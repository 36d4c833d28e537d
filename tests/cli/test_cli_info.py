"""`shaper-fmu info`: what it tells of FMUs of all versions and kinds and of systems, and that each refusal is the command's own."""

from __future__ import annotations

import json
import os
import pty
import re
import shutil
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import pytest
from bare_fmus import CO, ME, ONE, SCHEDULED, STANDALONE, bare_fmu, fmi_1, fmi_2, fmi_3, large
from command_line import MAIN, typed

from shaper_fmu.archives import write_archive
from shaper_fmu.export.build import build_fmu
from shaper_fmu.export.model_description import visible_variables
from shaper_fmu.info import fmu_info, ssp_info
from shaper_fmu.registry import components
from shaper_fmu.ssp.archive import pack_ssp

SYSTEMS = Path(__file__).parents[2] / "ssp"
FOLDERS = sorted(path.name for path in SYSTEMS.iterdir() if (path / "SystemStructure.ssd").is_file())


def shown(path: Path | str, *options: str, cwd: Path) -> str:
    done = typed("info", path, *options, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    return done.stdout


def facts(path: Path | str, *options: str, cwd: Path) -> dict[str, Any]:
    return json.loads(shown(path, "--json", *options, cwd=cwd))


def answers(found: dict[str, Any]) -> dict[str, str]:
    return {one["command"]: one["takes"] for one in found["commands"]}


def reasons(found: dict[str, Any]) -> dict[str, str]:
    return {one["command"]: one["reason"] for one in found["commands"]}


@pytest.fixture(scope="module")
def archives(fmus, tmp_path_factory) -> Path:
    """A folder with the archives of ssp/."""
    folder = tmp_path_factory.mktemp("archives")
    for name in FOLDERS:
        pack_ssp(SYSTEMS / name, fmus, folder / f"{name}.ssp", ["this"])
    return folder


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["InputShaper", "OverheadCrane", "ThreeMassChain"])
def test_our_components(name, version, tmp_path):
    """Variables, states and kinds are those that the component declares."""
    component = components()[name]
    found = fmu_info(build_fmu(component, tmp_path, fmi=version, platforms=["this"]))
    declared = visible_variables(component)
    for causality, variables in (("input", found.inputs), ("output", found.outputs), ("parameter", found.parameters)):
        own = [v for v in declared if v.causality == causality]
        scalars = sum(v.size or 1 for v in own)
        assert len(variables) == (scalars if version == 2 else len(own))
        units = {re.sub(r"\[\d+\]$", "", v.name): v.unit for v in variables}
        assert units == {v.name: v.unit for v in own}
    assert found.fmi_version == f"{version}.0"
    assert found.kinds == ["co-simulation", "model exchange"]
    assert found.continuous_states == {"InputShaper": 0, "OverheadCrane": 5, "ThreeMassChain": 6}[name]  # docs/plants
    assert [one.is_this for one in found.libraries] == [True]
    assert found.sources > 0
    assert found.findings == []


def test_start_values(fmus):
    """The shaper's start values are those of its class; an enumeration's is a number, shown by its item's name."""
    found = {v.name: v for v in fmu_info(fmus / "InputShaper.fmu").parameters}
    assert found["shaper"].start == 2
    assert found["shaper"].items["zv"] == 2
    assert found["modes"].start == 1
    assert (found["vibration_tolerance"].start, found["vibration_tolerance"].unit) == (0.05, "")
    assert re.search(r"│ shaper +│ Enumeration +│ +│ zv +│", shown(fmus / "InputShaper.fmu", cwd=fmus))


@pytest.mark.parametrize("co_simulation", [True, False])
def test_fmi_1(co_simulation, tmp_path):
    """FMI 1.0 keeps parameters among the internal variables, units in types, and capabilities apart."""
    found = facts(fmi_1(tmp_path / "tank.fmu", co_simulation), cwd=tmp_path)
    kind = "co-simulation" if co_simulation else "model exchange"
    capabilities = {"canHandleVariableCommunicationStepSize": True, "maxOutputDerivativeOrder": 1.0} if co_simulation else {}
    assert found["interfaces"] == [{"kind": kind, "identifier": "tank", "capabilities": capabilities}]
    assert (found["tool"], found["fmi_version"]) == ("Old Tool 7.1", "1.0")
    assert (found["continuous_states"], found["event_indicators"], found["others"]) == (2, 3, {"local": 1})
    assert [(v["name"], v["unit"], v["start"]) for v in found["inputs"]] == [("flow", "m3/s", 0.25)]
    assert [(v["name"], v["unit"], v["start"]) for v in found["parameters"]] == [("area", "m2", 2.0), ("valve", "", 2)]
    assert found["parameters"][1]["items"] == {"open": 1, "shut": 2}
    text = shown("tank.fmu", cwd=tmp_path)
    assert re.search(rf"^FMI +1\.0, {kind} only$", text, re.MULTILINE)
    assert re.search(r"│ valve +│ Enumeration │ +│ shut", text)


def test_fmi_1_of_a_tool(tmp_path):
    """An FMU of FMI 1.0 that starts its tool: FMI 2.0 calls that needsExecutionTool."""
    bare_fmu(tmp_path / "tank.fmu", ONE.replace("{more}", STANDALONE.replace("StandAlone", "Tool")))
    assert facts("tank.fmu", cwd=tmp_path)["interfaces"][0]["capabilities"]["needsExecutionTool"] is True


KINDS = {
    "co-simulation": (2, CO),
    "model exchange": (2, ME),
    "co-simulation, model exchange": (2, CO + ME),
    "scheduled execution": (3, SCHEDULED),
    "co-simulation, model exchange, scheduled execution": (3, ME + CO + SCHEDULED),
    "of no kind": (2, ""),
}


@pytest.mark.parametrize("kinds", KINDS)
def test_kinds(kinds, tmp_path):
    version, declared = KINDS[kinds]
    (fmi_2 if version == 2 else fmi_3)(tmp_path / "bare.fmu", declared)
    only = "" if "," in kinds or kinds == "of no kind" else " only"
    assert re.search(rf"^FMI +{version}\.0, {kinds}{only}$", shown("bare.fmu", cwd=tmp_path), re.MULTILINE)


def test_arrays_are_counted_by_their_elements(tmp_path):
    """n = 3: the derivative of 3 x 2 states, 3 event indicators."""
    found = fmu_info(fmi_3(tmp_path / "rows.fmu", CO + ME))
    assert (found.continuous_states, found.event_indicators) == (6, 3)
    assert found.outputs[0].dimensions == ["n", 2]
    assert [(v.name, v.causality, v.start) for v in found.parameters] == [
        ("n", "structuralParameter", 3),
        ("gains", "parameter", [1.0, 2.0, 3.0]),
    ]
    text = shown("rows.fmu", cwd=tmp_path)
    assert "Float64[n][2]" in text
    assert "Float64[n], tunable" in text


def refusal(words: list[str], cwd: Path) -> str:
    """What a command that refuses its arguments or a file prints; "" if it does its work."""
    done = typed(*words, cwd=cwd)
    return " ".join(done.stderr.split()) if done.returncode else ""


def test_refusals_are_those_of_the_commands(fmus, archives, tmp_path):
    """Whatever is refused or taken today: each command, given the same file, does it, and says the reason."""
    fmi_1(tmp_path / "one.fmu", False)
    fmi_2(tmp_path / "me.fmu", ME)
    fmi_3(tmp_path / "scheduled.fmu", SCHEDULED)
    fmi_2(tmp_path / "bare.fmu", CO)
    shutil.copy(fmus / "MassSpringDamper.fmu", tmp_path)
    shutil.copy(fmus / "MotionProfile.fmu", tmp_path)
    shutil.copy(archives / "overhead_crane.ssp", tmp_path)
    write_archive(tmp_path / "lacking.ssp", {"SystemStructure.ssd": (SYSTEMS / "overhead_crane/SystemStructure.ssd").read_bytes()})
    refused = 0
    for path in sorted(tmp_path.iterdir()):
        found = facts(path.name, cwd=tmp_path)
        ports = [next((v["name"] for v in found.get(kind, ())), "none") for kind in ("inputs", "outputs")]
        new = ["new", "system", "--plant", path.name, "--input", ports[0], "--output", ports[1], "--output-file", "x.ssp"]
        said = {"new system": refusal(new, tmp_path), "build": refusal(["build", path.name], tmp_path)}
        if answers(found)["tune"] == "no":
            said["tune"] = refusal(["tune", path.name, "--input", ports[0]], tmp_path)
        said["run"] = refusal(
            ["run", path.name, *([] if path.suffix == ".ssp" else ["--until", "0.01", "--step", "0.01"])], tmp_path
        )
        for command, words in said.items():
            assert (answers(found)[command] == "no") == bool(words), f"{command} {path.name}: {words}"
            reason = reasons(found)[command]
            if words and not re.search("it has no|has no library", reason):  # where the input or the library is named, too
                assert reason.split("; ")[0].split(". ")[0] in words, f"{command} {path.name}"
                refused += 1
        (tmp_path / "x.ssp").unlink(missing_ok=True)
    assert refused > 10


def test_an_fmu_runs_in_the_system_that_new_writes(fmus, tmp_path):
    found = facts(fmus / "MassSpringDamper.fmu", cwd=tmp_path)
    assert answers(found) == {
        "check": "yes", "run": "yes", "sweep": "in a system", "pack": "in a system", "tune": "yes", "wrap": "yes",
        "new system": "yes", "build": "no",
    }  # fmt: skip
    assert "--input force" in reasons(found)["tune"]
    names = ["--input", "force", "--output", "position", "--output-file", "shaped.ssp"]
    assert typed("new", "system", "--plant", fmus / "MassSpringDamper.fmu", *names, cwd=tmp_path).returncode == 0
    assert answers(facts("shaped.ssp", cwd=tmp_path))["run"] == "yes"


def test_an_fmu_for_another_machine(fmus, tmp_path):
    with zipfile.ZipFile(fmus / "MassSpringDamper.fmu") as archive:
        files = {name.replace("linux64", "amiga"): archive.read(name) for name in archive.namelist()}
    write_archive(tmp_path / "other.fmu", files)
    found = facts("other.fmu", cwd=tmp_path)
    assert [one["is_this"] for one in found["libraries"]] == [False]
    assert answers(found)["run"] == answers(found)["tune"] == "no"
    assert "no library for this machine" in reasons(found)["run"]
    assert "amiga" in reasons(found)["tune"]


@pytest.mark.parametrize("name", FOLDERS)
def test_our_systems(name, archives):
    """Components and connections are those of the file, and nothing is found."""
    found = facts(f"{name}.ssp", cwd=archives)
    text = (SYSTEMS / name / "SystemStructure.ssd").read_text()
    system = found["system"]
    inside = [*system["elements"], *(one for outer in system["elements"] for one in outer["elements"])]
    assert {one["name"] for one in inside} >= set(re.findall(r'<ssd:Component name="(\w+)"', text))
    connections = [*system["connections"], *(one for outer in system["elements"] for one in outer["connections"])]
    assert len(connections) >= text.count("<ssd:Connection ") > 0
    assert all(one["laid"] for one in system["connections"])
    assert [one["source"] for one in found["parameter_sets"]] == sorted(p.name for p in (SYSTEMS / name).glob("parameter_sets/*"))
    assert found["findings"] == []
    assert (answers(found)["check"], answers(found)["run"], answers(found)["sweep"]) == ("yes", "yes", "yes")
    shown(f"{name}.ssp", cwd=archives)


def test_the_tree_of_nested_systems(archives):
    text = shown("nested_crane.ssp", cwd=archives)
    assert "├── command (system of resources/command.ssd)\n" in text
    assert "│   └── shaper: InputShaper.fmu\n" in text
    assert "    └── crane: resources/OverheadCrane.fmu\n" in text
    assert "bus.trolley_acceleration [mm/s2] -> crane.trolley_acceleration [m/s2]\n" in text
    assert "machine.load_position [m] -> load_error [mm] (1 * value + -10000)\n" in text
    assert "parameter set unshaped.ssv: command.shaper.shaper = none\n" in text
    assert re.search(r"^variant +SystemStructure.ssd; others: Hoisting.ssd$", text, re.MULTILINE)
    other = shown("nested_crane.ssp", "--variant", "Hoisting", cwd=archives)
    assert re.search(r"^variant +Hoisting.ssd; others: SystemStructure.ssd$", other, re.MULTILINE)


def test_folders_and_descriptions(fmus, tmp_path):
    """A folder is shown with the FMUs that `build` would take, and `build` says what it would."""
    shutil.copytree(SYSTEMS / "overhead_crane", tmp_path / "crane")
    lacking = facts("crane", cwd=tmp_path)
    assert "fmus/" in reasons(lacking)["build"]
    assert answers(lacking)["run"] == "yes"  # it builds what is missing
    assert lacking["fmus"] == {}
    (tmp_path / "fmus").symlink_to(fmus)
    there = facts("crane", cwd=tmp_path)
    assert (answers(there)["build"], reasons(there)["build"]) == ("yes", "writes crane.ssp")
    assert "resources/OverheadCrane.fmu" in there["fmus"]
    assert typed("build", "crane", cwd=tmp_path).returncode == 0
    described = facts("crane/SystemStructure.ssd", cwd=tmp_path)
    assert described["system"] == there["system"] == facts("crane.ssp", cwd=tmp_path)["system"]
    shutil.copytree(SYSTEMS / "two_part_pendulum", tmp_path / "pendulum")
    assert "no FMU: it is not built yet; build makes it\n" in shown("pendulum", cwd=tmp_path)


def test_wrong_connections_are_shown_as_such(archives, tmp_path):
    with_fault = ssp_info(archives / "overhead_crane.ssp")
    first = with_fault.system.connections[0]
    shutil.copytree(SYSTEMS / "overhead_crane", tmp_path / "crane")
    file = tmp_path / "crane" / "SystemStructure.ssd"
    connector = first.target.split(".")[-1]
    file.write_text(file.read_text().replace(f'endConnector="{connector}"', 'endConnector="nothing"', 1))
    text = shown("crane", cwd=tmp_path)
    assert ".nothing: no connection; check tells why\n" in text


def test_components_whose_fmus_cannot_be_run_are_shown(tmp_path):
    """An archive with an FMU of Scheduled Execution and one that is none: both in the tree, with what they are."""
    fmi_3(tmp_path / "scheduled.fmu", SCHEDULED)
    files = {
        "SystemStructure.ssd": b'<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
        b'version="1.0" name="two"><ssd:System name="root"><ssd:Elements>'
        b'<ssd:Component name="one" source="resources/a.fmu" type="application/x-fmu-sharedlibrary"/>'
        b'<ssd:Component name="other" source="resources/b.fmu" type="application/x-fmu-sharedlibrary"/>'
        b"</ssd:Elements></ssd:System></ssd:SystemStructureDescription>",
        "resources/a.fmu": (tmp_path / "scheduled.fmu").read_bytes(),
        "resources/b.fmu": b"no archive",
    }
    write_archive(tmp_path / "two.ssp", files)
    text = shown("two.ssp", cwd=tmp_path)
    assert "FMI 3.0, scheduled execution only; " in text
    assert "no FMU: b.fmu: not a readable archive" in text
    assert answers(facts("two.ssp", cwd=tmp_path))["run"] == "no"


def broken_files(folder: Path) -> dict[str, bytes]:
    """Files that cannot be read, each for a reason of its own."""
    whole = fmi_2(folder / "whole.fmu").read_bytes()

    def described(old: str, new: str) -> bytes:
        with zipfile.ZipFile(folder / "whole.fmu") as archive:
            text = archive.read("modelDescription.xml").decode()
        return bare_fmu(folder / "changed.fmu", text.replace(old, new)).read_bytes()

    def archive(**files: bytes) -> bytes:
        return write_archive(folder / "changed.ssp", files).read_bytes()

    return {
        "text.fmu": b"no archive",
        "empty.fmu": b"",
        "cut.fmu": whole[: len(whole) // 2],
        "draft.fmu": described('fmiVersion="2.0"', 'fmiVersion="3.0-beta.1"'),
        "version.fmu": described('fmiVersion="2.0"', 'fmiVersion="4.0"'),
        "open.fmu": described("</fmiModelDescription>", ""),
        "entities.fmu": described("<fmiModelDescription", '<!DOCTYPE x [<!ENTITY a "b">]><fmiModelDescription'),
        "reference.fmu": described('valueReference="0"', 'valueReference="many"'),
        "path.fmu": described('modelIdentifier="bare"', 'modelIdentifier="../bare"'),
        "nothing.fmu": archive(readme=b""),
        "nothing.ssp": archive(readme=b""),
        "text.ssp": b"no archive",
        "open.ssp": archive(**{"SystemStructure.ssd": b"<ssd:SystemStructureDescription"}),
    }


def test_broken_files_have_the_errors_of_check(tmp_path):
    """What `check` cannot read at all ends with 1 and the same message."""
    for name, content in broken_files(tmp_path).items():
        (tmp_path / name).write_bytes(content)
        done, checked = typed("info", name, cwd=tmp_path), typed("check", name, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (1, ""), name
        message = done.stderr.removeprefix("error: ").strip()
        assert message.count("\n") == 0, message
        assert message in checked.stdout, name


HOSTILE = "a[b]<b>:smile:\u009b31m\u202egnp\u200b {x}"


def test_names_from_outside_are_harmless(tmp_path):
    """Markup stays as it is; what would move a terminal's cursor, or the direction of writing, is written as its code."""
    escaped = HOSTILE.replace("<", "&lt;")
    fmi_2(
        tmp_path / "plant.fmu",
        variables=f'<ScalarVariable name="{escaped}" valueReference="0" causality="input" description="two&#10;lines">'
        '<Real unit="[red]" start="1"/></ScalarVariable>',
        name=escaped,
        tool="t" * 5000,
    )
    text = shown("plant.fmu", cwd=tmp_path)
    assert r"a[b]<b>:smile:\x9b31m\u202egnp\u200b {x}" in text
    assert not re.search("[\u009b\u202e\u200b\x1b]", text)
    assert "│ [red] │" in text
    assert "two lines" in text
    assert f" {'t' * 200}... (5000 characters)" in text
    found = facts("plant.fmu", cwd=tmp_path)
    assert found["inputs"][0]["name"] == HOSTILE
    assert len(found["tool"]) == 5000


def test_many_variables(tmp_path):
    large(tmp_path / "large.fmu", 300)
    text = shown("large.fmu", cwd=tmp_path)
    assert text.count(" body[") == 60
    for what in ("input", "output", "parameter"):
        assert f"100 {what}s\n" in text
        assert f"... and 80 more {what}s; --all shows all\n" in text
    assert shown("large.fmu", "--all", cwd=tmp_path).count("│ body[") == 300
    assert len(facts("large.fmu", cwd=tmp_path)["inputs"]) == 100


@pytest.mark.thorough
def test_a_hundred_thousand_variables(tmp_path):
    large(tmp_path / "large.fmu", 100_000)
    assert "... and 33314 more inputs; --all shows all\n" in shown("large.fmu", cwd=tmp_path)


def test_numbers_that_json_does_not_have(tmp_path):
    """JSON has no infinite numbers, so that strict readers refuse them: such a start value stays a text."""
    variable = '<ScalarVariable name="x" valueReference="0" causality="parameter" variability="fixed"><Real start="INF" max="1e400"/></ScalarVariable>'
    fmi_2(tmp_path / "plant.fmu", variables=variable)
    found = facts("plant.fmu", cwd=tmp_path)["parameters"][0]
    assert (found["start"], found["maximum"]) == ("INF", None)


def test_no_library_is_loaded(tmp_path):
    """A library that writes a file when it is loaded."""
    source = tmp_path / "loud.c"
    begin = "__attribute__((constructor)) void begin(void)"
    source.write_text(f'#include <stdio.h>\n{begin} {{ FILE *file = fopen("{tmp_path}/loaded", "w"); if (file) fclose(file); }}\n')
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    subprocess.run([compiler, "-shared", "-fPIC", "-o", tmp_path / "bare.so", source], check=True)
    binaries = {"binaries/linux64/bare.so": (tmp_path / "bare.so").read_bytes()}
    description = fmi_2(tmp_path / "plain.fmu", CO)
    with zipfile.ZipFile(description) as archive:
        text = archive.read("modelDescription.xml").decode()
    bare_fmu(tmp_path / "loud.fmu", text, binaries)
    assert answers(facts("loud.fmu", cwd=tmp_path))["tune"] == "yes"
    assert not (tmp_path / "loaded").exists()
    typed("tune", "loud.fmu", "--input", "force", cwd=tmp_path)
    assert (tmp_path / "loaded").exists(), "a command that loads it leaves the file"


@pytest.mark.skipif(os.name != "posix", reason="terminals of POSIX")
@pytest.mark.parametrize("name", ["nested_crane.ssp", "OverheadCrane.fmu"])
def test_a_terminal_of_80_columns(name, fmus, archives, tmp_path):
    """No line is wider than the terminal, and what is broken goes on below its beginning."""
    path = archives / name if name.endswith("ssp") else fmus / name
    master, slave = pty.openpty()
    environment = {**os.environ, "COLUMNS": "80", "TERM": "dumb", "NO_COLOR": "1"}
    process = subprocess.Popen([*MAIN, "info", str(path)], stdout=slave, stderr=slave, cwd=tmp_path, env=environment)
    os.close(slave)
    chunks = []
    while True:
        try:
            chunk = os.read(master, 65536)
        except OSError:
            break
        if not chunk:
            break
        chunks.append(chunk)
    assert process.wait(timeout=300) == 0
    lines = b"".join(chunks).decode().replace("\r", "").splitlines()
    assert len(lines) > 20
    assert max(map(len, lines)) <= 80, max(lines, key=len)
    broken = next(i for i, line in enumerate(lines) if re.match(r"│   values |co-simulation ", line))
    assert re.match(r"│ {5}\S| {16}\S", lines[broken + 1]), lines[broken + 1]


def test_wrong_usage(fmus, archives, tmp_path):
    (tmp_path / "folder").mkdir()
    for words, said in (
        (["info", "folder"], "no SystemStructure.ssd in this folder"),
        (["info", fmus / "InputShaper.fmu", "--variant", "x"], "only an archive or a folder has variants"),
        (["info", archives / "nested_crane.ssp", "--variant", "Hoisted"], "Did you mean 'Hoisting'?"),
    ):
        done = typed(*words, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (2, "")
        assert said in done.stderr
