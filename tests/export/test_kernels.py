"""Every component's kernels, compiled: the same bits as plain Python, and no Python symbol left."""

from __future__ import annotations

import ctypes
import random
import re

import llvmlite.binding as llvm
import numpy as np
import pytest
from trial_runs import allowed, varied

from shaper_fmu.component import Component, Output
from shaper_fmu.errors import BuildError
from shaper_fmu.export.compile import KERNELS, freestanding_ir, jit, record_of
from shaper_fmu.registry import components

LIBM = {
    "sqrt",
    "exp",
    "sin",
    "cos",
    "pow",
    "fmod",
    "tan",
    "acos",
    "asin",
    "atan",
    "atan2",
    "log",
    "fabs",
    "sinh",
    "cosh",
    "floor",
    "ceil",
}


class NativeKernels:
    """The freestanding code, run in this process: nothing but the C library is there to be linked with."""

    def __init__(self, component: type[Component]):
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine()
        self.texts = {name: freestanding_ir(component, name, f"kernel_{name}") for name in KERNELS}
        modules = [llvm.parse_assembly(text) for text in self.texts.values()]
        self.engine = llvm.create_mcjit_compiler(modules[0], machine)
        self.engine.add_module(modules[1])
        self.engine.finalize_object()

    def __call__(self, name: str, record: np.ndarray, *arguments: float) -> int:
        status, unused = ctypes.c_int(), ctypes.c_void_p()
        kinds = [ctypes.c_void_p] * 3 + [ctypes.c_double] * KERNELS[name]
        function = ctypes.CFUNCTYPE(ctypes.c_int, *kinds)(self.engine.get_function_address(f"kernel_{name}"))
        assert function(ctypes.addressof(status), ctypes.addressof(unused), record.ctypes.data, *arguments) == 0
        return status.value


@pytest.mark.parametrize("name", components())
def test_plain_compiled_and_freestanding_agree_bit_for_bit(name):
    component, rng = components()[name], random.Random(name)
    native = NativeKernels(component)
    start, step = jit(component, "start"), jit(component, "step")
    for _ in range(3):
        plain = component(**varied(component, rng))
        compiled = record_of(plain)
        freestanding = compiled.copy()
        plain.initialize(0.0)
        assert (start(compiled[0]), native("start", freestanding)) == (0, 0)
        assert (step(compiled[0], 0.0, 0.0), native("step", freestanding, 0.0, 0.0)) == (0, 0)
        t = 0.0
        for _ in range(150):
            for variable in component.variables.values():
                if variable.causality == "input":
                    value = allowed(variable, rng.choice([0.0, 0.05, rng.uniform(-0.1, 0.1)]))
                    value = value if variable.size is None else [value] * variable.size
                    setattr(plain, variable.name, value)
                    compiled[variable.name] = freestanding[variable.name] = value
            h = rng.choice([0.0, 0.01, 0.013, 0.05])
            plain.do_step(t, h)
            assert (step(compiled[0], t, h), native("step", freestanding, t, h)) == (0, 0)
            expected = record_of(plain)
            for field in expected.dtype.names or ():
                assert expected[field].tobytes() == compiled[field].tobytes() == freestanding[field].tobytes(), field
            t += h


@pytest.mark.parametrize("name", components())
def test_freestanding_code_refers_to_the_maths_library_alone(name):
    for kernel in KERNELS:
        text = freestanding_ir(components()[name], kernel, f"kernel_{kernel}")
        declared = set(re.findall(r"^declare[^\n]*@\"?([^\s\"(]+)\"?\(", text, re.MULTILINE))
        assert {symbol for symbol in declared if not symbol.startswith("llvm.")} <= LIBM
        assert len(re.findall(rf"^define[^\n]*@kernel_{kernel}\(", text, re.MULTILINE)) == 1


def test_what_does_not_compile_is_named():
    class Wordy(Component):
        value = Output("", "a number")

        def step(self, t, h):
            self.value = float(sorted({"b": 1.0, "a": 2.0}.items(), key=str)[0][1])

    with pytest.raises(BuildError, match=r"Wordy.step does not compile"):
        freestanding_ir(Wordy, "step", "kernel_step")
