"""Compiling C to libraries for every platform, by ziglang: one machine builds for all of them, offline."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import platform
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from shaper_fmu.errors import BuildError


@dataclass(frozen=True)
class Platform:
    """A platform that FMUs are built for.

    Attributes:
        name: what `--platform` takes.
        target: ziglang's name, with the oldest system that the library runs on.
        suffix: of a library's file name.
        fmi2_folder: FMI 2.0's name of the folder under binaries/ (2.0.5: other platforms use the tuple).
        fmi3_folder: FMI 3.0's, its platform tuple.
        usual: whether it is built for when nothing else is asked for.
    """

    name: str
    target: str
    suffix: str
    fmi2_folder: str
    fmi3_folder: str
    usual: bool = True

    @property
    def is_windows(self) -> bool:
        """Whether it is a Windows."""
        return self.suffix == ".dll"

    @property
    def has_all_arithmetic(self) -> bool:
        """Whether C is machine instructions and the system's libraries alone.

        Then nothing is needed of ziglang's own library for compilers, which it compiles at its first use, for seconds. Integers of
        64 bits need it on a processor of 32 bits; mathematics on Windows.
        """
        return not self.is_windows and not self.target.startswith("x86-")


PLATFORMS = {
    known.name: known
    for known in (
        Platform("x86_64-linux", "x86_64-linux-gnu.2.17", ".so", "linux64", "x86_64-linux"),
        Platform("aarch64-linux", "aarch64-linux-gnu.2.17", ".so", "aarch64-linux", "aarch64-linux"),
        Platform("x86_64-windows", "x86_64-windows-gnu", ".dll", "win64", "x86_64-windows"),
        Platform("x86_64-darwin", "x86_64-macos.11.0", ".dylib", "darwin64", "x86_64-darwin"),
        Platform("aarch64-darwin", "aarch64-macos.11.0", ".dylib", "aarch64-darwin", "aarch64-darwin"),
        # arithmetic of SSE2, which all of them have since 2001: that of the older x87 unit rounds otherwise
        Platform("i686-linux", "x86-linux-gnu.2.17", ".so", "linux32", "x86-linux", usual=False),
        Platform("i686-windows", "x86-windows-gnu", ".dll", "win32", "x86-windows", usual=False),
    )
}

USUAL_PLATFORMS = tuple(known.name for known in PLATFORMS.values() if known.usual)
"""The platforms that FMUs are built for when nothing else is asked for."""

WASM32 = Platform("wasm32", "wasm32-wasi", ".wasm", "", "", usual=False)
"""For modules of WebAssembly, which are no FMUs: FMI knows no such platform."""

WASM_COMPONENT = Platform("wasm32-wasip2", WASM32.target, WASM32.suffix, "", "wasm32-wasip2", usual=False)
"""For components of WebAssembly in FMUs of FMI 3.0, by the draft of the layered standard fmi-ls-wasm."""

# No contraction: a product and a sum are rounded each, as in Python. No sanitizer traps, which zig adds by default.
_FLAGS = [
    "-O2",
    "-g0",
    "-std=c99",
    "-fvisibility=hidden",
    "-fomit-frame-pointer",
    "-ffp-contract=off",
    "-fno-sanitize=all",
    "-fno-ident",
    "-w",
]
_LINK = ["-shared", "-s"]
# a stack of 1 MB, below all else: where it ends, memory ends, and the host is told
_LINK_MODULE = ["-mexec-model=reactor", "-s", "-Wl,--gc-sections", "-Wl,-z,stack-size=1048576", "-lm"]


def platform_named(name: str, component_fmi: int = 0) -> Platform:
    """The platform of this name; "this" is the one that runs. Raises BuildError for an unknown name.

    WASM_COMPONENT is for single components with FMI 3.0 alone: those give their version of FMI.
    """
    if name == "this":
        machine = platform.machine().lower()
        machine = {"amd64": "x86_64", "arm64": "aarch64", "i386": "i686", "x86": "i686"}.get(machine, machine)
        name = f"{machine}-{platform.system().lower()}"
    if name == WASM32.name:
        raise BuildError("wasm32 is no platform of FMUs; `build --wasm FOLDER` makes modules for pages")
    if name == WASM_COMPONENT.name:
        if component_fmi == 3:
            return WASM_COMPONENT
        what = f"FMI {component_fmi}.0" if component_fmi else "systems"
        raise BuildError(
            f"wasm32-wasip2 is not for {what}: the draft of fmi-ls-wasm is for FMI 3.0, and shaper-fmu builds single "
            "components for it (build NAME --fmi 3 --platform wasm32-wasip2)"
        )
    if name not in PLATFORMS:
        for known in PLATFORMS.values():
            if name.lower() in (known.fmi2_folder, known.fmi3_folder):  # as the folders in an FMU, and `info`, call it
                raise BuildError(f"there is no platform {name!r}. Did you mean {known.name!r}?")
        raise BuildError(f"there is no platform {name!r}. Known: this (the machine here), {', '.join(PLATFORMS)}.")
    return PLATFORMS[name]


def has_toolchain() -> bool:
    """Whether ziglang is installed."""
    return importlib.util.find_spec("ziglang") is not None


def toolchain_version() -> str:
    """The version of ziglang. Raises BuildError, which tells how to install it."""
    try:
        return version("ziglang")
    except PackageNotFoundError:
        raise BuildError("native FMUs are compiled by ziglang, which is not installed: pip install 'shaper-fmu[native]'") from None


def build_library(
    sources: list[Path], target: Path, built_for: Platform, includes: list[Path], runtime: Sequence[Path] = ()
) -> None:
    """Compile C files, and link them to a shared library. Raises BuildError with the compiler's words.

    `runtime`: objects and libraries that are tried in place of the platform's C library, which ziglang compiles at its first
    use, for minutes on Windows; where they do not have all that is needed, that one is linked.
    """
    _link([*map(str, sources), *_FLAGS, *[f"-I{folder}" for folder in includes]], target, built_for, [*map(str, runtime)])


def compile_object(source: Path, target: Path, built_for: Platform, includes: list[Path]) -> None:
    """Compile a C file to an object of a shared library. Raises BuildError with the compiler's words."""
    position = [] if built_for.is_windows else ["-fPIC"]
    _compile(["-c", str(source), *_FLAGS, *position, *[f"-I{folder}" for folder in includes]], target, built_for)


