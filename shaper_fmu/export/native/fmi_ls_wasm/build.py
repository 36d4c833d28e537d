"""The files of an FMU for wasm32-wasip2: the component, from the cache or compiled, and the layered standard's manifest."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import fmpy
from lxml import etree

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.description_parts import as_bytes
from shaper_fmu.export.native import toolchain
from shaper_fmu.export.native.fmi_ls_wasm import encoding, interfaces
from shaper_fmu.export.native.sources import UNIT
from shaper_fmu.export.native.toolchain import WASM_COMPONENT, build_module, toolchain_version

LAYERED_STANDARD = "org.modelica.fmi-ls-wasm"
DRAFT = "0.1.0"
"""The draft has no number of its own; this is its example."""

_ADAPTER = [Path(__file__).parent / name for name in ("adapter.c", "methods.h")]
_NAMESPACE = "http://fmi-standard.org/fmi-ls-manifest"
_HEADERS = Path(fmpy.__file__).parent / "c-code"


def wasm_files(component: type[Component], sources: Mapping[str, str]) -> dict[str, bytes]:
    """The files by their paths in the FMU; `sources` are its C files. Raises BuildError."""
    name = component.__name__
    binary = wasm_component(name, sources, component.continuous_states is not None)
    place = f"extra/{LAYERED_STANDARD}"
    # the draft says manifest.xml, FMI 3.0.1 says fmi-ls-manifest.xml for all layered standards
    manifests = {f"{place}/{file}": _manifest() for file in ("manifest.xml", "fmi-ls-manifest.xml")}
    return {f"binaries/{WASM_COMPONENT.fmi3_folder}/{name}{WASM_COMPONENT.suffix}": binary, **manifests}


def wasm_component(name: str, sources: Mapping[str, str], exchange: bool) -> bytes:
    """The component of WebAssembly made of an FMU's C files, with model exchange or without. Raises BuildError."""
    define = "#define WITH_MODEL_EXCHANGE\n" if exchange else ""
    unit = f'{define}#include "{UNIT}"\n#include "adapter.c"\n'
    files = {**{file: text for file, text in sources.items() if file.endswith((".c", ".h"))}, "module.c": unit}
    files |= {file.name: file.read_text(encoding="utf-8") for file in _ADAPTER}
    own = [Path(str(module.__file__)).read_bytes() for module in (toolchain, encoding, interfaces)]
    tools = toolchain_version(), _encoder_version(), version("fmpy")
    key = digest(*tools, *own, *[part for file in sorted(files.items()) for part in file])

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for file, text in files.items():
                (Path(folder) / file).write_text(text, encoding="utf-8")
            target = Path(folder) / f"{name}{WASM_COMPONENT.suffix}"
            build_module([Path(folder) / "module.c", Path(folder) / "kernels.c"], target, [_HEADERS])
            return encoding.wrapped(target.read_bytes(), exchange)

    return cached("components", f"{name}-{key}{WASM_COMPONENT.suffix}", make).read_bytes()


def _encoder_version() -> str:
    try:
        return version("wasmtime")
    except PackageNotFoundError:
        raise BuildError(
            "wasm32-wasip2 is encoded by the package wasmtime, which is not installed: pip install 'shaper-fmu[wasm]'"
        ) from None


def _manifest() -> bytes:
    root = etree.Element(f"{{{_NAMESPACE}}}fmiLayeredStandardManifest", nsmap={"fmi-ls": _NAMESPACE})
    told = {"name": LAYERED_STANDARD, "version": DRAFT, "description": "FMI Layered Standard for WebAssembly"}
    for word, value in told.items():
        root.set(f"{{{_NAMESPACE}}}fmi-ls-{word}", value)
    return as_bytes(root)
