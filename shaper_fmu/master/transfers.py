"""Values to and from FMUs, compiled: between the bus and the memory of a transfer, and the calls that move them on."""

from __future__ import annotations

import math
import types
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from shaper_fmu.master import layout as of
from shaper_fmu.master.calls import (
    fmi2_transfer,
    fmi3_transfer,
    read_f4,
    read_f8,
    read_i1,
    read_i2,
    read_i4,
    read_i8,
    read_u1,
    read_u2,
    read_u4,
    read_u8,
    write_f4,
    write_f8,
    write_i1,
    write_i2,
    write_i4,
    write_i8,
    write_u1,
    write_u2,
    write_u4,
    write_u8,
)
from shaper_fmu.master.loop_cache import CACHES


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """A compiled function.

    Its name in numba's cache tells the sources of the whole loop: numba looks at one file at a time, and would take a function
    that was compiled with another version of the others, and with another layout.
    """
    named = types.FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__)
    named.__qualname__, named.__doc__ = f"{function.__qualname__}_{of.SOURCES_DIGEST}", function.__doc__
    return numba.njit(cache=CACHES, nogil=True, error_model="numpy", **options)(named)


def inlined(function: Callable[..., Any]) -> Any:
    """The same, compiled into its callers: a system is many arguments."""
    return compiled(function, forceinline=True)


_LARGEST_F4 = 3.4028234663852886e38
_ELEMENT_SIZE = np.uintp(of.ELEMENT.itemsize)


@compiled
def fail(control, fault, status, where, element, t):
    control.fault = fault
    control.fault_status = status
    control.fault_where = where
    control.fault_element = element
    control.fault_time = t
    return False


@inlined
def judge(control, status, where, t, function=-1):
    """Whether a call's status lets the run go on; warnings are counted."""
    if status == 0:
        return True
    if status == 1:
        control.warnings += 1
        control.warned = where
        return True
    return fail(control, of.CALL_FAILED, status, where, function, t)


@compiled
def _put(kind, at, value):
    """Write a value in its type; False if it does not fit."""
    if kind == of.F8:
        write_f8(at, value)
        return True
    if kind == of.BOOLEAN2:
        write_i4(at, np.int32(1 if value != 0.0 else 0))
        return True
    if kind == of.BOOLEAN3:
        write_u1(at, np.uint8(1 if value != 0.0 else 0))
        return True
    if kind == of.F4:
        write_f4(at, np.float32(value))
        return abs(value) <= _LARGEST_F4
    whole = math.floor(value + 0.5)
    bits = 8 if kind <= of.U1 else 16 if kind <= of.U2 else 32 if kind <= of.U4 else 64
    signed = kind == of.I1 or kind == of.I2 or kind == of.I4 or kind == of.I8
    low = -(2.0 ** (bits - 1)) if signed else 0.0
    if not low <= whole < 2.0 ** (bits - 1 if signed else bits):
        return False
    if kind == of.I4:
        write_i4(at, np.int32(whole))
    elif kind == of.I8:
        write_i8(at, np.int64(whole))
    elif kind == of.U8:
        write_u8(at, np.uint64(whole))
    elif kind == of.U4:
        write_u4(at, np.uint32(whole))
    elif kind == of.I2:
        write_i2(at, np.int16(whole))
    elif kind == of.U2:
        write_u2(at, np.uint16(whole))
    elif kind == of.I1:
        write_i1(at, np.int8(whole))
    else:
        write_u1(at, np.uint8(whole))
    return True


@compiled
def _taken(kind, at):
    """A value of any type as a double."""
    if kind == of.F8:
        return read_f8(at)
    if kind == of.BOOLEAN2:
        return 1.0 if read_i4(at) != 0 else 0.0
    if kind == of.BOOLEAN3:
        return 1.0 if read_u1(at) != 0 else 0.0
    if kind == of.I4:
        return float(read_i4(at))
    if kind == of.I8:
        return float(read_i8(at))
    if kind == of.F4:
        return float(read_f4(at))
    if kind == of.U4:
        return float(read_u4(at))
    if kind == of.U8:
        return float(read_u8(at))
    if kind == of.I2:
        return float(read_i2(at))
    if kind == of.U2:
        return float(read_u2(at))
    if kind == of.I1:
        return float(read_i1(at))
    return float(read_u1(at))


