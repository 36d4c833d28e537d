"""The pythonfmu backend: the component's Python source in an FMI 2.0 co-simulation FMU, run by the host's Python."""

from __future__ import annotations

import hashlib
import uuid
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path

import pythonfmu

from shaper_fmu.archives import write_archive
from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError, nearest
from shaper_fmu.export.closure import packed_sources
from shaper_fmu.export.documentation import documentation_page
from shaper_fmu.export.model_description import fmi2_model_description

_CAPABILITIES = {
    "needsExecutionTool": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}

_ENTRY = """\
from {root}.{module} import {name} as _Component
from {root}.shaper_fmu.export.slave import ComponentSlave, keep

keep(globals())


class {name}(ComponentSlave):
    component = _Component
"""


def build_fmu(component: type[Component], folder: Path | str) -> Path:
    """Write `folder`/<component>.fmu and return its path. Equal sources give equal bytes and an equal GUID.

    Raises BuildError when the component cannot be packed; then no file is written or changed.
    """
    name = component.__name__
    check_component(component)
    root, sources = packed_sources(component)
    entry = f"entry_{root.removeprefix('shaper_fmu_')}"
    files = {f"resources/{path}": text.encode() for path, text in sources.items()}
    files[f"resources/{entry}.py"] = _ENTRY.format(root=root, module=component.__module__, name=name).encode()
    files["resources/slavemodule.txt"] = entry.encode()
    files["documentation/index.html"] = documentation_page(component).encode()
    files |= _licences()
    files |= _wrappers(name)
    generator = f"shaper-fmu {version('shaper-fmu')} with pythonfmu {version('pythonfmu')}"
    draft = fmi2_model_description(component, "", generator, _CAPABILITIES)
    guid = _content_guid({**files, "modelDescription.xml": draft})
    files["modelDescription.xml"] = fmi2_model_description(component, guid, generator, _CAPABILITIES)
    return write_archive(Path(folder) / f"{name}.fmu", files)


def check_component(component: type[Component]) -> None:
    """Try the component as it is declared. Raises BuildError for what would surface only when the FMU runs."""
    name = component.__name__
    if not (name.isascii() and name.isidentifier()):
        raise BuildError(f"{name}: the name of a component must be an ASCII identifier, since the FMU's library is called so")
    instance = component()
    try:
        instance.initialize(0.0)
        instance.do_step(0.0, component.default_step_size)
    except Exception as error:
        raise BuildError(f"{name} does not run with its start values: {error}") from error
    for attribute in vars(instance):
        if attribute not in component.variables:
            raise BuildError(f"{name} sets {attribute!r}, which is not declared.{nearest(attribute, component.variables)}")


def _wrappers(name: str) -> dict[str, bytes]:
    """pythonfmu's native wrappers, which load the host's Python."""
    binaries = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    found = {f"binaries/{p.parent.name}/{name}{p.suffix}": p.read_bytes() for p in sorted(binaries.glob("*/*pythonfmu-export.*"))}
    if not found:
        raise BuildError(f"pythonfmu's wrappers are missing in {binaries}; reinstall pythonfmu")
    return found


def _licences() -> dict[str, bytes]:
    """The licence texts of what the FMU carries."""
    texts = {}
    for package in ("shaper-fmu", "pythonfmu"):
        try:
            files = distribution(package).files or []
        except PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE"):
                texts[f"documentation/licenses/{package}.txt"] = Path(str(file.locate())).read_bytes()
    return texts


def _content_guid(files: dict[str, bytes]) -> str:
    digest = hashlib.sha256()
    for path, content in sorted(files.items()):
        digest.update(f"{path}\0{len(content)}\0".encode() + content)
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"
