"""The sources that an FMU carries: importers build it from them, with the same results to the bit, and compilers find nothing to say.

fmpy's build is cmake over the files that the description lists, as that of the Reference FMUs; the folder has a CMakeLists.txt of its
own as well.
"""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import zipfile
from ctypes import c_double, c_uint32
from pathlib import Path

import fmpy
import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu
from lxml import etree
from native_calls import Host, array
from native_host import HEADERS, HOSTS, native_fmu, signatures, token_of
from test_native_layer import CLANG, COMPILERS, compiler
from test_native_platforms import case_lines, cases, here

from shaper_fmu.registry import components

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])
SCHEMA = Path(fmpy.__file__).parent / "schema/fmi3/fmi3BuildDescription.xsd"
COMPILED = ["fmu.c", "kernels.c"]


def unpacked(name: str, fmi: int, folder: Path) -> Path:
    with zipfile.ZipFile(native_fmu(name, fmi)) as fmu:
        fmu.extractall(folder)
    return folder


def needs(program: str) -> None:
    if not shutil.which(program):
        words = f"{program} is not installed, which builds FMUs from their sources"
        assert not os.environ.get("CI"), words
        pytest.skip(words)


def results(name: str, fmi: int, library: Path, folder: Path) -> str:
    """All numbers of all cases, bit by bit, by drive.c."""
    host = Host(name, fmi)
    host.free()
    lines = [f"open {library} {fmi} {token_of(native_fmu(name, fmi))}"]
    for title, parameters in cases(name):
        lines += [f"title FMI{fmi}_{title.replace(' ', '_')}", *case_lines(host, parameters)]
    script = folder / "script.txt"
    script.write_text("\n".join(lines) + "\n")
    run = here(script)
    assert run.returncode == 0, run.stderr
    assert run.stdout.count("\n") > 50 or len(run.stdout) > 2000
    return run.stdout


def library_in(folder: Path) -> Path:
    (found,) = folder.glob("binaries/*/*.so")
    return found


@both_versions
@every_component
def test_fmpy_builds_the_fmu_from_its_sources_with_equal_results(name, fmi, tmp_path, monkeypatch):
    """fmpy does not link the mathematics library, which its own process has loaded; drive.c's has not."""
    needs("cmake")
    monkeypatch.setenv("LD_PRELOAD", "libm.so.6")
    folder = unpacked(name, fmi, tmp_path / "fmu")
    ours = shutil.copy(library_in(folder), tmp_path / "ours.so")
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build", all_warnings=True)
    listed = subprocess.run(["nm", "-D", "--defined-only", library_in(folder)], capture_output=True, text=True, check=True)
    assert {line.split()[-1] for line in listed.stdout.splitlines()} == set(signatures(fmi))  # though nobody hides anything
    assert results(name, fmi, library_in(folder), tmp_path) == results(name, fmi, Path(ours), tmp_path)
    assert Path(ours).read_bytes() != library_in(folder).read_bytes()


