"""The native backend: a component in an FMU of FMI 2.0 or 3.0 that carries machine code for every platform, and no Python."""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import fmpy

from shaper_fmu.archives import write_archive
from shaper_fmu.component import Component
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.documentation import documentation_page
from shaper_fmu.export.fmi2_description import fmi2_native_description
from shaper_fmu.export.fmi3_description import fmi3_native_description
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.native.table import component_table
from shaper_fmu.export.native.toolchain import (
    PLATFORMS,
    USUAL_PLATFORMS,
    Platform,
    build_library,
    compile_object,
    platform_named,
    toolchain_version,
)
from shaper_fmu.export.packing import check_component, content_guid, licences
from shaper_fmu.export.terminals_and_icons import icon_and_terminals

_LAYER = ("values.c", "messages.c", "states.c", "life.c", "exchange.c", "derivatives.c")
_VERSIONS = {2: ("fmi2.c",), 3: ("fmi3.c", "fmi3_simulation.c", "fmi3_absent.c")}
_HEADERS = ("kernel.h", "component.h", "fmi3.h")
_DESCRIPTIONS = {2: fmi2_native_description, 3: fmi3_native_description}


def build_native_fmu(
    component: type[Component],
    folder: Path | str,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    progress: Callable[[str], None] = lambda what: None,
) -> Path:
    """Write `folder`/<component>.fmu for this version of FMI and these platforms (default: the usual five), and return its path.

    Equal sources and tools give equal bytes. `progress` is told what is being done. Raises BuildError, and then no file
    is written or changed.
    """
    name = component.__name__
    chosen = [platform_named(platform) for platform in platforms or USUAL_PLATFORMS]
    check_component(component)
    progress(f"{name}: kernels")
    own = component_files(component)
    generator = f"shaper-fmu {version('shaper-fmu')} with ziglang {toolchain_version()}"
    files = {"documentation/index.html": documentation_page(component).encode(), **licences("shaper-fmu")}
    files |= icon_and_terminals(component, fmi)
    draft = _DESCRIPTIONS[fmi](component, "", generator)
    table = component_table(component, "")
    made_of = {file.name: file.read_bytes() for file in _layer_files(fmi)} | {n: text.encode() for n, text in own.items()}
    token = content_guid({**files, **made_of, "modelDescription.xml": draft, "table.c": table.encode()})
    files["modelDescription.xml"] = _DESCRIPTIONS[fmi](component, token, generator)
    libraries = {}
    for platform in chosen:
        progress(f"{name}: FMI {fmi}.0, {platform.name}")
        libraries[platform.name] = library(component, token, fmi, platform, own).read_bytes()
    files |= _binaries(name, fmi, libraries)
    return write_archive(Path(folder) / f"{name}.fmu", files)


def library(component: type[Component], token: str, fmi: int, platform: Platform, own: dict[str, str]) -> Path:
    """The shared library of a component, from the cache or compiled."""
    # one translation unit: the compiler sees the table while it compiles the layer, which makes a step twice as fast
    unit = component_table(component, token) + "".join(f'#include "{file.name}"\n' for file in layer_sources(fmi))
    contents = [file.read_bytes() for file in [*_layer_files(fmi), Path(__file__).parent / "toolchain.py"]]
    key = digest(unit, toolchain_version(), platform.target, *own.values(), *contents)

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in {**own, "component.c": unit}.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            target = Path(folder) / f"{component.__name__}{platform.suffix}"
            includes = [Path(folder), Path(__file__).parent, Path(fmpy.__file__).parent / "c-code"]
            build_library([Path(folder) / "component.c", kernel_object(own, platform)], target, platform, includes)
            return target.read_bytes()

    return cached("libraries", f"{component.__name__}-{key}{platform.suffix}", make)


def kernel_object(own: dict[str, str], platform: Platform) -> Path:
    """The kernels alone, compiled: both versions of FMI are linked with them."""
    runtime = [(Path(__file__).parent / name).read_bytes() for name in ("kernel.h", "toolchain.py")]
    key = digest(*own.values(), *runtime, toolchain_version(), platform.target)

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in own.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            target = Path(folder) / "kernels.o"
            compile_object(Path(folder) / "kernels.c", target, platform, [Path(folder), Path(__file__).parent])
            return target.read_bytes()

    return cached("objects", f"{key}.o", make)


def layer_sources(fmi: int) -> list[Path]:
    """The C files of the generic layer for this version of FMI."""
    return [Path(__file__).parent / name for name in (*_LAYER, *_VERSIONS[fmi])]


def _layer_files(fmi: int) -> list[Path]:
    return [*layer_sources(fmi), *[Path(__file__).parent / name for name in _HEADERS]]


def _binaries(name: str, fmi: int, libraries: dict[str, bytes]) -> dict[str, bytes]:
    """The libraries under the folders where importers look for them."""
    found = {}
    for platform_name, content in libraries.items():
        platform = PLATFORMS[platform_name]
        folder = platform.fmi2_folder if fmi == 2 else platform.fmi3_folder
        found[f"binaries/{folder}/{name}{platform.suffix}"] = content
    if fmi == 2 and {"x86_64-darwin", "aarch64-darwin"} <= libraries.keys():  # importers on both look into darwin64
        found[f"binaries/darwin64/{name}.dylib"] = universal_library(libraries["x86_64-darwin"], libraries["aarch64-darwin"])
    return found


def universal_library(x86_64: bytes, aarch64: bytes) -> bytes:
    """Both Mach-O libraries in one file: a big-endian header, then each library on a page of 16 KiB (Apple's fat format)."""
    page = 1 << 14
    content = struct.pack(">II", 0xCAFEBABE, 2)
    first = page
    second = first + -(-len(x86_64) // page) * page
    content += struct.pack(">5I", 0x01000007, 3, first, len(x86_64), 14)
    content += struct.pack(">5I", 0x0100000C, 0, second, len(aarch64), 14)
    return content.ljust(first, b"\0") + x86_64.ljust(second - first, b"\0") + aarch64
