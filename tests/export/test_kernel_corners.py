"""Corners of Python that C has otherwise: each has one meaning, or a build refuses it by its line; plain Python is the reference."""

from __future__ import annotations

import random
import re

import meaning_kernels
import numpy as np
import pytest
from compiled_kernels import ZIG, Kernels, record_of
from meaning_kernels import cases_component
from test_kernel_meaning import HELPERS, INEXACT, INTEGER, UNDEFINED, check, check_on_32_bits

from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.translate import translated
from shaper_fmu.export.kernel_source import check_kernels

CONSTANTS = """
import enum

import numpy as np

MIXED = (0, 0.5)
M_PI = 3.1
INFINITY = NULL = HUGE_VAL = I = errno = 1.5
INT32_MAX = FP_NAN = FAULT_ZERO = Fault = CHECKED = NOT_EXPORTED = TupleRR = isunordered = 2.5
value_1 = 2.0
Kind_one = 3.0


class Farbe(IntEnum):
    rot = 1
    grün = 2


class Bits(enum.IntFlag):
    read = 4
    write = 2


class Own(float):
    def __mul__(self, other):
        return 99.0


OWN = (Own(2.0), 1.0)
NUMPY = (np.float64(2.0), 1.0)
"""

MORE = '''

def bump(m):
    m.k += 1
    return m.k


def touch(m):
    m.secret = 7.0
    return 2.0


def position_alone(x, /, y=2.0):
    return x - y


def commented(x: float = 1.0) -> float:
    """A comment that ends */ here, and /* begins."""
    y: float = x * 2.0
    return y
'''

EXPRESSIONS = [
    # what C computes with an int, whose product of two does not fit
    *[f"m.y = float({f})" for f in (
        "(m.u > 1.0) * 100000 * 100000", "(1 if m.flag else 2) * 2000000000", "(m.few + 1) * 1000000 * 1000000", "m.few % 2 * 2000000000 * 2",
        "(m.few & 3) * 1000000000 * 3", "(m.flag | m.few) * 1500000000", "-m.few * 1073741825 * 2", "+(m.u > 1.0) * 2000000000 * 3",
        "int(m.u > 1.0) * 2000000000 * 3", "(m.few if m.flag else 3) * 1000000000 * 3", "(m.few == 2) * 2147483647 + 2147483647", "len(NUMBERS) * 1000000000",
        "Kind.seven * 1000000000", "~m.few * 1073741825", "(m.flag + m.truth) << 31", "(m.few - 3) * -1000000000 * 3", "m.few // 2 * 2000000000 * 2",
    )],
    # integers beyond 2^53 beside real numbers
    *[f"m.y = float({f})" for f in (
        "m.n * 4194305 < m.u", "m.n * m.m == m.u * m.v", "9007199254740993 == m.u", "m.u >= 9007199254740993", "m.u != m.n * m.m * 2",
        "m.n * m.m * 2 < m.u < m.n * m.m * 4", "math.nan != m.n * m.m", "m.n * m.m * 2 >= math.nan", "m.n * m.m * 2 < math.inf", "-m.n * m.n > -math.inf",
    )],
    # every operand once, in its order, and what fails does fail
    "m.y = 1.0 if m.u in (1.0, 0.0, 1.0 / m.v) else 0.0", "m.y = 1.0 if m.u in (stored(m, 1.0), stored(m, 2.0)) else 0.0", "1.0 / m.v", "m.a[m.i]",
    "m.flag and 1.0 / m.v > 0", "m.b[bump(m) % 4] += 1", "m.b[bump(m) % 4] *= bump(m)", "m.b[m.k] += bump(m)", "m.b[m.k] = bump(m)", "m.b[m.k], m.y = bump(m), 1.0",
    "m.y = with_default(factor=stored(m, 2.0), x=m.secret)", "m.y = float(m.u < stored(m, 1.0) < m.v)", "return m.n * 4294967296", "return -m.few",
    "m.k = bump(m) - bump(m) * m.k", "m.y = float(bump(m) + m.k * bump(m))", "m.y = float(m.k + m.k * bump(m))", "for i in range(bump(m), bump(m) + m.k):\n    m.y += float(i)",
    "m.y = with_default(m.k, m.k * bump(m))", "m.y = float((m.k, m.k * bump(m))[0])", "m.k += m.k * bump(m)", "a, b = m.k, m.k * bump(m)\nm.y = a - b", "m.y = float(m.k < m.k * bump(m))",
    "m.y = math.atan2(m.k, m.k * bump(m))", "m.y = float(max(m.k, m.k - bump(m)))", "a, b = touch(m), m.u\nm.y = m.secret + b", "m.y = float(len((bump(m), touch(m)))) + m.k",
    "len((1.0 / m.v, 1.0))", "for x in (1.0 / m.v, 2.0):\n    pass",
    # powers and functions at infinity
    "m.y = 1.0 / 0.0 ** (-math.inf * m.positive)", "m.y = 1.0 / math.pow(0.0, -math.inf * m.positive)", "m.y = 1.0 / math.hypot(1e308 * m.positive, 1.7e308)",
    # loops
    "for j in range(3):\n    for j in range(4):\n        m.k += 1\n    m.k += 10 * j", "for j in range(3):\n    f = lambda x: x + j\nm.y = f(1.0)",
    "def count(values):\n    for j in range(values[2]):\n        values[2] -= 1\n        m.k += 1\ncount(m.b)", "b = m.b\nfor j in range(b[0] + 2):\n    m.b[0] = 0\n    m.k += 1",
    "for j in range(3):\n    if m.flag:\n        x = 2.0\n        continue\n    x = 1.0\nm.y = x",
    # names: of C, of its headers, and of what the translation makes
    "x = 1.0\n_x = m.u\n__x = m.v\nm.y = x + _x * 2.0 + __x * 4.0", "double = 1.0\ndouble_ = m.u\nm.y = double + double_", "größe = m.u\nu00f6 = größe\nö = u00f6 + 1.0\nm.y = ö + u00f6",
    "n_1 = 5.0\nfor j in range(m.few):\n    n_1 += 1.0\n    j = j + 1\n    m.k += j\nm.y = n_1", "i_1 = 5.0\nfor x in m.a:\n    i_1 += min(x, 3.0)\nm.y = i_1",
    "ended_1 = 5.0\nfor j in range(3):\n    ended_1 += 1.0\nelse:\n    ended_1 += 2.0\nm.y = ended_1", "m.y = value_1 * divmod(value_1 * m.u, 3.0)[0]",
    *[f"m.y = {name} * m.u" for name in (
        "M_PI", "INFINITY", "NULL", "HUGE_VAL", "I", "errno", "INT32_MAX", "FP_NAN", "FAULT_ZERO", "Fault", "CHECKED", "NOT_EXPORTED", "isunordered",
        "(Kind_one + Kind.one)", "(TupleRR + pair_of(m.v)[0])", "Farbe.grün",
    )],
    "NULL = m.u\nINFINITY = NULL + 1.0\nm.y = INFINITY", "v = m.v\ndef call(f, f_v):\n    return f(f_v)\nm.y = call(lambda x: x * v, m.u)", "m.y = commented(m.u)",
    # a choice as a whole
    "m.y = (pair_of(m.u) if m.flag else pair_of(m.v))[0]", "m.y = (m.a if m.flag else m.a)[m.few]", "m.y = (m if m.flag else m).u", "m.y = max(NUMBERS) + len(PAIR)",
    # numbers that are integers on one path, where that makes no difference
    "m.y = (max(m.u, 0) + 1) * 2", "x = 0\nfor j in range(m.few):\n    x = x + m.u\nm.y = x", "p = (0 if m.flag else m.u, 1.0)\nm.y = p[0] * m.v", "m.y = -max(m.u, 1)", "m.pair[0] = m.n\nm.y = m.pair[0] + m.few",
]  # fmt: skip