@inlined
def _size(kind):
    if kind == of.F8 or kind == of.I8 or kind == of.U8:
        return 8
    if kind == of.I1 or kind == of.U1 or kind == of.BOOLEAN3:
        return 1
    return 2 if kind == of.I2 or kind == of.U2 else 4


@inlined
def _call2(transfer):
    return fmi2_transfer(transfer.function, (transfer.handle, transfer.references, transfer.reference_count, transfer.values))


@inlined
def _call_transfer(transfer):
    if transfer.function == 0:  # the values are wanted, but not for the FMU
        return 0
    if transfer.version == 2:
        return _call2(transfer)
    arguments = (transfer.handle, transfer.references, transfer.reference_count, transfer.values, transfer.element_count)
    return fmi3_transfer(transfer.function, arguments)


@inlined
def _scaled(element):
    """The value that an element is set to: gain * source + shift; see layout.ELEMENT."""
    return read_f8(element + np.uintp(8)) * read_f8(read_u8(element)) + read_f8(element + np.uintp(16))


@inlined
def _mapped(element, value):
    """What a value of a boolean, an integer or an enumeration becomes; not a number for one that is no item."""
    at = read_u8(element + np.uintp(24))
    for _ in range(read_u4(element + np.uintp(32))):
        if read_f8(at) == value:
            return read_f8(at + np.uintp(8))
        at += np.uintp(16)
    return value if read_u4(element + np.uintp(36)) == 0 else math.nan


@compiled
def set_values(transfers, control, number, t):
    """Set the inputs of a transfer from the bus, whatever their type."""
    transfer = transfers[number]
    size = np.uintp(_size(transfer.kind))
    at, e = transfer.values, transfer.elements
    for i in range(transfer.element_count):
        given = _scaled(e)
        value = _mapped(e, given)
        if not math.isfinite(value):
            return fail(control, of.NO_ITEM if math.isfinite(given) else of.NOT_FINITE, 0, number, np.int64(i), t)
        if not _put(transfer.kind, at, value):
            return fail(control, of.NOT_IN_RANGE, 0, number, np.int64(i), t)
        at += size
        e += _ELEMENT_SIZE
    return judge(control, _call_transfer(transfer), number, t)


@compiled
def set_again(transfers, control, number, t):
    """Set what a transfer has set before, whatever is on the bus now."""
    return judge(control, _call_transfer(transfers[number]), number, t)


@compiled
def keep_values(transfer):
    """Bring the values in a transfer's memory to the bus."""
    size = np.uintp(_size(transfer.kind))
    at, e = transfer.values, transfer.elements
    for _ in range(transfer.element_count):
        write_f8(read_u8(e), _taken(transfer.kind, at))
        at += size
        e += _ELEMENT_SIZE


@compiled
def get_values(transfers, control, number, t):
    """Get the outputs of a transfer to the bus, whatever their type."""
    transfer = transfers[number]
    if not judge(control, _call_transfer(transfer), number, t):
        return False
    keep_values(transfer)
    return True


@inlined
def set_reals(transfers, control, number, t):
    """Set real inputs of FMI 2.0 from the bus: the straight path of most transfers."""
    transfer = transfers[np.uintp(number)]
    at, e, count = transfer.values, transfer.elements, transfer.element_count
    i = np.uintp(0)
    while i < count:
        value = _scaled(e)
        if not math.isfinite(value):
            return fail(control, of.NOT_FINITE, 0, number, np.int64(i), t)
        write_f8(at, value)
        at += np.uintp(8)
        e += _ELEMENT_SIZE
        i += np.uintp(1)
    return judge(control, _call2(transfer), number, t)


@inlined
def get_reals(transfers, control, number, t):
    """Get real outputs of FMI 2.0 to the bus."""
    transfer = transfers[np.uintp(number)]
    if not judge(control, _call2(transfer), number, t):
        return False
    at, e, count = transfer.values, transfer.elements, transfer.element_count
    i = np.uintp(0)
    while i < count:
        write_f8(read_u8(e), read_f8(at))
        at += np.uintp(8)
        e += _ELEMENT_SIZE
        i += np.uintp(1)
    return True
