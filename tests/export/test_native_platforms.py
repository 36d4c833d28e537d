"""The libraries of the other platforms: they run (Windows by wine, 64-bit ARM by qemu) and give the same numbers; all of
them ask for the platform's C library alone and export FMI's functions alone."""

from __future__ import annotations

import enum
import os
import re
import shutil
import struct
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lief
import pytest
from native_calls import Host
from native_host import binary_of, complete_fmu, host_program, signatures, token_of
from trial_runs import FOR_ITEM, PARAMETERS, STEP, stimuli

from shaper_fmu.component import NO_EVENT
from shaper_fmu.export.native.backend import build_native_fmu
from shaper_fmu.export.native.toolchain import PLATFORMS
from shaper_fmu.export.native.windows import IMPORTS
from shaper_fmu.registry import components, load_components

every_component = pytest.mark.parametrize("name", components())
both_versions = pytest.mark.parametrize("fmi", [2, 3])
ARM_SYSTEM = Path("/usr/aarch64-linux-gnu")
STEPS = 100
Run = Callable[[Path], subprocess.CompletedProcess[str]]


def missing(what: str) -> None:
    """Without a tool there is no test; but in CI there must be all."""
    assert not os.environ.get("CI"), what
    pytest.skip(what)


@pytest.fixture(scope="session")
def wine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    """Runs drive.c's Windows program over a script, in a Windows of its own without a display."""
    folder = Path("/usr/lib/wine")
    program = shutil.which("wine64") or shutil.which("wine") or str(folder / "wine64")
    server = shutil.which("wineserver") or str(folder / "wineserver")
    if not Path(program).is_file() or not Path(server).is_file():
        missing("wine is not installed (Debian: wine64), which runs the Windows libraries here")
    prefix = tmp_path_factory.mktemp("wine") / "prefix"
    environment = {
        **os.environ,
        "WINEPREFIX": str(prefix),
        "WINEDEBUG": "-all",
        "DISPLAY": "",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
    }
    drive = host_program("drive.c", "x86_64-windows")
    yield lambda script: subprocess.run(
        [program, drive, script], env=environment, capture_output=True, text=True, check=False, timeout=900
    )
    subprocess.run([server, "-w"], env=environment, check=False, timeout=900)


@pytest.fixture(scope="session")
def arm() -> Run:
    """Runs drive.c's program for 64-bit ARM over a script."""
    program = shutil.which("qemu-aarch64")
    if not program or not (ARM_SYSTEM / "lib/ld-linux-aarch64.so.1").is_file():
        missing(
            "qemu-aarch64 with a C library is not installed (Debian: qemu-user, libc6-arm64-cross); it runs the ARM libraries here"
        )
    command = [str(program), "-L", str(ARM_SYSTEM), str(host_program("drive.c", "aarch64-linux"))]
    return lambda script: subprocess.run([*command, script], capture_output=True, text=True, check=False, timeout=900)


@pytest.fixture(scope="session")
def old_pc() -> Run:
    """Runs drive.c's program for a 32-bit Linux over a script: this processor does, with a C library of 32 bits."""
    if not Path("/lib/ld-linux.so.2").exists():
        missing("a C library for 32-bit Linux is not installed (Debian: libc6-i386), which runs the i686-linux libraries here")
    drive = host_program("drive.c", "i686-linux")
    return lambda script: subprocess.run([drive, script], capture_output=True, text=True, check=False, timeout=900)


