"""Hostile and broken descriptions and libraries: refused in words by every way to use them, at once and with little memory."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from command_line import typed
from faulty_fmus import description2, description3, library, library_path
from ssp_archives import archive, component, ssd

from shaper_fmu import System
from shaper_fmu.errors import ArchiveError, ModelError, SimulationError
from shaper_fmu.export.native.toolchain import build_library, platform_named
from shaper_fmu.master.binaries import library_problem
from shaper_fmu.master.fmu import fmu_problems, load_fmu

ARRAY = '<Float64 name="array" valueReference="500" causality="local" variability="continuous">{}</Float64></ModelVariables>'
SIZE = '<UInt64 name="size" valueReference="501" causality="structuralParameter" variability="fixed" start="{}"/>'


def of_sizes(*dimensions: str) -> str:
    sizes = "".join(f'<Dimension start="{size}"/>' for size in dimensions)
    return description3("{faulty}").replace("</ModelVariables>", ARRAY.format(sizes))


def named_size(start: str, reference: int = 501) -> str:
    text = ARRAY.format(f'<Dimension valueReference="{reference}"/>').replace("</ModelV", SIZE.format(start) + "</ModelV")
    return description3("{faulty}").replace("</ModelVariables>", text)


def index2(index: str) -> str:
    return description2("{faulty}").replace('<Unknown index="2"', f'<Unknown index="{index}"', 1)


def identified(version: int, identifier: str) -> str:
    text = description3("{faulty}") if version == 3 else description2("{faulty}")
    return text.replace('modelIdentifier="faulty"', f'modelIdentifier="{identifier}"')


HOSTILE = {
    "a size of 1e12": (3, of_sizes("1000000000000"), r"array 'array' \(line 1\) has 1000000000000 elements; an FMU can have 1000000"),
    "a size of 2^64-1": (3, of_sizes("18446744073709551615"), "has 18446744073709551615 elements"),
    "a size of 2^64": (3, of_sizes("18446744073709551616"), "has 18446744073709551616 elements"),
    "a size of 1e30": (3, of_sizes("1" + "0" * 30), "a dimension of '10+' is not a size"),
    "a size of -3": (3, of_sizes("-3"), "a dimension of '-3' is not a size: it must be an integer from 0 on"),
    "a size of 1e3": (3, of_sizes("1e3"), "a dimension of '1e3' is not a size"),
    "no size": (3, of_sizes(""), "a dimension of '' is not a size"),
    "1e6 x 1e6": (3, of_sizes("1000000", "1000000"), "has 1000000 x 1000000 elements"),
    "a product of 2^64": (3, of_sizes("4294967296", "4294967296"), "has 4294967296 x 4294967296 elements"),
    "a hundred dimensions": (3, of_sizes(*["10"] * 100), "has 10 x 10 .* elements"),
    "many arrays": (
        3,
        of_sizes("900000").replace("</ModelVariables>", ARRAY.format('<Dimension start="100001"/>').replace("500", "502").replace('"array"', '"b"')),
        "has 100001 elements",
    ),
    "a parameter's size of 1e12": (3, named_size("1000000000000"), "has 1000000000000 elements"),
    "a parameter's size of -3": (3, named_size("-3"), "a dimension of '-3' is not a size"),
    "a size of nothing": (3, named_size("3", 777), "a dimension names valueReference '777', which no variable has"),
    "a parameter without a size": (3, named_size("3").replace(' start="3"', ""), "a dimension is 'size', which has no start value"),
    "index 0": (2, index2("0"), r"ModelStructure .*index = '0' is not a variable; they are counted from 1 to 11"),
    "an index too large": (2, index2("12"), "index = '12' is not a variable"),
    "an index below 0": (2, index2("-1"), "index = '-1' is not a variable"),
    "no index": (2, description2("{faulty}").replace(' index="2"', "", 1), "index = None is not a variable"),
    "an index that is none": (2, index2("two"), "index = 'two' is not a variable"),
    "an output that is none": (3, description3("{faulty}").replace('<Output valueReference="1"', '<Output valueReference="99"'), "valueReference = '99' is not a variable"),
    "a clock that is none": (3, description3("{faulty}").replace('name="output"', 'name="output" clocks="99"'), "clocks = '99' names 99, which is not a variable"),
    "a value reference below 0": (2, description2("{faulty}").replace('valueReference="1"', 'valueReference="-1"'), "valueReference is '-1', not an integer from 0 to 4294967295"),
    "a value reference of 2^32": (3, description3("{faulty}").replace('valueReference="1" causality', 'valueReference="4294967296" causality'), "valueReference is '4294967296'"),
    "no value reference": (2, description2("{faulty}").replace(' valueReference="1"', ""), "valueReference is None"),
    "no name": (2, description2("{faulty}").replace(' name="output"', ""), "a variable .* has no name"),
    "no type": (2, description2("{faulty}").replace("<Real/>", ""), "variable 'output' .* has no type that FMI 2 knows"),
    "a type that is none": (3, description3("{faulty}").replace('<Float64 name="output"', '<Float16 name="output"'), "variable 'output' .* has no type that FMI 3 knows"),
    "a path": (2, identified(2, "../../../etc/lib"), r"modelIdentifier of CoSimulation is '../../../etc/lib': not the name of a library but a path"),
    "a path from the root": (3, identified(3, "/tmp/lib"), "not the name of a library but a path"),
    "a path of Windows": (3, identified(3, r"..\\lib"), "not the name of a library but a path"),
    "a drive": (2, identified(2, "c:lib"), "not the name of a library but a path"),
    "the parent folder": (2, identified(2, ".."), "not the name of a library but a path"),
    "a long identifier": (2, identified(2, "a" * 1000), "has 1000 bytes, more than the 200 that are accepted"),
    "no identifier": (2, identified(2, ""), "modelIdentifier of CoSimulation is missing"),
    "no version": (2, description2("{faulty}").replace(' fmiVersion="2.0"', ""), "fmiVersion is ''; FMI 1.0, 2.0 and 3.0 are read"),
    "a draft": (3, description3("{faulty}").replace('"3.0"', '"3.0-beta.2"'), "fmiVersion '3.0-beta.2' is a draft"),
    "another root": (2, description2("{faulty}").replace("fmiModelDescription", "description"), "its root element is 'description'"),
    "cut off": (2, description2("{faulty}")[:-40], "not well-formed"),
}  # fmt: skip


def packed(path: Path, version: int, text: str, binary: bytes | None = None) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", text)
        file.writestr(library_path(version), binary if binary is not None else b"")
    return path


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_description_is_refused_in_words(name, tmp_path):
    version, text, words = HOSTILE[name]
    path = packed(tmp_path / "bad.fmu", version, text)
    for use in (fmu_problems, load_fmu, lambda path: System().add("x", path)):
        with pytest.raises((ArchiveError, ModelError), match=words) as caught:
            use(path)
        assert str(caught.value).count("\n") == 0


def test_large_sizes_take_no_memory(tmp_path):
    """All refusals in one process that may have 60 MB more than it has."""
    paths = [str(packed(tmp_path / f"{i}.fmu", version, text)) for i, (version, text, _) in enumerate(HOSTILE.values())]
    code = """
