"""What libraries of FMUs are linked with on Windows: import libraries of Windows' own C library, and the little that it lacks.

Arithmetic that ziglang's library for compilers has (sin, cos, exp, log, floor, fmod and the like) comes from there, and is
the same on every machine; other functions come from Windows' C library (UCRT), as they do where all of MinGW-w64's is linked.
"""

from __future__ import annotations

from collections.abc import Mapping

IMPORTS: Mapping[str, str] = {
    "heap": "calloc free malloc",
    "math": (
        "acos acosh asin asinh atan atan2 atanh cbrt copysign cosh erf erfc expm1 hypot ilogb ldexp log1p pow "
        "remainder rint sinh tanh tgamma"
    ),
    "stdio": "__stdio_common_vsprintf",
    "string": "strcmp strcpy strlen strncmp",
}
"""Functions by the part of the C library that has them. A library that needs others is linked with MinGW-w64's whole one."""


def definition(part: str) -> str:
    """The module definition of a part, which an import library is made of."""
    return f"LIBRARY api-ms-win-crt-{part}-l1-1-0.dll\nEXPORTS\n" + "".join(f"{name}\n" for name in IMPORTS[part].split())
