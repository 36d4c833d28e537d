"""Compiling a component's kernels: from the Python source to machine code that needs no Python.

The kernels are ordinary Python functions over the record. numba compiles them with the record as a C struct; every
function they call, reached through globals and closures, is made known to it. `freestanding_ir` gives LLVM IR without
a single Python symbol, which a C compiler turns into a library for any platform.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import cfunc, types
from numba.core import config
from numba.extending import overload, register_jitable

from shaper_fmu.component import Component
from shaper_fmu.export.compile_errors import explained, explained_symbols
from shaper_fmu.export.kernel_reader import used_names
from shaper_fmu.export.kernel_source import check_kernels

KERNELS: dict[str, int] = {"start": 0, "step": 2}
"""Names of the kernels and the number of doubles that each takes beside the record."""

_OPTIONS: dict[str, Any] = {"error_model": "numpy"}
_registered: set[FunctionType] = set()
_config: Any = config


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
        for value in used_names(function).values():
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


def _entry(function: FunctionType, kernel: str) -> Callable[..., int]:
    """The kernel as a function of the record and its doubles that returns a status number."""
    register(function)
    if KERNELS[kernel] == 0:
        return lambda record: _status(function(record))
    return lambda record, t, h: _status(function(record, t, h))


def jit(component: type[Component], kernel: str) -> Callable[..., int]:
    """The kernel compiled for this process: call it with `record[0]` of a record array and the kernel's doubles."""
    return numba.njit(**_OPTIONS)(_entry(getattr(component, kernel), kernel))


def freestanding_ir(component: type[Component], kernel: str, symbol: str) -> str:
    """LLVM IR that defines `int symbol(int *status, void **unused, record *, double ...)` and refers to libm alone.

    Equal sources give equal text, whatever was compiled before. Raises BuildError that names file, line and what is wrong
    when the kernels use what does not compile.
    """
    check_kernels(component)
    function = getattr(component, kernel)
    try:
        text = _llvm_text(component, kernel, function)
    except Exception as error:  # the compiler raises KeyError, TypeError and others beside its own errors
        raise explained(component, kernel, error) from error
    module, inner = _without_wrappers(text)
    left = [f.name for f in module.functions if f.is_declaration and re.match(r"_?Py|NRT|numba", f.name)]
    if left:
        raise explained_symbols(component, kernel, left, _text_with_lines(component, kernel, function))
    return _normalised(module, inner, symbol)


def _llvm_text(component: type[Component], kernel: str, function: FunctionType) -> str:
    """numba's LLVM IR of a kernel, with all that it calls."""
    entry = numba.njit(**_OPTIONS)(_entry(function, kernel))
    record = types.CPointer(numba.from_dtype(record_dtype(component)))
    signature = types.int32(record, *[types.float64] * KERNELS[kernel])

    carray = numba.carray  # pyright: ignore[reportPrivateImportUsage]

    def kernel_entry(pointer):
        return entry(carray(pointer, 1)[0])

    def kernel_entry_with_time(pointer, t, h):
        return entry(carray(pointer, 1)[0], t, h)

    compiled = cfunc(signature, **_OPTIONS)(kernel_entry_with_time if KERNELS[kernel] else kernel_entry)
    library: Any = compiled._library  # pyright: ignore[reportAttributeAccessIssue]
    return library.get_llvm_str()


def _text_with_lines(component: type[Component], kernel: str, function: FunctionType) -> str:
    """The same with debug information. Functions are compiled once, so fresh copies of them are needed."""
    before = _config.DEBUGINFO_DEFAULT
    _config.DEBUGINFO_DEFAULT = 1
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what debug information costs
            return _llvm_text(component, kernel, _copied(function, {}))
    finally:
        _config.DEBUGINFO_DEFAULT = before


def _copied(function: FunctionType, copies: dict[FunctionType, FunctionType]) -> FunctionType:
    """A copy of a function that calls copies of the plain functions among its globals."""
    if function not in copies:
        names = dict(function.__globals__)
        copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
        copies[function] = copy
        for name, value in used_names(function).items():
            if isinstance(value, FunctionType) and names.get(name) is value:
                names[name] = _copied(value, copies)
    return copies[function]


def _without_wrappers(text: str) -> tuple[Any, str]:
    """numba's module reduced to what the kernel needs: the inner function, not the wrapper that reports to Python."""
    defined = re.findall(r"^define[^\n]*@\"?([^\s\"(]+)\"?\(", text, re.MULTILINE)
    inner = next(n for n in defined if "kernel_entry" in n and not n.startswith("cfunc"))
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly(text)
    for value in [*module.functions, *module.global_variables]:
        if not value.is_declaration and value.name != inner:
            value.linkage = "internal"
    module.get_function(inner).visibility = "hidden"  # every FMU of a process has kernels of these names
    machine = llvm.Target.from_default_triple().create_target_machine()
    passes = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes.getModulePassManager().run(module, passes)
    return module, inner


def _normalised(module: Any, inner: str, symbol: str) -> str:
    """The module's text without what differs from run to run (numba numbers what it compiles) and from machine to machine."""
    for i, variable in enumerate(v for v in module.global_variables if not v.is_declaration):
        variable.name = f"constant_{i}"
    defined = [function for function in module.functions if not function.is_declaration]
    for i, function in enumerate(defined):
        function.name = symbol if function.name == inner else f"{symbol}_{i}"
        for block in function.blocks:
            block.name = ""
            for instruction in block.instructions:
                if str(instruction.type) != "void":
                    instruction.name = ""
    text = re.sub(r'!"_Z[^"]*"', '!"scope"', str(module))
    text = re.sub(r"^target (triple|datalayout) = .*\n", "", text, flags=re.MULTILINE)
    return re.sub(r'"target-(cpu|features)"="[^"]*"', "", text)
