"""The pythonfmu backend: the component's Python source in an FMI 2.0 co-simulation FMU, run by the host's Python."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import pythonfmu

from shaper_fmu.archives import write_archive
from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError
from shaper_fmu.export.closure import packed_sources
from shaper_fmu.export.documentation import documentation_page
from shaper_fmu.export.model_description import fmi2_model_description
from shaper_fmu.export.packing import check_component, content_guid, licences
from shaper_fmu.export.terminals_and_icons import icon_and_terminals

_CAPABILITIES = {
    "needsExecutionTool": "true",
    "canHandleVariableCommunicationStepSize": "true",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
}

_ENTRY = """\
from {root}.{module} import {name} as _Component
from {root}.shaper_fmu.export._slave import ComponentSlave, keep

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
    files |= licences("shaper-fmu", "pythonfmu")
    files |= icon_and_terminals(component, 2)
    files |= _wrappers(name)
    generator = f"shaper-fmu {version('shaper-fmu')} with pythonfmu {version('pythonfmu')}"
    draft = fmi2_model_description(component, "", generator, _CAPABILITIES)
    guid = content_guid({**files, "modelDescription.xml": draft})
    files["modelDescription.xml"] = fmi2_model_description(component, guid, generator, _CAPABILITIES)
    return write_archive(Path(folder) / f"{name}.fmu", files)


def _wrappers(name: str) -> dict[str, bytes]:
    """pythonfmu's native wrappers, which load the host's Python."""
    binaries = Path(pythonfmu.__file__).parent / "resources" / "binaries"
    found = {f"binaries/{p.parent.name}/{name}{p.suffix}": p.read_bytes() for p in sorted(binaries.glob("*/*pythonfmu-export.*"))}
    if not found:
        raise BuildError(f"pythonfmu's wrappers are missing in {binaries}; reinstall pythonfmu")
    return found
