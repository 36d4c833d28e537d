"""The loop as a library: C, called by ctypes, which lets go of Python's lock meanwhile.

A wheel carries one for each platform, which is used as long as it belongs to the sources beside it. Else it is built once, by
ziglang or by a C compiler of the machine, and kept in the cache.
"""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.errors import BuildError
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.native.toolchain import (
    PLATFORMS,
    Platform,
    build_library,
    has_toolchain,
    platform_named,
    toolchain_version,
)
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_header import loop_header

LOOP = Path(__file__).parent / "loop"
_LIBRARIES = Path(__file__).parent.parent / "shipped" / "loop"
_MANIFEST = "sources.txt"
_COMPILERS = ("cc", "gcc", "clang")
_FLAGS = ["-std=c99", "-O2", "-g0", "-fPIC", "-shared", "-fvisibility=hidden", "-fomit-frame-pointer", "-ffp-contract=off", "-w"]
_NONE = (
    "the master's loop, which is compiled once, is not there and cannot be compiled: install ziglang (pip install "
    "'shaper-fmu[native]'), a C compiler such as gcc or clang, or a wheel of shaper-fmu, which carries the loop"
)


class Loop:
    """The library's functions; see loop/loop.h and ends.h. Truth values are numbers, 0 for no."""

    def __init__(self, library: ctypes.CDLL):
        self.library: ctypes.CDLL = library
        address, number, truth = ctypes.c_void_p, ctypes.c_int64, ctypes.c_int
        control = ctypes.POINTER(of.Control)

        def function(name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
            found = getattr(library, name)
            found.restype, found.argtypes = result, arguments
            return found

        self.begin_early: Callable[..., Any] = function("loop_begin_early", truth, address, control, ctypes.c_double)
        self.initialize: Callable[..., Any] = function("loop_initialize", truth, address, control, ctypes.c_double)
        self.exchange: Callable[..., Any] = function("loop_exchange", truth, address, control, ctypes.c_double)
        self.start_clocks: Callable[..., Any] = function("loop_start_clocks", truth, address, control)
        self.begin: Callable[..., Any] = function("loop_begin", truth, address, control, ctypes.c_double, truth)
        self.first_row: Callable[..., Any] = function("loop_first_row", None, address, control)
        self.run: Callable[..., Any] = function("loop_run", truth, address, control, number)
        self.plan_step: Callable[..., Any] = function("loop_plan_step", None, address, control)
        self.take_planned_step: Callable[..., Any] = function("loop_take_planned_step", truth, address, control)
        self.whole_runs: Callable[..., Any] = function("loop_whole_runs", None, address, control, truth, ctypes.POINTER(of.Runs))
        self.arithmetic_mode: Callable[..., Any] = function("loop_arithmetic_mode", ctypes.c_uint64)
        self.standard_arithmetic: Callable[..., Any] = function("loop_standard_arithmetic", ctypes.c_uint64)
        self.set_arithmetic_mode: Callable[..., Any] = function("loop_set_arithmetic_mode", None, ctypes.c_uint64)
        self.hear_ends: Callable[..., Any] = function("ends_hear", truth, ctypes.c_void_p)
        self.enter_calls: Callable[..., Any] = function("ends_enter", None, ctypes.c_char_p, ctypes.c_size_t)
        self.leave_calls: Callable[..., Any] = function("ends_leave", None)
        self.is_in_calls: Callable[..., Any] = function("ends_in_calls", truth)


@functools.lru_cache(maxsize=1)
def loop() -> Loop:
    """The loop, loaded when it is needed first. Raises BuildError, which tells what to install, where it cannot be."""
    reasons: list[str] = []
    for find in (_shipped, _built_by_ziglang, _built_by_a_compiler):
        path = None
        try:
            path = find()
            if path is not None:
                return Loop(ctypes.CDLL(str(path)))
        except BuildError as error:
            reasons.append(f"\n{error}")
        except (OSError, AttributeError) as error:  # one for another system, or damaged
            reasons.append(f"\n{path} cannot be loaded: {error}")
    raise BuildError(_NONE + "".join(reasons))


def sources() -> list[Path]:
    """The library's C files."""
    return [*sorted(LOOP.glob("*.c")), LOOP.parent / "ends.c"]


def sources_digest() -> str:
    """What the library is made from."""
    files = [*sources(), *sorted(LOOP.glob("*.h")), LOOP.parent / "ends.h"]
    return digest(loop_header(), *[part for file in files for part in (file.name, file.read_bytes())])


def write_unit(folder: Path) -> tuple[Path, list[Path]]:
    """Write the header and one file that includes all others to this folder, so that the compiler sees all of the loop at once.

    Returns the file, and the folders of the headers."""
    unit = folder / "unit.c"
    (folder / "layout.h").write_text(loop_header())
    unit.write_text('#include "ends.h"\n' + "".join(f'#include "{file.name}"\n' for file in sources()))
    return unit, [folder, LOOP, LOOP.parent]


def _this_platform() -> Platform | None:
    try:
        return platform_named("this")
    except BuildError:
        return None


def _shipped() -> Path | None:
    platform = _this_platform()
    path = _LIBRARIES / _file_name(platform) if platform is not None else None
    if path is None or not path.is_file():
        return None
    return path if (_LIBRARIES / _MANIFEST).read_text().strip() == sources_digest() else None


def _file_name(platform: Platform) -> str:
    return f"{platform.name}{platform.suffix}"


def _built_by_ziglang() -> Path | None:
    platform = _this_platform()
    return _library_for(platform) if platform is not None and has_toolchain() else None


def _library_for(platform: Platform) -> Path:
    """The library for this platform, by ziglang."""

    def build(unit: Path, target: Path, includes: list[Path]) -> None:
        build_library([unit], target, platform, includes)

    return _kept(digest(sources_digest(), toolchain_version(), platform.target), platform.suffix, build)


def _built_by_a_compiler() -> Path | None:
    compiler = next(filter(None, map(shutil.which, _COMPILERS)), None)
    if compiler is None:
        return None
    words = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout

    def build(unit: Path, target: Path, includes: list[Path]) -> None:
        command = [compiler, *_FLAGS, *[f"-I{folder}" for folder in includes], str(unit), "-o", str(target), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise BuildError(f"{compiler} does not compile the master's loop:\n{done.stderr.strip()[-3000:]}")

    suffix = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
    return _kept(digest(sources_digest(), words, *_FLAGS), suffix, build)


def _kept(key: str, suffix: str, build: Callable[[Path, Path, list[Path]], None]) -> Path:
    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            unit, includes = write_unit(Path(folder))
            target = Path(folder) / f"loop{suffix}"
            build(unit, target, includes)
            return target.read_bytes()

    return cached("loop", f"{key}{suffix}", make)


_SHIPPED_FOR = [platform for platform in PLATFORMS.values() if not platform.name.startswith("i686")]
"""Where addresses have 32 bits, records are laid out otherwise than here: there it is built."""


def ship(folder: Path, platforms: Iterable[Platform] = _SHIPPED_FOR) -> None:
    """Build what a wheel carries into this folder: the library for all platforms whose addresses have 64 bits."""
    for platform in platforms:
        write_file(folder / _file_name(platform), _library_for(platform).read_bytes())
    write_file(folder / _MANIFEST, sources_digest().encode())


if __name__ == "__main__":
    ship(_LIBRARIES)
