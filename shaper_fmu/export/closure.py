"""Which modules a component needs, as sources to be packed into an FMU under a private root package.

FMUs of one process share `sys.modules`. Packed under a name that is a hash of their content, two FMUs with different
code can never run each other's.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.util
import sys
from pathlib import Path
from types import FunctionType

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError, nearest
from shaper_fmu.public_names import homes
from shaper_fmu.syntax import parse

_SLAVE_MODULE = "shaper_fmu.export._slave"


def packed_sources(component: type[Component]) -> tuple[str, dict[str, str]]:
    """Name of the private root package, and the FMU's Python files: path under resources/ -> source.

    Raises BuildError when a module imports what an FMU cannot carry.
    """
    bases = [base for base in component.__mro__ if issubclass(base, Component)]
    packages = {"shaper_fmu", "pythonfmu", *(base.__module__.split(".")[0] for base in bases)}
    sources: dict[str, str] = {}
    pending = [component.__module__, _SLAVE_MODULE]
    while pending:
        module = pending.pop()
        if module not in sources:
            made = _made_source(module)
            if made is not None:
                packages |= _roots(made)
            file = source_file(component) if module == component.__module__ else _source_file(module)
            sources[module] = _text(file) if made is None else made
            pending += _imported(module, sources[module], packages)
    digest = hashlib.sha256(repr((component.__name__, sorted(sources.items()))).encode()).hexdigest()[:16]
    root = f"shaper_fmu_{digest}"
    files = {f"{root}/__init__.py": ""}
    for module, source in sources.items():
        parts = module.split(".")
        for depth in range(1, len(parts)):
            files["/".join([root, *parts[:depth], "__init__.py"])] = ""
        files["/".join([root, *parts]) + ".py"] = _rerooted(module, source, packages, root)
    return root, dict(sorted(files.items()))


def _made_source(module: str) -> str | None:
    """The source of a module that was made from methods when it was imported (see shaper_fmu/methods); None for any other."""
    return getattr(importlib.import_module(module), "PACKED_SOURCE", None) if module.startswith("shaper_fmu.kinds.") else None


def _roots(made: str) -> set[str]:
    """The packages of the methods that a module was made from."""
    imported = {_target("", node).split(".")[0] for node in _import_statements(made) if isinstance(node, ast.ImportFrom)}
    return imported - set(sys.stdlib_module_names)


def source_file(component: type[Component]) -> Path:
    """The file that defines the component. The class tells it: its module's name may meanwhile stand for another file."""
    own = next((value for value in vars(component).values() if isinstance(value, FunctionType)), None)
    return Path(own.__code__.co_filename) if own is not None else _source_file(component.__module__)


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise BuildError(f"{file}: byte {error.start + 1} is not UTF-8; save the file as UTF-8") from None


def _source_file(module: str) -> Path:
    origin = getattr(sys.modules.get(module), "__file__", None)
    if origin is None:
        spec = importlib.util.find_spec(module)
        origin = spec.origin if spec else None
    if origin is None or not origin.endswith(".py"):
        raise BuildError(f"module {module} has no Python source, so it cannot be packed into an FMU")
    return Path(origin)


def _import_statements(source: str) -> list[ast.Import | ast.ImportFrom]:
    return [node for node in ast.walk(parse(source)) if isinstance(node, ast.Import | ast.ImportFrom)]


def _target(module: str, node: ast.ImportFrom) -> str:
    """The absolute name of the module that `from ... import` names inside `module`."""
    if node.level == 0:
        return node.module or ""
    base = module.split(".")[: -node.level]
    return ".".join([*base, node.module] if node.module else base)


def _imported(module: str, source: str, packages: set[str]) -> list[str]:
    found = []
    for node in _import_statements(source):
        where = f"module {module}, line {node.lineno}"
        for target in [_target(module, node)] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]:
            top = target.split(".")[0]
            if isinstance(node, ast.ImportFrom) and homes(target):
                found += [home for home, _ in _public(target, node, where)]
            elif top in packages and isinstance(node, ast.ImportFrom):
                if _source_file(target).name == "__init__.py":
                    raise BuildError(f"{where}: import from the module that defines the name, not from the package {target!r}")
                found.append(target)
            elif top in packages:
                raise BuildError(f"{where}: write 'from {target} import ...' so that the module can be packed into an FMU")
            elif top not in sys.stdlib_module_names:
                raise BuildError(
                    f"{where}: an FMU carries no {top!r}; components may import the standard library and shaper_fmu only"
                )
    return found


def _public(package: str, node: ast.ImportFrom, where: str) -> list[tuple[str, ast.alias]]:
    """The names that are imported from a package, each with the module that defines it. Raises BuildError for one that is none."""
    known = homes(package)
    for alias in node.names:
        if alias.name not in known:
            raise BuildError(f"{where}: {package} has no public name {alias.name!r}.{nearest(alias.name, known)}")
    return [(known[alias.name], alias) for alias in node.names]


def _rerooted(module: str, source: str, packages: set[str], root: str) -> str:
    """The source with imports of packed packages pointing under the private root; all lines keep their numbers.

    Imports from `shaper_fmu` and its public sub-packages become imports from the modules that define the names.
    """
    lines = source.encode().splitlines(keepends=True)
    for node in sorted(_import_statements(source), key=lambda n: (n.lineno, n.col_offset), reverse=True):
        target = str(node.module) if isinstance(node, ast.ImportFrom) else ""
        if not isinstance(node, ast.ImportFrom) or node.level or target.split(".")[0] not in packages:
            continue
        names = _public(target, node, module) if homes(target) else [(target, alias) for alias in node.names]
        origins = {home: [ast.unparse(alias) for where, alias in names if where == home] for home, _ in names}
        imports = [f"from {root}.{home} import {', '.join(aliases)}" for home, aliases in origins.items()]
        first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
        head, rest = lines[first][: node.col_offset], lines[last][node.end_col_offset :]
        lines[first : last + 1] = [head + "; ".join(imports).encode() + rest, *[b"\n"] * (last - first)]
    return b"".join(lines).decode()