PATHS = "computes with numbers that are integers on one path and real on another"
REFUSED = [
    ("x = -1 if m.flag else m.u\ny = 0 if m.flag else m.v\nm.y = x * y", f"x * y {PATHS}"),  # 0 and -0.0
    ("x = 1\nif m.flag:\n    x = m.u\nfor j in range(40):\n    x = x * 7\nm.y = x", f"x * 7 {PATHS}"),  # more than 53 bits
    ("x = 9007199254740992 if m.flag else m.u\nm.y = x + 1 - 2.0", f"x + 1 {PATHS}"),
    ("for x in (0, m.u):\n    m.y += math.copysign(1.0, -x)", f"-x {PATHS}"),
    ("m.y = math.copysign(1.0, -MIXED[m.few % 2])", f"-MIXED[m.few % 2] {PATHS}"),
    ("def two(x):\n    if x > 1.0:\n        return 0, x\n    return x, 0.0\na, b = two(m.u)\nm.y = -a", f"-a {PATHS}"),
    ("p = (0 if m.flag else m.u, 1.0)\nm.y = -p[0]", rf"-p[0] {PATHS}"),
    ("x = 0 if m.flag else m.u\nf = lambda y: -x * y\nm.y = f(1.0)", f"-x {PATHS}"),
    ("m.y = -abs(max(m.u, 0))", PATHS),
    ("m.a[0] = 0\nm.y = -m.a[0]", f"-m.a[0] {PATHS}"),
    ("a = m.a\na[1] = 0\nm.y = -m.a[1]", "a[1] is a real number and is set to an integer"),
    ("x = m.a\nif m.flag:\n    x = m.pair\nm.y = x[-1]", "x is an array of 4 in one place and an array of 2 in another"),
    ("m.y = (m.a if m.flag else m.pair)[-1]", "an array of 4 in one place and an array of 2 in another"),
    ("m.k = ~Bits.read", "does not compile: it is of type Bits"),  # 3: Python's flags have no others
    ("m.y = OWN[0] * m.u", "OWN does not compile"),
    ("m.y = NUMPY[0] * m.u", "NUMPY does not compile"),
    ("for j in range(3):\n    if m.flag:\n        continue\n    x = 1.0\nm.y = x", "x may have no value here"),
    ("def g(x):\n    if x > 0:\n        z = x\n    return z\nm.y = g(m.u)", "z may have no value here"),
    ("if m.flag:\n    c = m.u\ndef g(x):\n    return x + c\nm.y = g(1.0)", "c may have no value here"),
    ("def other(f):\n    return half\n@other\ndef g(x):\n    return x\nm.y = g(m.u)", "a decorator of an inner function"),
    ("def g(x, k=m.u):\n    return x * k\nm.y = g(2.0)", "the default m.u of an inner function must be a number"),
    ("m.y = position_alone(x=m.u)", "position_alone cannot be given 'x' here"),
    ("m.y = float(0.0 < m.v < 1.0 / m.v < 5.0)", "write 1.0 / m.v as a line of its own"),
    ("m.y = 1.0 if m.flag and m.u < m.secret < stored(m, 2.0) else 0.0", "write stored(m, 2.0) as a line of its own"),
    ("m.y = 1.0 if m.flag and m.u in (1.0, 1.0 / m.v) else 0.0", "write the values of (1.0, 1.0 / m.v) as lines of their own"),
]


