"""FMUs of FMI 3.0 for wasm32-wasip2, run by wasmtime as an importer of the draft of fmi-ls-wasm runs them."""

from __future__ import annotations

import functools
import io
import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import wasmtime
from wasmtime.component import Component, Linker

PACKAGE = "fmi:fmi3/{}@3.0.0"
ENGINE = wasmtime.Engine()
STATUSES = ("ok", "warning", "discard", "error", "fatal")
TYPES = {"Float64": "float64", "Int32": "int32", "Boolean": "boolean", "Enumeration": "int64"}


@functools.lru_cache(maxsize=4)
def loaded(fmu: Path) -> tuple[Component, Any, str]:
    """The compiled component, the model description read by fmpy, and the token."""
    described = fmpy.read_model_description(str(fmu))
    return Component(ENGINE, component_of(fmu)), described, str(described.guid)


def component_of(fmu: Path) -> bytes:
    """The file for wasm32-wasip2."""
    with zipfile.ZipFile(io.BytesIO(fmu.read_bytes())) as archive:
        return archive.read(f"binaries/wasm32-wasip2/{fmu.stem}.wasm")


class Guest:
    """A component that is instantiated: a sandbox, in which any number of FMU instances live."""

    def __init__(self, fmu: Path, callbacks: bool = True):
        self.component, self.description, self.token = loaded(fmu)
        self.log: list[tuple[str, str, str, str]] = []
        self.told: Callable[[Any], None] = lambda _store: None
        self.store = wasmtime.Store(ENGINE)
        linker = Linker(ENGINE)
        with linker.root() as root:
            with root.add_instance(PACKAGE.format("types")):
                pass
            if callbacks:
                with root.add_instance(PACKAGE.format("callbacks")) as instance:
                    instance.add_func("log-message", self._log_message)
        self.instance = linker.instantiate(self.store, self.component)

    def _log_message(self, store: Any, name: str, status: str, category: str, message: str) -> None:
        self.log.append((name, status, category, message))
        self.told(store)

    def function(self, interface: str, name: str) -> Any:
        inside = self.instance.get_export_index(self.store, PACKAGE.format(interface))
        index = self.instance.get_export_index(self.store, name, inside)
        assert index is not None, name
        found = self.instance.get_func(self.store, index)
        assert found is not None, name
        return functools.partial(found, self.store)

    def version(self) -> str:
        return self.function("common", "get-version")()


class Instance:
    """An FMU's instance in a guest."""

    def __init__(self, guest: Guest, name: str = "one", kind: str = "co-simulation", token: str = "", events: bool = False,
                 early: bool = False, logging: bool = False, required: tuple[int, ...] = ()):  # fmt: skip
        self.guest, self.kind = guest, kind
        more = (events, early, list(required)) if kind == "co-simulation" else ()
        make = guest.function(kind, f"[static]{kind}-instance.instantiate-{kind}")
        self.handle = make(name, token or guest.token, "", False, logging, *more)
        self.variables = {v.name: v for v in guest.description.modelVariables}

    def call(self, method: str, *arguments: Any) -> Any:
        """A status, or a value; a result's error is the status."""
        return self.guest.function(self.kind, f"[method]{self.kind}-instance.{method}")(self.handle, *arguments)

    def free(self) -> None:
        self.handle.drop(self.guest.store)

    def get(self, *names: str) -> list[Any]:
        """The values of variables of one type, all elements."""
        chosen = [self.variables[name] for name in names]
        return self.call(f"get-{TYPES[chosen[0].type]}", [v.valueReference for v in chosen])

    def set(self, name: str, value: Any) -> str:
        variable = self.variables[name]
        convert = {"Float64": float, "Boolean": bool}.get(variable.type, int)
        values = [convert(one) for one in (value if isinstance(value, list) else [value])]
        return self.call(f"set-{TYPES[variable.type]}", [variable.valueReference], values)

    def size(self, name: str) -> int:
        dimensions = self.variables[name].dimensions
        return math.prod(int(d.start) for d in dimensions) if dimensions else 1

    def results(self, causality: str = "output") -> list[float]:
        """All elements of all variables of this causality, as numbers."""
        names = [v.name for v in self.variables.values() if v.causality == causality]
        return [float(value) for name in names for value in self.get(name)]
