"""Finds components: in `shaper_fmu/commands/`, in `shaper_fmu/plants/`, and by the entry points of other packages.

A third party's package announces modules or classes in the entry-point group "shaper_fmu.components".
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import os
import pkgutil
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType
from typing import NoReturn

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError, nearest

ENTRY_POINT_GROUP = "shaper_fmu.components"
_PACKAGES = ("shaper_fmu.commands", "shaper_fmu.plants")


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


@contextmanager
def _process_kept() -> Iterator[None]:
    """Restores what a file changes while it is loaded, and reports a file that ends the process."""
    folder, leave = os.getcwd(), os._exit

    def refused(status: int = 0) -> NoReturn:
        raise SystemExit(status)

    os._exit = refused
    try:
        yield
    finally:
        os._exit = leave
        os.chdir(folder)


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
        with _process_kept():
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
