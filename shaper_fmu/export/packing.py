"""The steps that all backends share when they pack a component into an FMU."""

from __future__ import annotations

import hashlib
import uuid
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError, ShaperFmuError, nearest
from shaper_fmu.export.declarations import check_declaration


def check_component(component: type[Component]) -> None:
    """Try the component as it is declared. Raises BuildError for what would surface only when the FMU runs."""
    name = component.__name__
    check_declaration(component)
    try:
        instance = component()
        instance.initialize(0.0)
        instance.do_step(0.0, component.default_step_size)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit, too: a kernel that ends the process would end its host
        message = str(error) if isinstance(error, ShaperFmuError) else f"{type(error).__name__}: {error}"
        raise BuildError(f"{name} does not run with its start values: {message}") from error
    for attribute in vars(instance):
        if attribute not in component.variables:
            raise BuildError(f"{name} sets {attribute!r}, which is not declared.{nearest(attribute, component.variables)}")


def licences(*packages: str) -> dict[str, bytes]:
    """The licence texts of installed packages that the FMU carries parts of."""
    texts = {}
    for package in packages:
        try:
            files = distribution(package).files or []
        except PackageNotFoundError:
            continue
        for file in files:
            if file.name.upper().startswith("LICENSE"):
                texts[f"documentation/licenses/{package}.txt"] = Path(str(file.locate())).read_bytes()
    return texts


def content_guid(files: dict[str, bytes]) -> str:
    """A GUID that stands for these files."""
    digest = hashlib.sha256()
    for path, content in sorted(files.items()):
        digest.update(f"{path}\0{len(content)}\0".encode() + content)
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"
