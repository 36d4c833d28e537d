"""What native libraries are linked with."""

from __future__ import annotations

import ctypes

from shaper_fmu.export.native.toolchain import build_library, platform_named


def test_what_the_processor_cannot_do_alone_is_linked_too(tmp_path):
    """A division of 128 bits is a function of the compiler's own library, which is left out where nothing needs it."""
    source, target = tmp_path / "wide.c", tmp_path / "wide.so"
    source.write_text(
        '__attribute__((visibility("default"))) long long wide(long long a, long long b) {\n'
        "    return (long long)(((__int128)a << 32) / b);\n}\n"
    )
    build_library([source], target, platform_named("this"), [])
    function = ctypes.CDLL(str(target)).wide
    function.restype, function.argtypes = ctypes.c_longlong, [ctypes.c_longlong] * 2
    assert function(3 << 40, 1 << 50) == (3 << 72) >> 50
