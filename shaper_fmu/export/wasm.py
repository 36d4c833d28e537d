"""A component's kernels as one module of WebAssembly, for pages and other hosts without FMI.

The module imports nothing, the mathematics library is inside. It holds one record in its memory and exports `init` (start
values), `start(t)` and `step(t, h)`, which return the number of a message, `record` and `fault` (addresses), and `memory`.
kernel.js reads and writes the record's variables by name; `layout` tells it where they are.
"""

from __future__ import annotations

import enum
import json
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from shaper_fmu.archives import write_file
from shaper_fmu.component import Component, Variable
from shaper_fmu.export.c.unit import field_name
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.description_parts import summary
from shaper_fmu.export.native import toolchain
from shaper_fmu.export.native.toolchain import WASM32, build_module, toolchain_version
from shaper_fmu.export.packing import check_component
from shaper_fmu.export.plain_c import KERNEL_H, plain_c

LOADER = Path(__file__).parent / "kernel.js"
"""The loader that pages carry."""

SHIPPED = Path(__file__).parent.parent / "shipped" / "wasm"
"""The modules that a wheel carries, each under the digest of the C that it is made of."""

_MODULE = """\
#include "{name}.c"

#define EXPORTED(name) __attribute__((export_name(name)))

static {name} record;
static Fault fault;

EXPORTED("record") void *wasm_record(void) {{ return &record; }}
EXPORTED("fault") void *wasm_fault(void) {{ return &fault; }}
EXPORTED("init") void wasm_init(void) {{ {name}_init(&record); }}
EXPORTED("start") int wasm_start(double t) {{ return {name}_start(&record, t, &fault); }}
EXPORTED("step") int wasm_step(double t, double h) {{ return {name}_step(&record, t, h, &fault); }}

_Static_assert(sizeof({name}) == {size}, "the layout that the loader is told");
{offsets}
"""


def wasm_module(component: type[Component]) -> bytes:
    """The module: as it was shipped, from the cache, or compiled. Raises BuildError for what does not compile."""
    check_component(component)
    name, files = component.__name__, _files(component)
    shipped = SHIPPED / _shipped_name(name, files)
    if shipped.is_file():
        return shipped.read_bytes()
    tools = toolchain_version(), Path(toolchain.__file__).read_bytes()
    key = digest(*tools, *[part for file in sorted(files.items()) for part in file])

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for file, text in files.items():
                (Path(folder) / file).write_text(text, encoding="utf-8")
            target = Path(folder) / f"{name}{WASM32.suffix}"
            build_module([Path(folder) / "module.c"], target, [])
            return target.read_bytes()

    return cached("modules", f"{name}-{key}{WASM32.suffix}", make).read_bytes()


def is_shipped(component: type[Component]) -> bool:
    """Whether the module came with the installed package."""
    return (SHIPPED / _shipped_name(component.__name__, _files(component))).is_file()


def ship_modules(components: Iterable[type[Component]], folder: Path) -> None:
    """Write the modules that a wheel carries into this folder."""
    for component in components:
        write_file(folder / _shipped_name(component.__name__, _files(component)), wasm_module(component))


def _files(component: type[Component]) -> dict[str, str]:
    """The C files of the module, `module.c` is the one that is compiled."""
    name, found = component.__name__, layout(component)
    places = ((v.name, found["variables"][v.name]["offset"]) for v in component.variables.values())
    offsets = "".join(
        f"_Static_assert(__builtin_offsetof({name}, {field_name(component, n)}) == {at}, {json.dumps(n)});\n" for n, at in places
    )
    files = {**plain_c(component), "kernel.h": KERNEL_H.read_text(encoding="utf-8")}
    return {**files, "module.c": _MODULE.format(name=name, size=found["size"], offsets=offsets)}


def _shipped_name(name: str, files: dict[str, str]) -> str:
    return f"{name}-{digest(*[part for file in sorted(files.items()) for part in file])}{WASM32.suffix}"


def layout(component: type[Component]) -> dict[str, Any]:
    """What the loader knows of a component: its variables their places in the record, and its messages."""
    variables, at = {}, 0
    for v in component.variables.values():
        width = 8 if v.kind is float else 4
        at = -(-at // width) * width
        variables[v.name] = {**_said(v), "offset": at}
        at += width * (v.size or 1)
    return {
        "component": component.__name__,
        "summary": summary(component),
        "size": -(-at // 8) * 8,
        "step": component.default_step_size,
        "stop": component.default_stop_time,
        "messages": {str(status): text for status, text in sorted(component.messages.items())},
        "variables": variables,
    }


def _said(v: Variable[Any]) -> dict[str, Any]:
    said: dict[str, Any] = {"kind": "real" if v.kind is float else "boolean" if v.kind is bool else "integer", "size": v.size or 0}
    if v.causality == "state":
        return said
    told = {"causality": v.causality, "unit": v.unit, "description": v.description}
    bounds = {"min": v.min, "max": v.max, "exclusive": v.exclusive or None}
    items = {item.name: int(item) for item in v.kind} if issubclass(v.kind, enum.IntEnum) else None
    return {**said, **told, **{key: value for key, value in {**bounds, "items": items}.items() if value is not None}}


def write_wasm(component: type[Component], folder: Path) -> list[Path]:
    """Write <component>.wasm, its layout <component>.json and kernel.js, and return their paths. Raises BuildError."""
    name = component.__name__
    files = {
        f"{name}{WASM32.suffix}": wasm_module(component),
        f"{name}.json": (json.dumps(layout(component), indent=1, ensure_ascii=False) + "\n").encode(),
        LOADER.name: LOADER.read_bytes(),
    }
    return [write_file(folder / file, content) for file, content in files.items()]
