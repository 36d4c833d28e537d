"""The loop's C: laid out as Python has it, without warnings, and with the numbers of Python's formulas."""

from __future__ import annotations

import ctypes
import math
import random
import struct
import subprocess
from ctypes import CFUNCTYPE, c_int, c_size_t, c_void_p, cast, string_at

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from loop_host import STRICT, compile_loop, layout_with

from shaper_fmu.component import time_rounding
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_header import ENUMS, RECORDS
from shaper_fmu.master.loop_library import loop, sources
from shaper_fmu.metrics.metric import GATHERED
from shaper_fmu.records import c_struct, record

PROBE = '#include <stdio.h>\n#include "loop.h"\nint main(void) {{\n{}\nreturn 0; }}\n'


def test_the_compiler_lays_everything_out_as_numpy_does(tmp_path):
    """Sizes, offsets and numbers as a program of gcc's tells them."""
    expected: dict[str, int] = {}
    for kind in RECORDS:
        name = c_struct(kind).name
        expected[f"sizeof({name})"] = kind.itemsize
        expected |= {f"offsetof({name}, {field})": offset for field, (_, offset, *_) in (kind.fields or {}).items()}
    expected |= {f"offsetof(System, {name})": 16 * i for i, name in enumerate(of.Layout._fields)}
    expected |= {f"{prefix}_{item.name}": item.value for prefix, items in ENUMS.items() for item in items}
    expected["JUMPS"] = of.JUMPS
    lines = [f'printf("%s=%lld\\n", "{words}", (long long)({words}));' for words in expected]
    (tmp_path / "probe.c").write_text(PROBE.format("\n".join([*lines, 'printf("%a\\n", NO_EVENT);'])))
    compile_loop(tmp_path / "out", *STRICT, "-o", str(tmp_path / "probe"), source=tmp_path / "probe.c")
    *told, no_event = subprocess.run([tmp_path / "probe"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert {words: int(number) for words, _, number in (line.rpartition("=") for line in told)} == expected
    assert float.fromhex(no_event) == of.NO_EVENT
    assert [ctypes.sizeof(of.Control), ctypes.sizeof(of.Runs)] == [of.CONTROL.itemsize, of.RUNS.itemsize]
    assert GATHERED.itemsize == 96  # four numbers of 4 bytes, ten of 8


def test_a_header_that_is_laid_out_otherwise_is_not_compiled(tmp_path):
    (tmp_path / "other.c").write_text('#define double float\n#include "loop.h"\n')
    with pytest.raises(AssertionError, match="Control_step_is_as_in_python"):
        compile_loop(tmp_path, "-fsyntax-only", source=tmp_path / "other.c")


def test_arrays_of_other_types_are_refused():
    with pytest.raises(TypeError, match="bus: float32 in 1 dimensions is not float64"):
        of.addresses_of(layout_with(bus=np.zeros(3, np.float32)))
    with pytest.raises(TypeError, match="jumps: float64 in 2 dimensions"):
        of.addresses_of(layout_with(jumps=np.zeros((3, 2))))
    with pytest.raises(ValueError, match="Wrong: 'int32_t a' is no field"):
        record("Wrong", "int32_t a")


def test_no_compiler_warns(tmp_path):
    """gcc looks at each file by itself, and at all of them in one; clang at the latter, for both kinds of processors."""
    for source in [None, *sources()]:
        compile_loop(tmp_path, *STRICT, "-O2", "-fsyntax-only", source=source)
    for platform in ("x86_64-linux", "aarch64-linux"):
        compile_loop(tmp_path, *STRICT, "-O2", "-c", "-o", str(tmp_path / "loop.o"), compiler=platform)


@pytest.mark.parametrize("optimized", ["-O0", "-O2"])
def test_the_rounding_of_times_is_pythons(optimized, tmp_path):
    """component.py's formula, to the bit, over times of all sizes."""
    code = 'double t, h; while (scanf("%la %la", &t, &h) == 2) printf("%a\\n", time_rounding(t, h));'
    (tmp_path / "probe.c").write_text('#include "execution.h"\n' + PROBE.format(code))
    compile_loop(tmp_path / "out", *STRICT, optimized, "-o", str(tmp_path / "probe"), source=tmp_path / "probe.c")
    chosen = random.Random(1)
    edges = [0.0, -0.0, 5e-324, 1e-300, 1e-9, 0.1, 1.0, 1.0 / 3.0, 1e9, 1e300, 1.7976931348623157e308]
    times = [(t, h) for t in [*edges, *(-t for t in edges)] for h in edges]
    times += [(chosen.gauss(0.0, 1.0) * 10.0 ** chosen.uniform(-12, 12), 10.0 ** chosen.uniform(-12, 6)) for _ in range(20000)]
    asked = "".join(f"{t.hex()} {h.hex()}\n" for t, h in times)
    told = subprocess.run([tmp_path / "probe"], input=asked, capture_output=True, text=True, check=True).stdout.split()
    assert [float.fromhex(word).hex() for word in told] == [time_rounding(t, h).hex() for t, h in times]


_FORMATS = {of.I1: "b", of.U1: "B", of.I2: "h", of.U2: "H", of.I4: "i", of.U4: "I", of.I8: "q", of.U8: "Q"}
_TRANSFER2 = CFUNCTYPE(c_int, c_void_p, c_void_p, c_size_t, c_void_p)


def set_and_got(kind: int, value: float) -> tuple[int, bytes, float]:
    """Set this value in this type: the fault, the bytes that the FMU is given, and what comes back to the bus from them."""
    seen: list[bytes] = []

    def transfer(_handle: int, _references: int, _count: int, values: int) -> int:
        seen.append(string_at(values, of.SIZES[kind]))
        return 0

    function = _TRANSFER2(transfer)
    bus, memory = np.array([value, np.nan]), np.zeros(1)
    elements = np.array([(bus.ctypes.data + 8 * i, 1.0, 0.0, 0, 0, 0) for i in range(2)], of.ELEMENT)
    addresses = [elements.ctypes.data + of.ELEMENT.itemsize * i for i in range(2)]
    calls = (cast(function, c_void_p).value, 0)
    rows = [(call, 0, 2, kind, 0, 1, address, 1, 0, 0, memory.ctypes.data) for call, address in zip(calls, addresses, strict=True)]
    program = np.array([(of.SET, 0), (of.KEEP, 1)], of.OPERATION)
    layout = layout_with(bus=bus, elements=elements, transfers=np.array(rows, of.TRANSFER), initial_program=program)
    system, control = of.addresses_of(layout), of.Control()
    done = loop().exchange(system.ctypes.data, control, 0.0)
    assert bool(done) == (control.fault == of.NO_FAULT)
    return control.fault, seen[0] if seen else b"", float(bus[1])


@pytest.mark.parametrize("kind", _FORMATS)
@given(value=st.floats())
@example(1e19)  # as a number of 64 bits with a sign it would be the lowest one
@example(-1e19)
@example(2.0**64)
@example(2.0**63)
@example(-(2.0**63))
@example(9223372036854774784.0)
@example(18446744073709549568.0)
@example(0.49999999999999994)
@example(-0.5)
@example(127.5)
@example(-128.6)
def test_whole_numbers_are_rounded_to_the_nearest_and_refused_outside_of_their_type(kind, value):
    fault, given_bytes, back = set_and_got(kind, value)
    if not math.isfinite(value):
        assert fault == of.NOT_FINITE
        return
    whole = math.floor(value + 0.5)
    try:
        expected = struct.pack(_FORMATS[kind], whole)
    except struct.error:
        assert (fault, given_bytes) == (of.NOT_IN_RANGE, b"")
    else:
        assert (fault, given_bytes, back) == (of.NO_FAULT, expected, float(whole))


@pytest.mark.parametrize("kind", [of.F8, of.F4, of.BOOLEAN2, of.BOOLEAN3])
@given(value=st.floats(allow_nan=False, allow_infinity=False))
@example(3.4028234663852886e38)
@example(3.5e38)
@example(5e-324)
@example(0.25)
def test_other_numbers_too(kind, value):
    fault, given_bytes, back = set_and_got(kind, value)
    if kind == of.F4 and abs(value) > float(np.finfo(np.float32).max):
        assert (fault, given_bytes) == (of.NOT_IN_RANGE, b"")
        return
    value += 0.0  # of an input: gain * value + shift
    formats = {of.F8: ("d", value), of.F4: ("f", value), of.BOOLEAN2: ("i", value != 0.0), of.BOOLEAN3: ("B", value != 0.0)}
    letter, number = formats[of.ValueType(kind)]
    expected = struct.pack(letter, number)
    assert (fault, given_bytes, back) == (of.NO_FAULT, expected, float(struct.unpack(letter, expected)[0]))
