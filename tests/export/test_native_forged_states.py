"""States that nobody saved, with a right checksum (FNV-1a of 64 bits, computed here): refused, and the instance stays as it is."""

from __future__ import annotations

import struct
from ctypes import byref, c_byte, c_size_t, c_void_p
from functools import reduce

import pytest
from native_calls import ERROR, OK, Host, array

from shaper_fmu.registry import find_component

LIFE = 64  # bytes: digest, six numbers of 32 bits, four times


def checksum(content: bytes) -> int:
    return reduce(lambda total, byte: (total ^ byte) * 1099511628211 % 2**64, content, 14695981039346656037)


def names(fmi: int) -> dict[str, str]:
    plain = {"get": "GetFMUstate", "set": "SetFMUstate", "size": "SerializedFMUstateSize", "out": "SerializeFMUstate"}
    found = {key: name.replace("state", "State") if fmi == 3 else name for key, name in plain.items()}
    return {**found, "in": "DeserializeFMUState" if fmi == 3 else "DeSerializeFMUstate"}


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(("value", "status"), [(0, OK), (1, OK), (2, ERROR), (1000, ERROR), (-1, ERROR)])
def test_a_boolean_that_is_neither_is_refused(fmi, value, status):
    host, call = Host("InputShaper", fmi), names(fmi)
    assert host.setup() == host.call("ExitInitializationMode") == host.step(0.0, 0.01) == OK
    state, size = c_void_p(), c_size_t()
    assert host.call(call["get"], byref(state)) == host.call(call["size"], state, byref(size)) == OK
    packed = (c_byte * size.value)()
    assert host.call(call["out"], state, packed, size) == OK
    saved = bytes(packed)
    assert saved[:8] == struct.pack("<Q", checksum(saved[8:]))  # the reading of the format is right
    assert next(iter(find_component("InputShaper").variables)) == "left_limits"
    content = saved[8 : 8 + LIFE] + struct.pack("<i", value) + saved[8 + LIFE + 4 :]
    forged, restored = struct.pack("<Q", checksum(content)) + content, c_void_p()
    assert host.call(call["in"], array(c_byte, list(memoryview(forged).cast("b"))), len(forged), byref(restored)) == OK
    before = host.all_values()
    assert host.call(call["set"], restored) == status
    assert host.all_values() == before
    if status == ERROR:
        assert host.call(call["set"], restored) == ERROR
        assert "a Boolean that is neither true nor false" in host.log[0][1]
    assert host.step(0.01, 0.01) == OK
    host.free()
