"""Libraries of native FMUs, from the cache or compiled: what several of them share is compiled once for each platform.

A library is linked of three parts: the kernels, which both versions of FMI share, the layer of its version of FMI, which all
components share, and the component's table; on Windows of what stands in for the C library, too.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import fmpy

from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.native.sources import LAYER, TABLE, library_sources
from shaper_fmu.export.native.toolchain import Platform, build_library, compile_object, import_library, toolchain_version
from shaper_fmu.export.native.windows import IMPORTS, definition

_HEADERS = Path(fmpy.__file__).parent / "c-code"


def library(name: str, platform: Platform, fmi: int, sources: Mapping[str, str]) -> Path:
    """The shared library made of an FMU's sources."""
    kernels, table, layer = library_sources(sources, fmi)
    shared = [_object("kernels.c", kernels, platform), _object(LAYER, layer, platform)]
    runtime = _windows_runtime(platform) if platform.is_windows else []
    key = digest(_key(table, platform), *[file.name for file in (*shared, *runtime)])

    def make() -> bytes:
        with _written(table) as folder:
            target = folder / f"{name}{platform.suffix}"
            first = folder / TABLE
            if runtime:  # it is linked without the C library's headers, too
                first = first.with_suffix(".o")
                compile_object(folder / TABLE, first, platform, [])
            build_library([first, *shared], target, platform, [], runtime)
            return target.read_bytes()

    return cached("libraries", f"{name}-{key}{platform.suffix}", make)


def _windows_runtime(platform: Platform) -> list[Path]:
    source = Path(__file__).with_name("windows.c")
    return [
        _object(source.name, {source.name: source.read_text()}, platform),
        *[_import_library(part, platform) for part in IMPORTS],
    ]


def _import_library(part: str, platform: Platform) -> Path:
    def make() -> bytes:
        with _written({"part.def": definition(part)}) as folder:
            import_library(folder / "part.def", folder / "part.lib", platform)
            return (folder / "part.lib").read_bytes()

    return cached("objects", f"{_key({part: definition(part)}, platform)}.lib", make)


def _object(source: str, files: Mapping[str, str], platform: Platform) -> Path:
    """One of these files compiled; it includes the others."""

    def make() -> bytes:
        with _written(files) as folder:
            target = folder / "object.o"
            compile_object(folder / source, target, platform, [_HEADERS])
            return target.read_bytes()

    return cached("objects", f"{_key(files, platform)}.o", make)


def _key(files: Mapping[str, str], platform: Platform) -> str:
    tools = (toolchain_version(), version("fmpy"), platform.target, (Path(__file__).parent / "toolchain.py").read_bytes())
    return digest(*tools, *[part for file in sorted(files.items()) for part in file])


@contextmanager
def _written(files: Mapping[str, str]) -> Iterator[Path]:
    """A folder with these files."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        yield Path(folder)
