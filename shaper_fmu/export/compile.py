"""Compiling a component's kernels: from the Python source to machine code that needs no Python.

The kernels are ordinary Python functions over the record. numba compiles them with the record as a C struct; every
function they call, reached through globals and closures, is made known to it. `freestanding_ir` gives LLVM IR without
a single Python symbol, which a C compiler turns into a library for any platform.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import cfunc, types
from numba.core.errors import NumbaError
from numba.extending import overload, register_jitable

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError

KERNELS: dict[str, int] = {"start": 0, "step": 2}
"""Names of the kernels and the number of doubles that each takes beside the record."""

_OPTIONS: dict[str, Any] = {"error_model": "numpy"}
_registered: set[FunctionType] = set()


def record_dtype(component: type[Component]) -> np.dtype:
    """The record as a C struct: doubles for Real, ints for all other types, arrays in place."""
    kinds = {"d": "f8", "i": "i4"}
    fields = [(v.name, kinds[v.code], () if v.size is None else (v.size,)) for v in component.variables.values()]
    return np.dtype(fields, align=True)


def record_of(instance: Component) -> np.ndarray:
    """The values of a plain component as a record, shape (1,)."""
    record = np.zeros(1, record_dtype(type(instance)))
    for name in instance.variables:
        record[name] = getattr(instance, name)
    return record


def register(function: FunctionType) -> FunctionType:
    """Make a plain function, and all plain functions that it uses, callable from compiled code."""
    if function not in _registered:
        _registered.add(function)
        used = [function.__globals__.get(name) for name in function.__code__.co_names]
        used += [cell.cell_contents for cell in function.__closure__ or ()]
        for value in used:
            if isinstance(value, FunctionType):
                register(value)
        register_jitable(**_OPTIONS)(function)
    return function


def _status(value):  # replaced in compiled code by the overload below
    return value or 0


@overload(_status)
def _compiled_status(value):
    if isinstance(value, types.NoneType):
        return lambda value: 0
    if isinstance(value, types.Optional):
        return lambda value: 0 if value is None else value
    return lambda value: value


def _entry(component: type[Component], kernel: str) -> Callable[..., int]:
    """The kernel as a function of the record and its doubles that returns a status number."""
    function = register(getattr(component, kernel))
    if KERNELS[kernel] == 0:
        return lambda record: _status(function(record))
    return lambda record, t, h: _status(function(record, t, h))


def jit(component: type[Component], kernel: str) -> Callable[..., int]:
    """The kernel compiled for this process: call it with `record[0]` of a record array and the kernel's doubles."""
    return numba.njit(**_OPTIONS)(_entry(component, kernel))


def freestanding_ir(component: type[Component], kernel: str, symbol: str) -> str:
    """LLVM IR that defines `int symbol(int *status, void **unused, record *, double ...)` and refers to libm alone.

    Raises BuildError, with the compiler's words, when the kernel uses what does not compile.
    """
    entry = numba.njit(**_OPTIONS)(_entry(component, kernel))
    record = types.CPointer(numba.from_dtype(record_dtype(component)))
    signature = types.int32(record, *[types.float64] * KERNELS[kernel])

    carray = numba.carray  # pyright: ignore[reportPrivateImportUsage]

    def kernel_entry(pointer):
        return entry(carray(pointer, 1)[0])

    def kernel_entry_with_time(pointer, t, h):
        return entry(carray(pointer, 1)[0], t, h)

    try:
        compiled = cfunc(signature, **_OPTIONS)(kernel_entry_with_time if KERNELS[kernel] else kernel_entry)
    except NumbaError as error:
        raise BuildError(f"{component.__name__}.{kernel} does not compile: {error}") from error
    library: Any = compiled._library  # pyright: ignore[reportAttributeAccessIssue]
    return _without_python(library.get_llvm_str(), symbol)


def _without_python(text: str, symbol: str) -> str:
    """Keep what the kernel needs of numba's module: the inner function, not the wrapper that reports to Python."""
    defined = re.findall(r"^define[^\n]*@\"?([^\s\"(]+)\"?\(", text, re.MULTILINE)
    inner = next(n for n in defined if "kernel_entry" in n and not n.startswith("cfunc"))
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly(text)
    for value in [*module.functions, *module.global_variables]:
        if not value.is_declaration and value.name != inner:
            value.linkage = "internal"
    machine = llvm.Target.from_default_triple().create_target_machine()
    passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes.getModulePassManager().run(module, passes)
    text = str(module).replace(inner, symbol)
    for line in re.findall(r"^declare[^\n]*@\"?([^\s\"(]+)\"?\(", text, re.MULTILINE):
        if re.match(r"Py|NRT|numba", line):
            raise BuildError(f"the compiled kernel still refers to {line}: it uses memory or exceptions of Python's")
    text = re.sub(r"^target (triple|datalayout) = .*\n", "", text, flags=re.MULTILINE)
    return re.sub(r'"target-(cpu|features)"="[^"]*"', "", text)
