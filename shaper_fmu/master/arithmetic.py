"""How this thread's processor rounds, flushes denormal numbers and traps: an FMU that leaves it changed changes nobody's numbers.

The mode that is kept is the one that C begins with: to the nearest, with denormal numbers, without traps. The compiled loop looks
after every call of an FMU whether sums are rounded as they should be, in less than a nanosecond (to read MXCSR takes four); traps,
and what is changed in the x87 alone, are put back with the rest of the process's state. Other processors are not looked after.
"""

from __future__ import annotations

import platform
import sys
from typing import Any

import numba
import numpy as np
from llvmlite import binding, ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from shaper_fmu.master.loop_cache import CACHES

binding.initialize_native_asmparser()  # two instructions of the x87 have no other name

_I64 = ir.IntType(64)
_MXCSR = 0x1F80
_X87 = 0x27F if sys.platform == "win32" else 0x37F  # long double has 53 bits there, and 64 elsewhere


_BIG = [1.0, -1.0, 2.0**-140, 0.0]
_LITTLE = [0.75 * 2.0**-23, -0.75 * 2.0**-23, 2.0**-140, 0.0]
"""Single precision: to the nearest, 1 and 3/4 of its last place make the next number, and -1 the same; the others are denormal."""


class Arm:
    """FPCR."""

    STANDARD = 0

    @staticmethod
    def mode(builder: Any) -> Any:
        """Generate code that reads the mode."""
        return _called(builder, "llvm.aarch64.get.fpcr", _I64)

    @staticmethod
    def set_mode(builder: Any, mode: Any) -> None:
        """Generate code that sets the mode."""
        _called(builder, "llvm.aarch64.set.fpcr", ir.VoidType(), mode)

    changed = mode


class Intel:
    """MXCSR, and above it the control word of the x87, whose long double some FMUs calculate with."""

    STANDARD = _X87 << 32 | _MXCSR

    @staticmethod
    def mode(builder: Any) -> Any:
        """Generate code that reads the mode."""
        word = _memory(builder)
        _assembled(builder, "fnstcw ($0)", word)
        return builder.or_(Intel._mxcsr(builder), builder.shl(builder.load(word), ir.Constant(_I64, 32)))

    @staticmethod
    def set_mode(builder: Any, mode: Any) -> None:
        """Generate code that sets the mode."""
        control, word = _memory(builder), _memory(builder)
        builder.store(mode, control)
        builder.store(builder.lshr(mode, ir.Constant(_I64, 32)), word)
        _called(builder, "llvm.x86.sse.ldmxcsr", ir.VoidType(), builder.bitcast(control, cgutils.voidptr_t))
        _assembled(builder, "fnclex; fldcw ($0)", word)

    @staticmethod
    def changed(builder: Any) -> Any:
        """0 unless sums show another rounding, or that denormal numbers are flushed: to ask for MXCSR takes ten times as long."""
        four, bits = ir.VectorType(ir.FloatType(), 4), ir.VectorType(ir.IntType(32), 4)
        hidden = builder.call(
            ir.InlineAsm(ir.FunctionType(four, [four]), "", "=x,0", side_effect=True), [ir.Constant(four, _LITTLE)]
        )  # so that the compiler cannot know the sum, nor make it before the call
        found = builder.bitcast(builder.fadd(hidden, ir.Constant(four, _BIG)), bits)
        expected = np.add(np.array(_LITTLE, np.float32), np.array(_BIG, np.float32)).view(np.int32)
        return builder.bitcast(builder.xor(found, ir.Constant(bits, expected.tolist())), ir.IntType(128))

    @staticmethod
    def _mxcsr(builder: Any) -> Any:
        place = _memory(builder)
        _called(builder, "llvm.x86.sse.stmxcsr", ir.VoidType(), builder.bitcast(place, cgutils.voidptr_t))
        return builder.load(place)


def _memory(builder: Any) -> Any:
    return cgutils.alloca_once_value(builder, ir.Constant(_I64, 0))


def _called(builder: Any, name: str, result: Any, *arguments: Any) -> Any:
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)


def _assembled(builder: Any, text: str, place: Any) -> None:
    kind = ir.FunctionType(ir.VoidType(), [place.type])
    builder.call(ir.InlineAsm(kind, text, "r,~{memory}", side_effect=True), [place])


PROCESSORS: dict[str, type[Arm] | type[Intel]] = {"aarch64": Arm, "arm64": Arm, "x86_64": Intel, "amd64": Intel}
_processor = PROCESSORS.get(platform.machine().lower())
STANDARD = _processor.STANDARD if _processor is not None else 0
"""The mode that C begins with."""


def keep_arithmetic(builder: Any) -> None:
    """Generate code that sets the standard mode where another one is found."""
    if _processor is None:
        return
    changed = _processor.changed(builder)
    with cgutils.if_unlikely(builder, builder.icmp_unsigned("!=", changed, ir.Constant(changed.type, 0))):
        _processor.set_mode(builder, ir.Constant(_I64, STANDARD))


@intrinsic
def _get(_typing_context: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, _values: Any) -> Any:
        return _processor.mode(builder) if _processor is not None else ir.Constant(_I64, 0)

    return types.uint64(), generate


@intrinsic
def _set(_typing_context: Any, mode: Any) -> Any:
    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        if _processor is not None:
            _processor.set_mode(builder, values[0])
        return context.get_dummy_value()

    return types.void(types.uint64), generate


@numba.njit("uint64()", cache=CACHES)
def arithmetic_mode() -> int:
    """The mode of this thread."""
    return _get()  # pyright: ignore[reportCallIssue]


@numba.njit("void(uint64)", cache=CACHES)
def set_arithmetic_mode(mode: int) -> None:
    """Set the mode of this thread."""
    _set(mode)  # pyright: ignore[reportCallIssue]