import resource, sys
from shaper_fmu.errors import ShaperFmuError
from shaper_fmu.master.fmu import fmu_problems
try:
    fmu_problems(__import__("pathlib").Path(sys.argv[1]))
except ShaperFmuError:
    pass
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 60_000_000,) * 2)
for path in sys.argv[1:]:
    try:
        fmu_problems(__import__("pathlib").Path(path))
        sys.exit(path)
    except ShaperFmuError:
        pass
"""
    if not sys.platform.startswith("linux"):
        pytest.skip("memory is limited by Linux's means")
    done = subprocess.run([sys.executable, "-c", code, *paths], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


PLATFORMS = {2: fmpy.platform, 3: fmpy.platform_tuple}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.9])
def test_a_library_that_is_cut_off_is_refused_in_words(version, share, tmp_path):
    """To load it ends a process by a bus error, without a word."""
    whole = library(f"faulty{version}").read_bytes()
    path = packed(tmp_path / "cut.fmu", version, identified(version, "faulty"), whole[: int(share * len(whole))])
    system = System()
    system.add("x", path)
    words = "its library faulty.* is (cut off: it has [0-9]+ bytes, but [0-9]+ by its headers|damaged: its [0-9]+ bytes end within)"
    with pytest.raises(SimulationError, match=f"^x: cut.fmu cannot be instantiated: {words}"):
        system.simulate(1.0, 0.1)
    problems = fmu_problems(path)
    assert len(problems) == 1
    assert problems[0].startswith(f"binaries/{PLATFORMS[version]}/faulty{fmpy.sharedLibraryExtension} is ")


def test_a_library_beside_it_that_is_cut_off_is_refused_too(tmp_path):
    whole = library("faulty2").read_bytes()
    path = packed(tmp_path / "cut.fmu", 2, description2("{faulty}"), whole)
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(f"binaries/{fmpy.platform}/libother.so.1", whole[: len(whole) // 2])
    system = System()
    system.add("x", path)
    with pytest.raises(SimulationError, match=r"its library libother\.so\.1 is cut off"):
        system.simulate(1.0, 0.1)


@pytest.mark.representatives(platform=["x86_64-darwin", "x86_64-linux"])  # for Windows ziglang compiles a C library first
@pytest.mark.parametrize("platform", ["x86_64-windows", "x86_64-darwin", "aarch64-darwin", "aarch64-linux", "x86_64-linux"])
def test_libraries_of_all_platforms_are_whole_to_their_last_mapped_byte(platform, tmp_path):
    """Each is built for real; it is whole as it is, and told as cut off at any length below its last mapped byte."""
    source = tmp_path / "a.c"
    source.write_text(
        '#if defined(_WIN32)\n__declspec(dllexport)\n#else\n__attribute__((visibility("default")))\n#endif\nint table[3000] = {1, 2, 3};\n'
    )
    built_for = platform_named(platform)
    target = tmp_path / f"a{built_for.suffix}"
    build_library([source], target, built_for, [])
    content = target.read_bytes()
    assert library_problem("a", content) is None
    for length in (5, 70, 400, len(content) // 3, len(content) // 2):
        assert library_problem("a", content[:length]) is not None, length


def test_what_is_no_library_has_no_problem():
    for content in (b"", b"text", b"\x7fEL", b"MZ" + bytes(100)):
        assert library_problem("a.so", content) is None


def test_the_commands_tell_it_in_words(tmp_path):
    """`check` of an FMU, and `check` and `run` of an archive with it; exit 1, no traceback."""
    fmu = packed(tmp_path / "bad.fmu", 3, HOSTILE["1e6 x 1e6"][1])
    system = archive(tmp_path, tmp_path, ssd("<ssd:Elements>" + component("x", "bad") + "</ssd:Elements>"), "bad")
    for arguments in (["check", str(fmu)], ["check", str(system)], ["run", str(system), "--stop-time", "1", "--step", "0.1"]):
        done = typed(*arguments, cwd=tmp_path)
        assert done.returncode == 1
        said = " ".join((done.stdout + done.stderr).split())
        assert "has 1000000 x 1000000 elements" in said
        assert "Traceback" not in said