@pytest.fixture(autouse=True)
def with_corners(monkeypatch):
    head, fields = meaning_kernels.HEAD, "    pair = State([5.0, 6.0], size=2)\n"
    monkeypatch.setattr(meaning_kernels, "HEAD", head + CONSTANTS + HELPERS + MORE)
    monkeypatch.setattr(meaning_kernels, "CLASS", meaning_kernels.CLASS.replace("    secret =", fields + "    secret ="))


def test_corners_have_one_meaning(tmp_path):
    component = cases_component(tmp_path, EXPRESSIONS)
    check_kernels(component)
    check(component, Kernels(component), len(EXPRESSIONS), random.Random(11), 12, EXPRESSIONS)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("compiler", "flags"), [(("gcc",), ("-O0",)), (("gcc",), ("-O1", *UNDEFINED)), (ZIG, ("-O1", *INTEGER)), (("g++",), ("-O2",))]
)
def test_corners_have_one_meaning_by_every_compiler(tmp_path, compiler, flags):
    component = cases_component(tmp_path, EXPRESSIONS)
    check(component, Kernels(component, compiler, flags), len(EXPRESSIONS), random.Random(12), 40, EXPRESSIONS)


@pytest.mark.parametrize(("body", "words"), REFUSED)
def test_corners_of_two_meanings_are_refused_with_their_line(tmp_path, body, words):
    with pytest.raises(BuildError) as caught:
        translated(cases_component(tmp_path, [body]))
    assert words in str(caught.value)
    assert re.search(r"cases\.py:\d+: ", str(caught.value))


AFTER_A_FAULT = [
    "m.a[int(5.0 + 3.0 * abs(math.sin(m.u * 1e300 * m.u))) - 5] = 7.0",  # a fault's 0 is not between 5 and 8
    "m.a[(1 << m.i) - 1] = 7.0",  # nor a power of two
    "m.k = 7 // int(1.0 + abs(math.sin(m.u * 1e300 * m.u)))",
    "m.k = 7 % int(1.0 + abs(math.sin(m.u * 1e300 * m.u)))",
]


@pytest.mark.parametrize("body", AFTER_A_FAULT)
def test_after_a_fault_nothing_else_is_touched(tmp_path, body):
    """The kernel goes on with a harmless value, which the bounds of the right one do not tell."""
    component = cases_component(tmp_path, [body])
    for compiler, flags in ((("gcc",), ("-O0",)), (ZIG, ("-O2",))):
        record = record_of(component(u=1e300, i=-1))
        before = record.copy()
        with pytest.raises(ArithmeticError):
            Kernels(component, compiler, flags).step(record, 0.0, 0.1)
        others = [name for name in before.dtype.names or () if name != "a"]
        assert all(np.array_equal(before[name], record[name]) for name in others)


@pytest.mark.parametrize("sought", ["math.nan in (math.nan, m.u)", "x in (x, 1.0)", "x not in (1.0, x)"])
def test_nan_among_values_is_told(tmp_path, sought):
    """Python finds a NaN among values that hold the same object; C has no objects."""
    component = cases_component(tmp_path, [f"x = math.inf * m.positive - math.inf\nm.y = 1.0 if {sought} else 0.0"])
    with pytest.raises(ArithmeticError, match="NaN is looked for among values"):
        Kernels(component).step(record_of(component(u=1.0)), 0.0, 0.1)


@pytest.mark.thorough
def test_corners_have_one_meaning_on_32_bits(tmp_path):
    exact = [body for body in EXPRESSIONS if not INEXACT.search(body)]
    check_on_32_bits(cases_component(tmp_path, exact), exact, random.Random(13), 20, tmp_path)
