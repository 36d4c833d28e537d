"""Compiling C to libraries for every platform, by ziglang: one machine builds for all of them, offline."""

from __future__ import annotations

import importlib.util
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from shaper_fmu.errors import BuildError, nearest


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


def platform_named(name: str) -> Platform:
    """The platform of this name; "this" is the one that runs. Raises BuildError for an unknown name."""
    if name == "this":
        machine = platform.machine().lower()
        machine = {"amd64": "x86_64", "arm64": "aarch64", "i386": "i686", "x86": "i686"}.get(machine, machine)
        name = f"{machine}-{platform.system().lower()}"
    if name not in PLATFORMS:
        raise BuildError(f"there is no platform {name!r}.{nearest(name, PLATFORMS)}")
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


def build_library(sources: list[Path], target: Path, built_for: Platform, includes: list[Path]) -> None:
    """Compile C files, and link them to a shared library. Raises BuildError with the compiler's words."""
    toolchain_version()
    flags = [*_FLAGS, *[f"-I{folder}" for folder in includes], *_LINK]
    if built_for.suffix == ".dylib":
        flags.append(f"-Wl,-install_name,@rpath/{target.name}")
    else:
        flags.append("-Wl,--gc-sections")
    if built_for.suffix != ".dll":
        flags.append("-lm")
    _compile([*map(str, sources), *flags], target, built_for)


def compile_object(source: Path, target: Path, built_for: Platform, includes: list[Path]) -> None:
    """Compile a C file to an object of a shared library. Raises BuildError with the compiler's words."""
    toolchain_version()
    position = [] if built_for.suffix == ".dll" else ["-fPIC"]
    _compile(["-c", str(source), *_FLAGS, *position, *[f"-I{folder}" for folder in includes]], target, built_for)


def _compile(arguments: list[str], target: Path, built_for: Platform) -> None:
    # where the compiler runs, its output's name is relative: no path of this machine gets into the library
    command = [sys.executable, "-m", "ziglang", "cc", "-target", built_for.target, "-o", target.name, *arguments]
    done = subprocess.run(command, cwd=target.parent, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildError(f"compiling for {built_for.name} failed:\n{done.stderr.strip()[-3000:]}")