def here(script: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([host_program("drive.c"), script], capture_output=True, text=True, check=False)


def bits(value: float) -> str:
    return struct.pack(">d", value).hex()


def settings(host: Host, parameters: dict[str, Any]) -> list[str]:
    """The script's lines that set parameters or inputs; x[2] is a variable of FMI 2, but an element of x in FMI 3."""
    lines, arrays = [], {}
    for label, value in parameters.items():
        name, _, index = label.rstrip("]").partition("[")
        variable = next(v for v in host.variables if v.name == (name if host.fmi == 3 else label))
        if host.fmi == 3 and index:
            arrays.setdefault(name, host.starts(variable))[int(index) - 1] = value
        values = arrays.get(name, [value])
        if variable.type in ("Real", "Float64"):
            lines.append(f"real {variable.valueReference} {len(values)} {' '.join(bits(float(x)) for x in values)}")
        else:
            kind = {"Boolean": "b", "Enumeration": "e"}.get(variable.type, "i")
            lines.append(f"whole {variable.valueReference} {kind} {int(value)}")
    return lines


def cases(name: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """A run with parameters of its own, and one for every item of an enumeration."""
    yield name, PARAMETERS[name]
    for variable in components()[name].variables.values():
        if issubclass(variable.kind, enum.IntEnum):
            for item in variable.kind:
                yield f"{name} {item.name}", {variable.name: item, **FOR_ITEM.get((name, item.name), {})}


def looked_at(host: Host) -> list[Any]:
    results = ("output", "local", "calculatedParameter")
    return [v for v in host.variables if v.type in ("Real", "Float64") and v.causality in results]


def case_lines(host: Host, parameters: dict[str, Any]) -> list[str]:
    """A simulation with these parameters and changing inputs, and derivatives of model exchange."""
    look = [f"get {v.valueReference} {host.size(v)}" for v in looked_at(host)]
    lines = ["begin", *settings(host, parameters), "end", *look]
    for i in range(STEPS):
        lines += settings(host, stimuli(host.name, i))
        lines += [f"step {bits(i * STEP)} {bits(STEP)}", *look]
    return [*lines, "free", f"exchange {host.states}"]


def script(folder: Path, platform: str) -> Path:
    """All cases of all components by both versions of FMI, each with its title."""
    lines = []
    for name in components():
        for fmi in (2, 3):
            host = Host(name, fmi)
            host.free()
            library = binary_of(complete_fmu(name, fmi), platform)
            lines.append(f"open {'Z:' if platform == 'x86_64-windows' else ''}{library} {fmi} {token_of(complete_fmu(name, fmi))}")
            for title, parameters in cases(name):
                lines += [f"title FMI{fmi}_{title.replace(' ', '_')}", *case_lines(host, parameters)]
    path = folder / f"{platform}.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def numbers(run: subprocess.CompletedProcess[str]) -> dict[str, list[float]]:
    """What each case printed."""
    assert run.returncode == 0, run.stderr
    found: dict[str, list[float]] = {}
    for word in run.stdout.split():
        if word.startswith("FMI"):
            found[word] = []
        else:
            found[list(found)[-1]].append(struct.unpack(">d", bytes.fromhex(word))[0])
    return found


PLAIN = ("PositionController", "PulseWidthModulator")
"""Components of plain arithmetic: they call no function that a platform's mathematics library may round differently."""

CLOSE = 1e-14
"""What other sines, exponentials and powers may change, relative to the largest number of a run (at least 1): a few units
in the last place, measured 2e-15 with the functions that ziglang links and those of wine."""


SEARCHED = {"ShapedStop": 1e-8}
"""Results of searches for a plan, which begin with what is measured: other last digits of sines and exponentials move them by more.
1.7e-9 was seen by wine, of a swing that is measured."""


def beyond(worst: dict[str, float]) -> dict[str, float]:
    """The cases that differ by more than they may."""

    def allowed(title: str) -> float:
        if any(name in title for name in PLAIN):
            return 0.0
        return next((most for name, most in SEARCHED.items() if name in title), CLOSE)

    return {title: x for title, x in worst.items() if x > allowed(title)}


@pytest.fixture(scope="session")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[float]]:
    return numbers(here(script(tmp_path_factory.mktemp("here"), "x86_64-linux")))


def differences(found: dict[str, list[float]], reference: dict[str, list[float]]) -> dict[str, float]:
    """The largest difference of each case, relative to its largest number, or to 1 if that is larger."""
    assert found.keys() == reference.keys()
    worst = {}
    for title, expected in reference.items():
        assert len(found[title]) == len(expected) > STEPS, title
        largest = max(1.0, *(abs(x) for x in expected if abs(x) < NO_EVENT))
        worst[title] = max(abs(a - b) for a, b in zip(found[title], expected, strict=True)) / largest
    return worst


def test_the_windows_libraries_give_the_same_numbers(wine, reference, tmp_path, capsys):
    worst = differences(numbers(wine(script(tmp_path, "x86_64-windows"))), reference)
    with capsys.disabled():
        print(
            f"\nWindows by wine: {len(worst)} runs, {sum(x == 0.0 for x in worst.values())} bit for bit, worst {max(worst.values()):.1e}"
        )
    assert beyond(worst) == {}


def test_the_arm_libraries_give_the_same_bits(arm, reference, tmp_path):
    """The C library is glibc as here; where its versions differ, so may its last bits, but not by more than CLOSE."""
    worst = differences(numbers(arm(script(tmp_path, "aarch64-linux"))), reference)
    assert beyond(worst) == {}


def test_the_32_bit_linux_libraries_give_the_same_numbers(old_pc, reference, tmp_path, capsys):
    """The arithmetic is that of SSE2 and equal to the bit; glibc's sines and exponentials for 32 bits are other programs."""
    worst = differences(numbers(old_pc(script(tmp_path, "i686-linux"))), reference)
    with capsys.disabled():
        print(
            f"\ni686-linux: {len(worst)} runs, {sum(x == 0.0 for x in worst.values())} bit for bit, worst {max(worst.values()):.1e}"
        )
    assert beyond(worst) == {}


# what the libraries ask for, and what they offer


MADE_BY_THE_LINKER = {"__dso_handle", "_mh_dylib_header"}
"""Where a library of macOS begins; ziglang's linker shows these names. macOS binds a name to a library, so they hide nothing."""

lief.logging.disable()  # it tells of headers that are not there, and need not be


def symbols(library: Path) -> tuple[set[str], set[str], set[str]]:
    """Libraries asked for, names asked for (with the version of glibc), and names offered."""
    binary = lief.parse(library)
    if isinstance(binary, lief.PE.Binary):
        exports = binary.get_export()
        offered = {str(entry.name) for entry in exports.entries} if exports else set()
        asked = {str(entry.name) for one in binary.imports for entry in one.entries}
        return {str(one.name) for one in binary.imports}, asked, offered
    if isinstance(binary, lief.ELF.Binary):
        asked = {f"{s.name}@{version_of(s)}" for s in binary.imported_symbols}
        return {str(name) for name in binary.libraries}, asked, {str(s.name) for s in binary.exported_symbols}
    assert isinstance(binary, lief.MachO.Binary)
    names = {str(command.name) for command in binary.libraries} - {f"@rpath/{library.name}"}  # its own name is among them
    offered = {str(s.name).removeprefix("_") for s in binary.symbols if s.has_export_info} - MADE_BY_THE_LINKER
    return names, {str(s.name) for s in binary.imported_symbols}, offered


def version_of(symbol: Any) -> str:
    version = symbol.symbol_version
    return str(version.symbol_version_auxiliary.name) if version and version.has_auxiliary_version else "none"


ASKED = {
    "x86_64-linux": r"lib[cm]\.so\.6",
    "aarch64-linux": r"lib[cm]\.so\.6",
    "i686-linux": r"lib[cm]\.so\.6",
    "i686-windows": r"api-ms-win-crt-[a-z]+-l1-1-0\.dll",
    "x86_64-windows": r"api-ms-win-crt-[a-z]+-l1-1-0\.dll",
    "x86_64-darwin": r"/usr/lib/libSystem\.B\.dylib",
    "aarch64-darwin": r"/usr/lib/libSystem\.B\.dylib",
}


@every_component
@both_versions
@pytest.mark.parametrize("platform", PLATFORMS)
def test_a_library_asks_for_the_c_library_alone_and_offers_fmi_alone(name, fmi, platform):
    """All functions of the official header and nothing else; glibc of 2012 (2.17) is enough."""
    libraries, asked, offered = symbols(binary_of(complete_fmu(name, fmi), platform))
    assert [found for found in libraries if not re.fullmatch(ASKED[platform], found)] == []
    assert offered == set(signatures(fmi))
    if platform.endswith("linux"):
        versions = [tuple(map(int, re.findall(r"\d+", found.partition("@GLIBC_")[2]))) for found in asked]
        assert all((2, 0) <= version <= (2, 17) for version in versions), asked
    if platform.endswith("windows"):  # what is not among them takes minutes to link
        assert asked <= set(" ".join(IMPORTS.values()).split())


LOGARITHMIC = '''\
"""A component of a user's that needs more of the C library than those of the package."""

import math

from shaper_fmu.component import Component, Input, Output


class Logarithmic(Component):
    """Logarithm of the gamma function."""

    x = Input("", "argument, above 0")
    y = Output("", "logarithm of the gamma function of 1 + |x|")

    def step(self, t, h):
        self.y = math.lgamma(1.0 + abs(self.x))
'''


def test_what_the_short_way_to_windows_lacks_is_linked_from_the_whole_library(tmp_path):
    """lgamma is in none of the parts: MinGW-w64's own is linked, as it has always been."""
    file = tmp_path / "logarithmic.py"
    file.write_text(LOGARITHMIC)
    (component,) = load_components(file)
    libraries, asked, _ = symbols(binary_of(build_native_fmu(component, tmp_path, 3, ["x86_64-windows"]), "x86_64-windows"))
    assert "KERNEL32.dll" in libraries
    assert "lgamma" not in asked


@every_component
@both_versions
def test_an_fmu_for_all_seven_platforms_is_smaller_than_a_megabyte(name, fmi):
    assert complete_fmu(name, fmi).stat().st_size < 1_000_000
