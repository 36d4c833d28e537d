"""The native backend: a component in an FMU of FMI 2.0 or 3.0 that carries machine code for every platform, and no Python."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType

from shaper_fmu.archives import write_archive
from shaper_fmu.component import Component
from shaper_fmu.export.documentation import documentation_page
from shaper_fmu.export.fmi2_description import fmi2_native_description
from shaper_fmu.export.fmi3_description import fmi3_native_description
from shaper_fmu.export.native.fmi_ls_wasm.build import wasm_files
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.native.libraries import library
from shaper_fmu.export.native.sources import fmu_sources, sources_folder
from shaper_fmu.export.native.toolchain import PLATFORMS, USUAL_PLATFORMS, WASM_COMPONENT, platform_named, toolchain_version
from shaper_fmu.export.packing import check_component, content_guid, licences
from shaper_fmu.export.terminals_and_icons import icon_and_terminals

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
    chosen = [platform_named(platform, fmi) for platform in platforms or USUAL_PLATFORMS]
    check_component(component)
    progress(f"{name}: kernels")
    page, own = _of_both_versions(component)
    generator = f"shaper-fmu {version('shaper-fmu')} with ziglang {toolchain_version()}"
    files = {"documentation/index.html": page, **licences("shaper-fmu")}
    files |= icon_and_terminals(component, fmi)
    draft = _DESCRIPTIONS[fmi](component, "", generator)
    without_token = sources_folder(component, fmi, fmu_sources(component, "", fmi, own))
    token = content_guid({**files, **without_token, "modelDescription.xml": draft})
    files["modelDescription.xml"] = _DESCRIPTIONS[fmi](component, token, generator)
    sources = fmu_sources(component, token, fmi, own)
    files |= sources_folder(component, fmi, sources)
    libraries = {}
    for platform in chosen:
        progress(f"{name}: FMI {fmi}.0, {platform.name}")
        if platform is WASM_COMPONENT:
            files |= wasm_files(component, sources)
            continue
        libraries[platform.name] = library(name, platform, fmi, sources).read_bytes()
    files |= _binaries(name, fmi, libraries)
    return write_archive(Path(folder) / f"{name}.fmu", files)


@functools.lru_cache(maxsize=1)  # whoever builds both versions builds them one after the other
def _of_both_versions(component: type[Component]) -> tuple[bytes, Mapping[str, str]]:
    """What takes long and is the same for both versions of FMI: the documentation page, and the component's own C files."""
    return documentation_page(component).encode(), MappingProxyType(component_files(component))


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
