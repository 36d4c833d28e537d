"""Calling C functions by their addresses from compiled code, so that one compiled loop serves every FMU; and reading and
writing at addresses.

Each function here is called in numba-compiled code as `name(address, (arguments...))`; sizes and pointers are integers.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from shaper_fmu.master.arithmetic import keep_arithmetic

_POINTER = types.uintp
_TIME = types.float64
_INT = types.int32
_FLAG = types.uint8  # C's bool of FMI 3.0


def _foreign(*argument_types: Any) -> Any:
    """A caller of C functions with these arguments that return a status."""

    @intrinsic
    def call(_typing_context: Any, address: Any, arguments: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            prototype = ir.FunctionType(ir.IntType(32), [context.get_value_type(kind) for kind in argument_types])
            function = builder.inttoptr(values[0], prototype.as_pointer())
            status = builder.call(function, cgutils.unpack_tuple(builder, values[1]))
            keep_arithmetic(builder)
            return status

        return _INT(_POINTER, types.Tuple(argument_types)), generate

    return call


@intrinsic
def pointer_to(_typing_context: Any, address: Any) -> Any:
    """The address as a pointer, for numba.carray."""

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(types.voidptr))

    return types.voidptr(_POINTER), generate


def _reader(kind: Any) -> Any:
    """A function (address) -> the value of this type there."""

    @intrinsic
    def read(_typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            return builder.load(builder.inttoptr(values[0], context.get_value_type(kind).as_pointer()))

        return kind(_POINTER), generate

    return read


def _writer(kind: Any) -> Any:
    """A function (address, value) that writes a value of this type there."""

    @intrinsic
    def write(_typing_context: Any, address: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            builder.store(values[1], builder.inttoptr(values[0], context.get_value_type(kind).as_pointer()))
            return context.get_dummy_value()

        return types.void(_POINTER, kind), generate

    return write


read_f8: Any = _reader(types.float64)
write_f8: Any = _writer(types.float64)
read_f4: Any = _reader(types.float32)
write_f4: Any = _writer(types.float32)
read_i1: Any = _reader(types.int8)
write_i1: Any = _writer(types.int8)
read_u1: Any = _reader(types.uint8)
write_u1: Any = _writer(types.uint8)
read_i2: Any = _reader(types.int16)
write_i2: Any = _writer(types.int16)
read_u2: Any = _reader(types.uint16)
write_u2: Any = _writer(types.uint16)
read_i4: Any = _reader(types.int32)
write_i4: Any = _writer(types.int32)
read_u4: Any = _reader(types.uint32)
write_u4: Any = _writer(types.uint32)
read_i8: Any = _reader(types.int64)
write_i8: Any = _writer(types.int64)
read_u8: Any = _reader(types.uint64)
write_u8: Any = _writer(types.uint64)

simple_call: Any = _foreign(_POINTER)
"""f(instance): fmi3EnterEventMode, fmi3EnterStepMode, fmi2Reset and the like."""

fmi2_setup: Any = _foreign(_POINTER, _INT, _TIME, _TIME, _INT, _TIME)
"""fmi2SetupExperiment(instance, tolerance defined, tolerance, start time, stop time defined, stop time)."""

fmi3_enter_initialization: Any = _foreign(_POINTER, _FLAG, _TIME, _TIME, _FLAG, _TIME)
"""fmi3EnterInitializationMode, with the same arguments."""

fmi2_transfer: Any = _foreign(_POINTER, _POINTER, _POINTER, _POINTER)
"""fmi2GetReal, fmi2SetReal and the like: f(instance, references, count, values)."""

fmi2_set_slopes: Any = _foreign(_POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
"""fmi2SetRealInputDerivatives(instance, references, count, orders, values)."""

fmi3_transfer: Any = _foreign(_POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
"""fmi3GetFloat64 and the like: f(instance, references, count, values, value count)."""

fmi3_get_interval_fraction: Any = _foreign(_POINTER, _POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
"""f(instance, references, count, counters, resolutions, qualifiers); the other functions of clocks are called as transfers are."""

fmi2_do_step: Any = _foreign(_POINTER, _TIME, _TIME, _INT)
"""fmi2DoStep(instance, t, h, no going back)."""

fmi3_do_step: Any = _foreign(_POINTER, _TIME, _TIME, _FLAG, _POINTER, _POINTER, _POINTER, _POINTER)
"""fmi3DoStep(instance, t, h, no going back, event needed, terminate, early return, time reached)."""

fmi3_update: Any = _foreign(_POINTER, _POINTER, _POINTER, _POINTER, _POINTER, _POINTER, _POINTER)
"""fmi3UpdateDiscreteStates(instance, need update, terminate, nominals, values, next event defined, next event time)."""
