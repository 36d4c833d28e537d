"""What native libraries are linked of, and the cache that keeps it."""

from __future__ import annotations

import ctypes
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from native_host import binary_of

from shaper_fmu.export.native.backend import build_native_fmu
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.native.libraries import library
from shaper_fmu.export.native.sources import fmu_sources
from shaper_fmu.export.native.toolchain import build_library, platform_named
from shaper_fmu.registry import components

NAMES = ("PositionController", "PulseWidthModulator")
BUILD = f"""
import sys
from pathlib import Path
from shaper_fmu.export.native.backend import build_native_fmu
from shaper_fmu.registry import components
for name in {NAMES}:
    for fmi in (2, 3):
        build_native_fmu(components()[name], Path(sys.argv[1]) / str(fmi), fmi, ("x86_64-linux",))
"""


def built(folder: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", BUILD, str(folder)], start_new_session=True)


def contents(folder: Path) -> dict[str, bytes]:
    """All files by their path, but the locks."""
    files = (file for file in folder.rglob("*") if file.is_file() and file.suffix != ".lock")
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


@pytest.fixture
def cache(tmp_path, monkeypatch) -> Iterator[Path]:
    """An empty cache."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("SHAPER_FMU_CACHE", str(folder))
    return folder


def test_both_versions_share_the_kernels_and_all_components_the_layer(cache, tmp_path):
    """Two components in two versions are linked of two kernels and two layers."""
    for name in NAMES:
        for fmi in (2, 3):
            build_native_fmu(components()[name], tmp_path / str(fmi), fmi, ("x86_64-linux",))
    assert len(list((cache / "objects").glob("*.o"))) == 4
    assert len(list((cache / "libraries").glob("*.so"))) == 4


def test_what_a_changed_file_is_part_of_is_compiled_anew(cache):
    """A change of the layer, of the table and of a header: new files in the cache beside the old ones, and no other."""
    component = components()["PositionController"]
    sources = fmu_sources(component, "", 2, component_files(component))

    def compiled(**changed: str) -> tuple[int, int]:
        before = contents(cache)
        library("PositionController", platform_named("this"), 2, {**sources, **changed})
        new = contents(cache).keys() - before.keys()
        return sum("objects" in file for file in new), sum("libraries" in file for file in new)

    assert compiled() == (2, 1)
    assert compiled() == (0, 0)
    for file, objects in (
        ("life.c", 1),
        ("component.c", 0),
        ("kernels.c", 1),
        ("component.h", 1),
        ("record.h", 1),
        ("kernel.h", 2),
    ):
        assert compiled(**{file: sources[file] + "\n"}) == (objects, 1), file


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_library_has_the_token_of_its_description_and_no_other(fmi, tmp_path):
    fmu = build_native_fmu(components()["PositionController"], tmp_path, fmi, ("x86_64-linux",))
    assert len(re.findall(rb"\{[-0-9a-f]{36}\}", binary_of(fmu).read_bytes())) == 1


def test_builds_side_by_side_and_one_that_was_killed_leave_the_same_cache(cache, tmp_path):
    """Three processes with one empty cache, then one that is killed while it compiles and another after it."""
    side_by_side = [built(tmp_path / f"fmus{i}") for i in range(3)]
    assert [process.wait() for process in side_by_side] == [0, 0, 0]
    expected, fmus = contents(cache), [contents(tmp_path / f"fmus{i}") for i in range(3)]
    assert fmus[0] == fmus[1] == fmus[2]
    cache.rename(tmp_path / "first")
    killed = built(tmp_path / "killed")
    while not list(cache.glob("objects/*.lock")) and killed.poll() is None:
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    assert killed.wait() != 0
    assert contents(cache).items() <= expected.items()
    assert built(tmp_path / "again").wait() == 0
    assert (contents(cache), contents(tmp_path / "again")) == (expected, fmus[0])


def test_what_the_processor_cannot_do_alone_is_linked_too(tmp_path):
    """A division of 128 bits is a function of the compiler's own library, which is left out where nothing needs it."""
    source, target = tmp_path / "wide.c", tmp_path / "wide.so"
    source.write_text(
        '__attribute__((visibility("default"))) long long wide(long long a, long long b) {\n'
        "    return (long long)(((__int128)a << 32) / b);\n}\n"
    )
    build_library([source], target, platform_named("this"), [])
    function = ctypes.CDLL(str(target)).wide
    function.restype, function.argtypes = ctypes.c_longlong, [ctypes.c_longlong] * 2
    assert function(3 << 40, 1 << 50) == (3 << 72) >> 50
