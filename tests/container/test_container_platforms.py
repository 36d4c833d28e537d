"""Containers on other platforms: Windows by wine, 64-bit ARM by qemu, Linux of 32 bits; the same numbers, and no other libraries asked for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from container_host import ContainerHost
from native_drivers import unpacked
from native_host import complete_fmu, signatures, token_of
from test_native_platforms import (  # noqa: F401  fixtures
    ASKED,
    CLOSE,
    arm,
    bits,
    differences,
    here,
    looked_at,
    numbers,
    old_pc,
    symbols,
    wine,
)

from shaper_fmu.container.build import pack
from shaper_fmu.container.interface import outer_variables
from shaper_fmu.export.native.toolchain import PLATFORMS
from shaper_fmu.master.system import System

pytestmark = pytest.mark.thorough  # seven libraries are compiled
STEPS = 100


@pytest.fixture(scope="module")
def fmus(tmp_path_factory) -> dict[int, Path]:
    """A shaped plant, with FMUs of both versions inside, for all platforms."""
    folder = tmp_path_factory.mktemp("everywhere")
    found = {}
    for fmi in (2, 3):
        system = System("shaped")
        system.add("shaper", complete_fmu("InputShaper", 2), shaper="zvd", natural_frequency=[10.0])
        system.add("plant", complete_fmu("MassSpringDamper", 3), mass=1.0, stiffness=100.0)
        system.connect("shaper.shaped", "plant.force")
        found[fmi] = pack(
            system, outer_variables(system, fmi), folder / f"everywhere{fmi}.fmu", fmi=fmi, platforms=tuple(PLATFORMS)
        ).path
    return found


def library(fmu: Path, platform: str) -> Path:
    known = PLATFORMS[platform]
    folders = {known.fmi2_folder, known.fmi3_folder}
    (found,) = [path for path in (unpacked(fmu) / "binaries").glob(f"*/*{known.suffix}") if path.parent.name in folders]
    return found


def script(fmus: dict[int, Path], folder: Path, platform: str) -> Path:
    """The same moves by both versions of FMI."""
    lines = []
    for fmi, fmu in fmus.items():
        host = ContainerHost(fmu)
        host.free()
        there = f"{'Z:' if 'windows' in platform else ''}{library(fmu, platform)}"
        command = next(v.valueReference for v in host.variables if v.name == "shaper.command")
        look = [f"get {v.valueReference} {host.size(v)}" for v in looked_at(host)]
        lines += [f"open {there} {fmi} {token_of(fmu)}", f"title FMI{fmi}", "begin", f"real {command} 1 {bits(1.0)}", "end", *look]
        for i in range(STEPS):
            lines += [f"step {bits(0.007 * i)} {bits(0.007)}", *look]
        lines.append("free")
    path = folder / f"{platform}.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def difference(found, fmus: dict[int, Path], folder: Path) -> float:
    reference = numbers(here(script(fmus, folder, "x86_64-linux")))
    assert max(map(max, reference.values())) > 0.01
    return max(differences(numbers(found), reference).values())


def test_windows(wine, fmus, tmp_path):  # noqa: F811
    assert difference(wine(script(fmus, tmp_path, "x86_64-windows")), fmus, tmp_path) <= CLOSE


def test_arm(arm, fmus, tmp_path):  # noqa: F811
    assert difference(arm(script(fmus, tmp_path, "aarch64-linux")), fmus, tmp_path) <= CLOSE


def test_linux_of_32_bits(old_pc, fmus, tmp_path):  # noqa: F811
    assert difference(old_pc(script(fmus, tmp_path, "i686-linux")), fmus, tmp_path) <= CLOSE


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("platform", PLATFORMS)
def test_a_library_asks_for_the_c_library_alone_and_offers_fmi_alone(platform, fmi, fmus):
    """And for what loads other libraries (on Windows KERNEL32); glibc of 2012 (2.17) is enough."""
    libraries, asked, offered = symbols(library(fmus[fmi], platform))
    known = rf"{ASKED[platform]}|@rpath/container\.dylib|KERNEL32\.dll|libdl\.so\.2|ld-linux.*\.so\.."  # of macOS: its own name
    assert [found for found in libraries if not re.fullmatch(known, found)] == []
    assert offered == set(signatures(fmi))
    if platform.endswith("linux"):
        versions = [tuple(map(int, re.findall(r"\d+", found.partition("@GLIBC_")[2]))) for found in asked]
        assert all((2, 0) <= version <= (2, 17) for version in versions), asked