@both_versions
def test_the_folder_is_built_by_its_own_cmake_file(fmi, tmp_path):
    needs("cmake")
    folder = unpacked("InputShaper", fmi, tmp_path / "fmu")
    build = tmp_path / "build"
    for command in (["-S", str(folder / "sources"), "-B", str(build), f"-DFMI_HEADERS={HEADERS}"], ["--build", str(build)]):
        done = subprocess.run(["cmake", *command], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    assert results("InputShaper", fmi, build / "InputShaper.so", tmp_path) == results(
        "InputShaper", fmi, library_in(folder), tmp_path
    )


@both_versions
@every_component
def test_the_description_lists_what_is_compiled_and_fmpy_has_no_findings(name, fmi, tmp_path):
    folder = unpacked(name, fmi, tmp_path)
    description = etree.parse(folder / "modelDescription.xml").getroot()
    if fmi == 2:
        for kind in ("CoSimulation", *(["ModelExchange"] if components()[name].continuous_states is not None else [])):
            assert [file.get("name") for file in description.findall(f"{kind}/SourceFiles/File")] == COMPILED
    else:
        built = etree.parse(folder / "sources/buildDescription.xml")
        etree.XMLSchema(file=str(SCHEMA)).assertValid(built)
        for configuration in built.getroot():
            assert configuration.get("modelIdentifier") == name
            assert [file.get("name") for file in configuration.iter("SourceFile")] == COMPILED
            assert {one.get("compiler") for one in configuration.iter("SourceFileSet")} == {"gcc"}  # whose options they are
            assert all("-ffp-contract=off" in str(one.get("compilerOptions")) for one in configuration.iter("SourceFileSet"))
    assert validate_fmu(str(native_fmu(name, fmi))) == []


def test_every_file_of_the_folder_is_used(tmp_path):
    """What is compiled, what it includes, and how to build it; FMI's headers are the importer's (FMI 3.0, 2.5.1)."""
    for fmi in (2, 3):
        folder = unpacked("MassSpringDamper", fmi, tmp_path / str(fmi)) / "sources"
        left, found = list(COMPILED), set()
        while left:
            file = left.pop()
            found.add(file)
            included = re.findall(r'#include "([^"]+)"', (folder / file).read_text())
            left += [name for name in included if name not in found and not name.startswith(f"fmi{fmi}Functions")]
        others = {"CMakeLists.txt", "README.md", *(["buildDescription.xml"] if fmi == 3 else [])}
        assert {file.name for file in folder.iterdir()} == found | others


@both_versions
@every_component
@pytest.mark.parametrize("which", COMPILERS)
def test_the_sources_compile_without_a_warning(which, name, fmi, tmp_path):
    folder = unpacked(name, fmi, tmp_path) / "sources"
    for file in COMPILED:
        command = [
            *compiler(which),
            "-O1",
            "-ffp-contract=off",
            "-c",
            "-isystem",
            str(HEADERS),
            str(folder / file),
            "-o",
            str(tmp_path / "x.o"),
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, ""), file


def test_the_x87_unit_is_refused(tmp_path):
    """It keeps 80 bits between operations: other results, in silence."""
    folder = unpacked("MassSpringDamper", 3, tmp_path) / "sources"
    base = [*CLANG, "-target", "x86-linux-gnu", "-c", "-isystem", str(HEADERS), str(folder / "fmu.c"), "-o", str(tmp_path / "x.o")]
    done = subprocess.run([*base, "-mcpu=i686"], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "-msse2 -mfpmath=sse" in done.stderr
    assert subprocess.run([*base, "-mcpu=i686", "-DSHAPER_FMU_ANY_ROUNDING"], capture_output=True, check=False).returncode == 0
    assert subprocess.run(base, capture_output=True, check=False).returncode == 0


STATIC = {
    "musl": [*CLANG, "-target", "x86_64-linux-musl", "-static"],
    "glibc": ["gcc", "-static"],
    "32 bits": [*CLANG, "-target", "x86-linux-musl", "-static"],
}


def linked_run(fmus: list[tuple[str, str, str]], steps: int) -> list[str]:
    """What linked.c prints, by the FMUs' own libraries."""
    hosts = [Host(name, 3) for name, _, _ in fmus]
    for host in hosts:
        assert (host.setup(), host.call("ExitInitializationMode")) == (0, 0)
    lines = []
    for i in range(steps):
        for host, (_, given, taken) in zip(hosts, fmus, strict=True):
            variables = {v.name: v for v in host.variables}
            value = array(c_double, [0.0])
            assert host.put(variables[given], i % 7 * 0.25) == 0
            assert host.step(i * 0.01, 0.01) == 0
            assert host.access("Get", "Float64", array(c_uint32, [variables[taken].valueReference]), 1, value, 1) == 0
            lines.append(struct.pack(">d", value[0]).hex())
    for host in hosts:
        host.free()
    return lines


@pytest.mark.parametrize("which", STATIC)
def test_two_fmus_are_linked_into_one_program(which, tmp_path):
    """With prefixes, as the README says, for musl, too. Arithmetic alone gives equal bits whatever the C library."""
    fmus = [("PositionController", "reference", "force"), ("PulseWidthModulator", "reference", "pulse_mean")]
    needs(STATIC[which][0])
    objects, arguments = [], []
    for prefix, (name, given, taken) in zip(("First", "Second"), fmus, strict=True):
        folder = unpacked(name, 3, tmp_path / name) / "sources"
        names = [f"-DFMI3_FUNCTION_PREFIX={prefix}_", f"-Dkernel_start={prefix}_start", f"-Dkernel_step={prefix}_step"]
        for file in COMPILED:
            target = tmp_path / f"{prefix}_{file}.o"
            command = [
                *STATIC[which],
                "-std=c99",
                "-O2",
                "-ffp-contract=off",
                *names,
                f"-I{HEADERS}",
                "-c",
                str(folder / file),
                "-o",
                str(target),
            ]
            subprocess.run(command, check=True)
            objects.append(str(target))
        references = {v.name: v.valueReference for v in fmpy.read_model_description(str(native_fmu(name, 3))).modelVariables}
        arguments += [token_of(native_fmu(name, 3)), str(references[given]), str(references[taken])]
    program = tmp_path / "linked"
    subprocess.run([*STATIC[which], f"-I{HEADERS}", str(HOSTS / "linked.c"), *objects, "-lm", "-o", str(program)], check=True)
    done = subprocess.run([program, *arguments, "50"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.split() == linked_run(fmus, 50)


ARM = [
    "arm-none-eabi-gcc",
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfpu=fpv4-sp-d16",
    "-mfloat-abi=hard",
    "-Os",
    "-std=c99",
    "-ffp-contract=off",
]


@both_versions
def test_sizes_on_a_cortex_m4(fmi, tmp_path, capsys):
    """For the documentation's table: code and constants, and what an instance takes."""
    needs(ARM[0])
    found = {}
    for name in components():
        folder = unpacked(name, fmi, tmp_path / name) / "sources"
        sizes = []
        for file in COMPILED:
            subprocess.run([*ARM, "-c", "-isystem", str(HEADERS), str(folder / file), "-o", str(tmp_path / "x.o")], check=True)
            listed = subprocess.run(["arm-none-eabi-size", str(tmp_path / "x.o")], capture_output=True, text=True, check=True)
            sizes.append([int(word) for word in listed.stdout.splitlines()[1].split()[:3]])
        found[name] = [text + more for text, more in zip(*sizes, strict=True)]
        assert found[name][1] + found[name][2] < 600  # nothing to speak of in memory but instances
    with capsys.disabled():
        print(f"\nCortex-M4, FMI {fmi}.0, bytes of text, data and bss:")
        for name, sizes in found.items():
            print(f"  {name}: {sizes[0]}, {sizes[1]}, {sizes[2]}")
