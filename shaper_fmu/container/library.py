"""The library of containers: C, the same for all systems, which reads its system from the FMU's resources.

A wheel carries one for each version of FMI and platform; from other sources it is built by ziglang and kept in the cache.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import fmpy

from shaper_fmu.archives import write_file
from shaper_fmu.container.fields import fields_header
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.native.toolchain import PLATFORMS, USUAL_PLATFORMS, Platform, build_library, toolchain_version
from shaper_fmu.master.loop_header import loop_header
from shaper_fmu.master.loop_library import LOOP

_RUNTIME = Path(__file__).parent / "runtime"
_SHIPPED = Path(__file__).parent.parent / "shipped" / "container"
_MANIFEST = "sources.txt"
_COMMON = (
    "reader.c", "file.c", "outer.c", "numbers.c", "libraries.c", "messages.c", "inner.c", "life.c", "stepping.c", "slopes.c",
    "values.c", "states.c",
)  # fmt: skip
_FACES = {2: ("fmi2.c",), 3: ("fmi3.c", "fmi3_absent.c")}


def library_sources(fmi: int) -> list[Path]:
    """The C files of a container of this version of FMI, but for the loop's."""
    return [_RUNTIME / name for name in (*_COMMON, *_FACES[fmi])]


def sources_digest() -> str:
    """What the libraries are made from."""
    files = sorted(file for folder in (_RUNTIME, LOOP) for file in folder.iterdir() if file.suffix in (".c", ".h"))
    return digest(loop_header(), fields_header(), *[part for file in files for part in (file.name, file.read_bytes())])


def write_sources(folder: Path, fmi: int) -> tuple[list[Path], list[Path]]:
    """Write what is generated to this folder; returns the C files to compile, and the folders of headers.

    The loop is one file that includes all of its own, so that the compiler sees it at once; nothing of it has an external name.
    """
    unit = folder / "loop.c"
    unit.write_text("#define LOOP_API\n" + "".join(f'#include "{file.name}"\n' for file in sorted(LOOP.glob("*.c"))))
    (folder / "layout.h").write_text(loop_header())
    (folder / "fields.h").write_text(fields_header())
    return [unit, *library_sources(fmi)], [folder, _RUNTIME, LOOP, Path(fmpy.__file__).parent / "c-code"]


def container_library(fmi: int, platform: Platform) -> bytes:
    """The library: as shipped, or built. Raises BuildError where it cannot be built."""
    shipped = _SHIPPED / f"fmi{fmi}" / f"{platform.name}{platform.suffix}"
    manifest = _SHIPPED / _MANIFEST
    if shipped.is_file() and manifest.read_text().strip() == sources_digest():
        return shipped.read_bytes()
    key = digest(sources_digest(), toolchain_version(), platform.target, str(fmi))

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            sources, includes = write_sources(Path(folder), fmi)
            target = Path(folder) / f"container{platform.suffix}"
            build_library(sources, target, platform, includes)
            return target.read_bytes()

    return cached("container", f"{key}{platform.suffix}", make).read_bytes()


def ship(folder: Path) -> None:
    """Build what a wheel carries into this folder."""
    for fmi in _FACES:
        for name in USUAL_PLATFORMS:
            platform = PLATFORMS[name]
            write_file(folder / f"fmi{fmi}" / f"{name}{platform.suffix}", container_library(fmi, platform))
    write_file(folder / _MANIFEST, sources_digest().encode())


if __name__ == "__main__":
    ship(_SHIPPED)
