"""Public names: the stub file of a package, `__init__.pyi`, lists them, each with the module that defines it.

Type checkers read the stub; at run time a module is imported when one of its names is first used, so that `import shaper_fmu` is
quick. This is what SPEC 1 of Scientific Python calls lazy loading, with the names written once.
"""

from __future__ import annotations

import ast
import functools
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from shaper_fmu.renamed import warn_renamed
from shaper_fmu.syntax import parse

RENAMED = {"shaper_fmu": {"Wish": "Requirements", "wish_for": "requirements_for"}}
"""Package -> old public name -> the new one. The old ones are importable, too, and warn."""

_ROOT = Path(__file__).parent


@functools.cache
def homes(package: str) -> dict[str, str]:
    """Name -> the module that defines it, for the names that can be imported from a package; empty if it has no stub file."""
    stub = _stub(package)
    if package.split(".")[0] != "shaper_fmu" or not stub.is_file():
        return {}
    imports = [node for node in parse(stub.read_text(encoding="utf-8")).body if isinstance(node, ast.ImportFrom)]
    found: dict[str, str] = {}
    for node in imports:
        module = str(node.module)
        found |= homes(module) if node.names[0].name == "*" else {alias.name: module for alias in node.names}
    return found


def packages() -> list[str]:
    """The packages that have a stub file: the top, then its sub-packages."""
    return ["shaper_fmu", *sorted(f"shaper_fmu.{stub.parent.name}" for stub in _ROOT.glob("*/__init__.pyi"))]


def public(package: str) -> list[str]:
    """The names that a package's `__all__` has: what its stub file says, else all of them."""
    for node in parse(_stub(package).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return ast.literal_eval(node.value)
    return sorted(homes(package))


def lazily(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """A package's `__getattr__`, `__dir__` and `__all__`."""
    known, names, renamed = homes(package), public(package), RENAMED.get(package, {})

    def get(name: str) -> Any:
        if name in renamed:
            warn_renamed(f"{package}.{name}", renamed[name])
            name = renamed[name]
        if name not in known and name in _sub_packages(package):
            return importlib.import_module(f"{package}.{name}")
        if name not in known:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(known[name]), name)

    return get, lambda: sorted({*known, *names, *_sub_packages(package)}), names


def _sub_packages(package: str) -> list[str]:
    """The public sub-packages: those with a stub file."""
    return [name.rpartition(".")[2] for name in packages() if name.rpartition(".")[0] == package]


def _stub(package: str) -> Path:
    return _ROOT.joinpath(*package.split(".")[1:], "__init__.pyi")
