"""Finds components: in `shaper_fmu/commands/`, in `shaper_fmu/plants/`, and by the entry points of other packages.

A third party's package announces modules or classes in the entry-point group "shaper_fmu.components".
"""

from __future__ import annotations

import importlib.util
import inspect
import os
import re
import sys
import traceback
from pathlib import Path
from types import ModuleType

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError, nearest
from shaper_fmu.methods.announced import announced, leave_out, process_kept
from shaper_fmu.methods.discovery import modules_of

ENTRY_POINT_GROUP = "shaper_fmu.components"
_PACKAGES = ("shaper_fmu.commands", "shaper_fmu.plants")


def components_of(module: ModuleType) -> list[type[Component]]:
    """The components that a module defines (not those that it imports), in the order of the file."""
    return [c for c in vars(module).values() if _is_component(c) and c.__module__ == module.__name__]


def _is_component(found: object) -> bool:
    return inspect.isclass(found) and issubclass(found, Component) and found.step is not Component.step


def components() -> dict[str, type[Component]]:
    """All components by name, sorted; another package's that cannot be used is left out with a warning."""
    found: dict[str, type[Component]] = {}
    for name in _PACKAGES:
        for module in modules_of(name):
            for component in components_of(module):
                _add(found, component)
    for point, module, target in announced(ENTRY_POINT_GROUP):
        theirs = components_of(module) if inspect.ismodule(target) else [target] if _is_component(target) else []
        if not theirs:
            leave_out(point, "it names no subclass of Component with a step function, and no module that defines one")
        for component in theirs:
            try:
                _add(found, component)
            except ComponentError as error:
                leave_out(point, error)
    return dict(sorted(found.items()))


def _add(found: dict[str, type[Component]], component: type[Component]) -> None:
    """Take a component in. Raises ComponentError where another one has its name."""
    other = found.setdefault(component.__name__, component)
    if other is not component:
        raise ComponentError(f"two components are called {component.__name__}: in {other.__module__} and in {component.__module__}")


def find_component(name: str) -> type[Component]:
    """The component of this name. Raises ComponentError that suggests the nearest name."""
    known = components()
    if name not in known:
        raise ComponentError(f"there is no component {name!r}.{nearest(name, known)}")
    return known[name]


def _failed(path: Path, error: BaseException) -> str:
    """Why a file does not load, with its line."""
    file = os.path.realpath(path)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if os.path.realpath(frame.filename) == file]
    where = f"{path}:{lines[-1]}" if lines else str(path)
    if isinstance(error, ComponentError):
        return f"{where}: {error}"
    if isinstance(error, SystemExit):
        advice = "leave that out, or put it under if __name__ == '__main__'"
        return f"{where}: the file ends the process (exit status {error.code}) while it is loaded; {advice}"
    return f"{where}: {type(error).__name__}: {error}"


def load_components(path: Path) -> list[type[Component]]:
    """The components defined in a Python file of the user's. Raises ComponentError when there are none or it does not load."""
    if not path.is_file():
        raise ComponentError(f"{path}: no such file")
    # so that the file cannot take the place of a module of its name, and can be imported under it, whatever its name is
    name = re.sub(r"\W", "_", f"component_{path.stem}", flags=re.ASCII)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ComponentError(f"{path}: not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        with process_kept():
            spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, KeyboardInterrupt):
            raise
        raise ComponentError(_failed(path, error)) from error
    found = components_of(module)
    if not found:
        raise ComponentError(f"{path}: no subclass of shaper_fmu.Component with a step function in this file")
    return found
