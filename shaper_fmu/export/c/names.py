"""Names in C: those of Python where C, its mathematics library and kernel.h do not use them themselves."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register
    restrict return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false
    alignas alignof asm catch char16_t char32_t class compl const_cast constexpr decltype delete dynamic_cast explicit export
    friend mutable namespace new noexcept nullptr operator private protected public reinterpret_cast static_assert
    static_cast template this thread_local throw try typeid typename using virtual wchar_t and and_eq bitand bitor not not_eq
    or or_eq xor xor_eq int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t intptr_t uintptr_t intmax_t
    uintmax_t size_t main errno linux unix i386 near far small Record fault kernel_start kernel_step
"""
_LIBRARY = """
    abs acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh div erf erfc exp exp10 exp2 expm1 fabs fdim floor
    fma fmax fmin fmod frexp gamma hypot ilogb isfinite isgreater isinf isless isnan isnormal j0 j1 jn labs ldexp lgamma
    llrint llround log log10 log1p log2 logb lrint lround matherr modf nan nearbyint nextafter nexttoward pow pow10 remainder
    remquo rint round scalb scalbln scalbn signbit signgam significand sin sincos sinh sqrt tan tanh tgamma trunc y0 y1 yn
    drem finite index time clock isgreaterequal islessequal islessgreater issignaling issubnormal isunordered iszero
"""
_MACROS = re.compile(
    r"(NULL|NAN|SNAN\w?|EOF|I|HUGE\w*|MAXFLOAT|INFINITY|DOMAIN|SING|OVERFLOW|UNDERFLOW|PLOSS|TLOSS|X_TLOSS|CHECKED|NOT_EXPORTED|BUFSIZ|L_tmpnam"
    r"|(FP|FLT|DBL|LDBL|M|MATH|INT\d*|UINT\d*|INTPTR|UINTPTR|INTMAX|UINTMAX|PTRDIFF|SIZE|SEEK|RAND|EXIT|TMP|MB|FOPEN|FILENAME|SIG_ATOMIC|WCHAR|WINT|CHAR|SCHAR|SHRT|LONG|LLONG"
    r"|FAULT|SHAPER_FMU)_\w*|INT\w*_[CX]|Fault|(make_)?Tuple\w*)"
)
"""Names that headers may define as macros, and the types of kernels."""
_RUNTIME = re.findall(r"\b(\w+)\(", (Path(__file__).parent.parent / "native" / "kernel.h").read_text(encoding="utf-8"))

RESERVED = frozenset(
    [*_KEYWORDS.split(), *_LIBRARY.split(), *[f"{name}{end}" for name in _LIBRARY.split() for end in "fl"], *_RUNTIME]
)


MACROS_OF_THE_LAYER = frozenset(
    {"INTERNAL", "HOT", "COLD", "REQUIRED", "NO_EVENT", "OUT_OF_LINE", "IN_LINE", "LIKE_PRINTF", "ONE_UNIT", "LAYER_UNIT"}
)
"""Of component.h, beside which the record is declared."""


def ascii_name(name: str) -> str:
    """A name whose other letters are told by their numbers."""
    return "".join(c if c.isascii() else f"_u{ord(c):04x}" for c in name)


@lru_cache(maxsize=10_000)
def c_name(name: str) -> str:
    """A name of Python as one of C."""
    plain = ascii_name(name).lstrip("_") or "unused"
    plain = f"_{plain}" if plain[0].isdigit() else plain
    return f"{plain}_" if plain in RESERVED or _MACROS.fullmatch(plain) else plain


class Names:
    """Names that are given once each: a second owner of one gets a number."""

    def __init__(self) -> None:
        self._owners: dict[str, object] = {}

    def given(self, wanted: str, owner: object, avoid: frozenset[str] | set[str] = frozenset()) -> str:
        """The name for this owner, which is the same whenever it asks."""
        number, name = 1, c_name(wanted)
        while self._owners.get(name, owner) != owner or name in avoid:
            number += 1
            name = f"{c_name(wanted)}_{number}"
        self._owners[name] = owner
        return name