def import_library(definition: Path, target: Path, built_for: Platform) -> None:
    """Make the import library of a module definition, for a Windows. Raises BuildError with the tool's words."""
    machine = "i386" if built_for.target.startswith("x86-") else "i386:x86-64"
    _run(["dlltool", "-m", machine, "-d", definition.name, "-l", target.name], target, built_for)


def build_module(sources: list[Path], target: Path, includes: list[Path]) -> None:
    """Compile C files to a module of WebAssembly. Raises BuildError with the compiler's words."""
    _compile([*map(str, sources), *_FLAGS, *_LINK_MODULE, *[f"-I{folder}" for folder in includes]], target, WASM32)


def _link(arguments: list[str], target: Path, built_for: Platform, runtime: list[str]) -> None:
    flags = [*arguments, *_LINK]
    if built_for.suffix == ".dylib":
        flags.append(f"-Wl,-install_name,@rpath/{target.name}")
    else:
        flags.append("-Wl,--gc-sections")
    if not built_for.is_windows:
        flags.append("-lm")
    if runtime:
        with contextlib.suppress(BuildError):
            return _compile([*flags, *runtime, "-nostdlib", "-rtlib=compiler-rt"], target, built_for)
    if built_for.has_all_arithmetic:
        lean = ["-nostdlib", "-lc", *(["-Wl,-z,defs"] if built_for.suffix == ".so" else [])]
        with contextlib.suppress(BuildError):
            return _compile([*flags, *lean], target, built_for)
    _compile(flags, target, built_for)


def _compile(arguments: list[str], target: Path, built_for: Platform) -> None:
    # where the compiler runs, its output's name is relative: no path of this machine gets into the library
    _run(["cc", "-target", built_for.target, "-o", target.name, *arguments], target, built_for)


def _run(command: list[str], target: Path, built_for: Platform) -> None:
    toolchain_version()
    done = subprocess.run([*_zig(), *command], cwd=target.parent, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"compiling for {built_for.name} failed:\n{done.stderr.strip()[-3000:]}")


@functools.lru_cache(maxsize=1)
def _zig() -> list[str]:
    """The compiler's command. The package starts it by a Python of its own, which takes as long as to compile a small file."""
    found = importlib.util.find_spec("ziglang")
    folders = (found.submodule_search_locations or []) if found else []
    programs = [Path(folder) / name for folder in folders for name in ("zig", "zig.exe")]
    return next(([str(program)] for program in programs if program.is_file()), [sys.executable, "-m", "ziglang"])
