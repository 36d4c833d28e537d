"""The platforms that FMUs have libraries for."""

from __future__ import annotations

from shaper_fmu.export.native.toolchain import PLATFORMS, Platform
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.master.structure import SystemStructure

_FAT = b"\xca\xfe\xba\xbe"
"""How a library for several processors of macOS begins."""


def library_folders(fmu: Fmu, platform: Platform) -> list[str]:
    """The folders below binaries/ in which a container on this platform looks for the FMU's library, the first of them first."""
    if fmu.version == 3:
        return [platform.fmi3_folder]
    return [platform.fmi2_folder, *(["darwin64"] if platform.name == "aarch64-darwin" else [])]


def platforms_of(fmu: Fmu) -> list[str]:
    """The names of the platforms that the FMU has a library for."""
    return [name for name, platform in PLATFORMS.items() if _has_library(fmu, platform)]


def _has_library(fmu: Fmu, platform: Platform) -> bool:
    for folder in library_folders(fmu, platform):
        path = fmu.folder / "binaries" / folder / f"{fmu.capabilities.modelIdentifier}{platform.suffix}"
        if path.is_file():
            shared = folder == platform.fmi2_folder or fmu.version == 3  # else it must have a part for this processor
            if shared or path.read_bytes()[:4] == _FAT:
                return True
    return False


def common_platforms(system: SystemStructure) -> list[str]:
    """The names of the platforms that every FMU of the system has a library for."""
    found = [set(platforms_of(fmu)) for fmu in system.fmus.values()]
    return [name for name in PLATFORMS if found and all(name in one for one in found)]
