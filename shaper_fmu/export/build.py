"""Builds FMUs with a backend, a version of FMI and platforms, or finds FMUs that exist already.

A wheel carries the native FMUs of all its components, so that its user needs no compiler. They are handed out as long as
they belong to the sources beside them; from a changed or plain source checkout, FMUs are built and kept in the cache.
"""

from __future__ import annotations

import functools
import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from shaper_fmu.archives import write_file
from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export import pythonfmu_backend
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.closure import packed_sources
from shaper_fmu.export.native.backend import build_native_fmu
from shaper_fmu.export.native.toolchain import USUAL_PLATFORMS, has_toolchain, platform_named, toolchain_version
from shaper_fmu.registry import components, find_component

SHIPPED = Path(__file__).parent.parent / "shipped"
_MANIFEST = "sources.txt"


class Backend(StrEnum):
    """The technology of an FMU."""

    native = "native"
    python = "python"


def build_fmu(
    component: type[Component],
    folder: Path | str,
    *,
    backend: Backend | str = Backend.native,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    progress: Callable[[str], None] = lambda what: None,
) -> Path:
    """Write `folder`/<component>.fmu and return its path.

    Args:
        component: the component's class.
        folder: where to; made if it is missing.
        backend: "native" (machine code, no Python inside) or "python" (its source, run by the host's Python).
        fmi: 2 or 3; the python backend knows FMI 2.0 only.
        platforms: names such as "i686-linux", or "this" for the one that runs; default: the five of 64 bits. With FMI 3.0 also
            "wasm32-wasip2", a component of WebAssembly (experimental; needs the extra `wasm`).
        progress: called with what is being done.

    Raises BuildError when the component cannot be built; then no file is written or changed.
    """
    if not isinstance(component, type):
        raise BuildError(f"build_fmu({component!r:.60}): a component's class is needed, such as find_component('MassSpringDamper')")
    if fmi not in (2, 3):
        raise BuildError(f"FMI {fmi} is not known; use 2 or 3")
    chosen = [platform_named(name, fmi).name for name in platforms] or list(USUAL_PLATFORMS)
    if Backend(backend) is Backend.python:
        if fmi != 2:
            raise BuildError("the python backend builds FMI 2.0 only; use --backend native for FMI 3.0")
        return pythonfmu_backend.build_fmu(component, folder)
    if not has_toolchain() and set(chosen) <= set(USUAL_PLATFORMS):
        shipped = shipped_fmu(component, fmi)
        if shipped is not None:
            progress(f"{component.__name__}: FMI {fmi}.0, as shipped, for all platforms")
            return write_file(Path(folder) / shipped.name, shipped.read_bytes())
    return build_native_fmu(component, folder, fmi, chosen, progress)


def fmu_path(
    component: str | type[Component], fmi: int = 2, *, backend: Backend | str = Backend.native, platforms: Sequence[str] = ()
) -> Path:
    """The path of a component's FMU, to be read, not changed: as it was shipped, or built once and kept in the cache.

    Args are those of `build_fmu`; the component may be given by its name. Raises ComponentError for an unknown name and
    BuildError when it cannot be built.
    """
    found = find_component(component) if isinstance(component, str) else component
    names = [platform_named(name, fmi).name for name in platforms] or list(USUAL_PLATFORMS)
    usual = Backend(backend) is Backend.native and set(names) <= set(USUAL_PLATFORMS)
    shipped = shipped_fmu(found, fmi) if usual else None
    if shipped is not None:
        return shipped
    tools = toolchain_version() if Backend(backend) is Backend.native else version("pythonfmu")
    date = os.environ.get("SOURCE_DATE_EPOCH", "")
    key = digest(sources_digest(found), tools, *_other_tools(), str(Backend(backend)), str(fmi), date, *names)

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as draft:
            return build_fmu(found, draft, backend=backend, fmi=fmi, platforms=names).read_bytes()

    return cached(f"fmus/{key}", f"{found.__name__}.fmu", make)


@functools.lru_cache(maxsize=1)  # whoever builds both versions builds them one after the other
def sources_digest(component: type[Component]) -> str:
    """Digest of the sources of a component's FMU: its own and the exporter's."""
    return digest(packed_sources(component)[0], _exporter_digest())


@functools.lru_cache(maxsize=1)
def _other_tools() -> tuple[str, ...]:
    """Versions of what else leaves its trace in an FMU: FMI's headers, the page's picture, the encoder of components."""
    return tuple(_version_or_none(name) for name in ("fmpy", "matplotlib", "wasmtime"))


def _version_or_none(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


@functools.lru_cache(maxsize=1)
def _exporter_digest() -> str:
    export = Path(__file__).parent
    files = sorted(file for file in export.rglob("*") if file.suffix in (".py", ".c", ".h"))
    return digest(version("shaper-fmu"), *[part for file in files for part in (file.name, file.read_bytes())])


def shipped_fmu(component: type[Component], fmi: int) -> Path | None:
    """The FMU that came with the installed package, unless the sources have changed since."""
    folder = SHIPPED / f"fmi{fmi}"
    path = folder / f"{component.__name__}.fmu"
    if not path.is_file() or components().get(component.__name__) is not component:
        return None
    known = dict(line.split() for line in (SHIPPED / _MANIFEST).read_text().splitlines())
    return path if known.get(component.__name__) == sources_digest(component) else None


def ship(folder: Path) -> None:
    """Build the FMUs that a wheel contains into this folder: all components, both versions of FMI, all platforms."""
    shutil.rmtree(folder, ignore_errors=True)
    for component in components().values():
        for fmi in (2, 3):
            write_file(folder / f"fmi{fmi}" / f"{component.__name__}.fmu", fmu_path(component, fmi).read_bytes())
    lines = [f"{name} {sources_digest(component)}" for name, component in components().items()]
    (folder / _MANIFEST).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    ship(SHIPPED)
