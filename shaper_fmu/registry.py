"""Finding components: in `shaper_fmu/commands/`, in `plants/`, and where third parties announce theirs.

A third party's package announces modules or classes in the entry-point group "shaper_fmu.components".
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import pkgutil
import sys
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError, nearest

ENTRY_POINT_GROUP = "shaper_fmu.components"
_PACKAGES = ("shaper_fmu.commands", "plants")


def components_of(module: ModuleType) -> list[type[Component]]:
    """The components that a module defines (not those that it imports), in the order of the file."""
    found = [c for c in vars(module).values() if inspect.isclass(c) and issubclass(c, Component)]
    return [c for c in found if c.__module__ == module.__name__ and c.step is not Component.step]


def components() -> dict[str, type[Component]]:
    """All components by name, sorted. Raises ComponentError when two different ones share a name."""
    found: dict[str, type[Component]] = {}
    for candidate in [*_built_in(), *_announced()]:
        other = found.setdefault(candidate.__name__, candidate)
        if other is not candidate:
            raise ComponentError(
                f"two components are called {candidate.__name__}: in {other.__module__} and in {candidate.__module__}"
            )
    return dict(sorted(found.items()))


def _built_in() -> list[type[Component]]:
    found = []
    for name in _PACKAGES:
        package = importlib.import_module(name)
        for entry in pkgutil.iter_modules(package.__path__, f"{name}."):
            found += components_of(importlib.import_module(entry.name))
    return found


def _announced() -> list[type[Component]]:
    found = []
    for point in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda p: (p.name, p.value)):
        try:
            target = point.load()
        except Exception as error:
            raise ComponentError(f"entry point {point.name} = {point.value} cannot be loaded: {error}") from error
        found += components_of(target) if inspect.ismodule(target) else [target]
    return found


def find_component(name: str) -> type[Component]:
    """The component of this name. Raises ComponentError that suggests the nearest name."""
    known = components()
    if name not in known:
        raise ComponentError(f"there is no component {name!r}.{nearest(name, known)}")
    return known[name]


def load_components(path: Path) -> list[type[Component]]:
    """The components defined in a Python file of the user's. Raises ComponentError when there are none or it does not load."""
    if not path.is_file():
        raise ComponentError(f"{path}: no such file")
    name = f"component_{path.stem}"  # so that the file cannot take the place of a module of its name
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ComponentError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise ComponentError(f"{path}: {type(error).__name__}: {error}") from error
    found = components_of(module)
    if not found:
        raise ComponentError(f"{path}: no subclass of shaper_fmu.Component with a step function in this file")
    return found
