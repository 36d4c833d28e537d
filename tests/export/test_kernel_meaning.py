"""What kernels compute has one meaning: plain Python and C agree to the bit, both refuse the values, or a build refuses the source.

The cases are those in which a compiler of Python is known to give other numbers (numba, which compiled kernels before, did in most
of the first ones), and random functions from a grammar. Plain Python is the reference of all of them.
"""

from __future__ import annotations

import random
import re

import numpy as np
import pytest
from compiled_kernels import ZIG, Kernels, on_32_bits
from meaning_kernels import cases_component, random_values, run_both, run_plain
from random_kernels import Grammar

from shaper_fmu import components
from shaper_fmu.errors import BuildError
from shaper_fmu.export.c.translate import translated
from shaper_fmu.export.c.unit import Function

_PAIRS = [("m.n", "m.m"), ("m.n", "3"), ("m.i", "m.few"), ("-7", "m.n")]
_BINARY = ["+", "-", "*", "//", "%", "&", "|", "^"]
EXPRESSIONS = [
    *[f"m.k = {a} {op} {b}" for op in _BINARY for a, b in _PAIRS],
    *[f"m.y = m.u {op} m.v" for op in ("+", "-", "*", "/", "//", "%", "**")],
    *[f"m.y = m.u {op} m.n" for op in ("+", "-", "*", "/", "//", "%", "**")],
    *[f"m.y = m.n {op} m.m" for op in ("/", "+", "*")],
    *[f"m.y = {f}" for f in (
        "math.sqrt(m.u)", "math.exp(m.u)", "math.log(m.u)", "math.log(m.u, 3.0)", "math.log2(m.u)", "math.log10(m.u)", "math.log1p(m.u)",
        "math.expm1(m.u)", "math.sin(m.u)", "math.cos(m.u)", "math.tan(m.u)", "math.asin(m.u)", "math.acos(m.u)", "math.atan(m.u)",
        "math.sinh(m.u)", "math.cosh(m.u)", "math.tanh(m.u)", "math.asinh(m.u)", "math.atan2(m.u, m.v)", "math.copysign(m.u, m.v)",
        "math.fmod(m.u, m.v)", "math.pow(m.u, m.v)", "math.fabs(m.u)", "math.degrees(m.u)", "math.radians(m.u)", "abs(m.u)", "-m.u",
        "m.u ** 2", "m.u ** 3", "m.u ** 31", "m.u ** -1", "m.u ** 0.5", "2.0 ** m.n", "0.1 ** m.few",
        "math.sqrt(1.0 - m.positive / (1.0 + m.positive))", "math.sin(m.u * m.v)", "math.cbrt(m.u)", "math.exp2(m.u)",
        "float(m.n) ** m.m", "1.0 / m.positive", "m.u / (m.v * m.v)", "1.0 / (m.positive * m.positive)",
        "min(m.u, m.v)", "max(m.u, m.v, 0.5)", "min(m.u, 0.0)", "max(m.n, 0.5)", "min(PAIR)", "m.u if m.flag else m.v",
        "(m.u or 2.0) + (m.v and 3.0)", "m.flag + m.u", "m.flag * m.u - m.truth", "float(m.n in (1, 2, 7))", "float(m.n not in [3, 4])",
        "float(m.u < m.v <= 2.0)", "float(0 < m.n < m.m < 100)", "float(m.n == m.u)", "float(m.n * m.m < m.u)", "float(not m.u)",
        "m.a[m.i]", "m.a[m.i - 1]", "m.a[-1]", "PAIR[m.i]", "PAIR[m.flag]", "m.a[m.few] + m.a[m.few // 2]", "sum_of(m.a)", "m.a[m.n % 4]",
        "float(m.n // 2 * 2 + m.n % 2)", "divmod(m.u, m.v)[0] + divmod(m.u, m.v)[1]", "float(math.isnan(m.u)) + math.isfinite(m.v)",
    )],
    *[f"m.k = {f}" for f in (
        "2 ** m.few", "10 ** m.few", "m.n ** 2", "m.n ** 3", "m.n ** m.few", "m.n << m.few", "m.n << 3", "m.n >> m.few", "1 << m.m % 70", "m.n >> m.m",
        "m.n << (m.m - 3) % 70 - 3", "abs(m.n)", "-m.n", "~m.n", "abs(m.n * m.m)", "-(m.n * m.m)", "m.n * m.n", "m.n * m.n * m.n * m.n", "m.k + 2147483647 + m.n",
        "int(m.u)", "math.floor(m.u)", "math.ceil(m.u)", "math.trunc(m.u)", "round(m.u)", "int(m.u) - int(m.v)", "int(m.flag) + m.few",
        "m.b[m.i]", "m.b[-2] + m.n", "NUMBERS[m.i]", "len(NUMBERS) + len(m.a)", "min(m.n, m.m)", "max(m.n, m.m, 5)", "m.n if m.flag else m.m",
        "m.n and m.m", "m.n or m.m", "m.flag & m.truth", "m.flag | m.few", "m.flag + m.flag", "-m.flag", "~m.flag", "Kind.seven * m.n",
        "pow(m.n, m.few)", "divmod(m.n, m.m)[0]", "divmod(m.n, m.m)[1]", "m.n // -1", "m.n % -1", "(m.n * m.m) // (m.i * m.i)",
    )],
    "m.a[m.i] = m.u", "m.a[m.n] += m.u", "m.b[m.i] = m.n", "m.b[m.few] += m.n", "m.b[m.few] *= m.b[m.i]", "m.a[m.i], m.secret = m.secret, m.u",
    "m.k += 1\nm.k += m.n", "m.k -= m.n\nm.k *= 2", "m.k = 2147483647\nm.k += m.few", "m.truth = m.u > m.v and m.n != 0", "m.truth = not m.flag",
    "for j in range(m.few):\n    m.k += j\nm.y = float(m.k)", "for j in range(m.few, -3, -2):\n    m.b[j] = j", "for j in range(0, 10, 4):\n    m.k += j * j",
    "j = 5\nfor j in range(m.few):\n    m.k += 1\nm.y = float(j)", "for j in range(3):\n    j = j * 2\n    m.k += j", "for j in range(m.n % 5):\n    m.a[j] = 1.0",
    "step = m.few + 1\nfor j in range(0, 12, step):\n    m.k += j", "for j in range(2, 9, m.few):\n    m.k += j",
    "for x in m.a:\n    m.y = max(m.y, x)", "for x in (1.0, m.u, 3.0):\n    m.y += x", "for i, x in enumerate(m.b):\n    m.k = max(m.k, i + x % 7)",
    "for x, n in zip(m.a, m.b):\n    m.y += min(x, 5.0) * (n % 9)", "for a, b in ((1, 2.0), (3, 4.0)):\n    m.y += a * b",
    "for j in range(4):\n    if m.b[j] == m.n:\n        break\nelse:\n    m.k = 9", "j = 0\nwhile j < 4:\n    j += 1\n    if j == m.few:\n        continue\n    m.k += j\nelse:\n    m.k += 100",
    "while True:\n    m.k += 1\n    if m.k > m.few:\n        break", "x = m.u\nwhile x > 1.0:\n    x = x / 2.0\nm.y = x",
    "x, (y, z) = m.u, (m.v, 1.0)\nm.y = x + y * z", "m.a[0], m.a[1] = m.a[1], m.a[0]",
    "a = m.a\na[m.few] = 5.0\nm.y = m.a[m.few]", "def twice(x):\n    return 2.0 * x + m.v\nm.y = twice(m.u)", "m.y = (lambda x: x * x)(m.u)",
    "match m.n:\n    case 1 | 2:\n        m.k = 1\n    case Kind.seven:\n        m.k = 2\n    case _:\n        m.k = 3",
    "m.k = 1 if m.n == Kind.one else 2 if m.n == Kind.seven else 3", "m.y = pair_of(m.u)[0] + pair_of(m.v)[1]", "x, y = pair_of(m.u)\nm.y = x - y",
    "m.y = applied(half, m.u) + applied(lambda x: x + m.v, m.u)", "m.y = stored(m, 1.0) + m.secret + stored(m, 2.0)", "m.y = m.secret + stored(m, 3.0)",
    "if m.n > 3:\n    return m.n\nm.y = 1.0", "m.y = with_default(m.u) + with_default(m.u, 3.0) + with_default(factor=m.v, x=m.u)", "m.y = with_default(*PAIR)",
    "x = 0\nfor j in range(m.few):\n    x += m.a[j]\nm.y = x", "x = 1\nif m.flag:\n    x = m.u\nm.y = x * 3", "m.y = m.n", "m.y = m.flag", "m.k = m.flag",
]  # fmt: skip

HELPERS = """

def sum_of(values):
    total = 0.0
    for value in values:
        total += value
    return total


def pair_of(x):
    return x + 1.0, 2.0 * x


def half(x):
    return 0.5 * x


def applied(f, x):
    return f(f(x))


def stored(m, x):
    m.secret += x
    return m.secret * x


def with_default(x, factor=2.0):
    return factor * x
"""

INTEGER = ("-fsanitize=integer", "-fsanitize-trap=integer")
UNDEFINED = ("-fsanitize=undefined", "-fno-sanitize-recover=undefined", "-fsanitize-undefined-trap-on-error")

WIDER = "does not fit|integer out of range"
"""Where plain Python computes on with an integer of more than 64 bits, C says that it has none."""


@pytest.fixture(autouse=True)
def with_helpers(monkeypatch):
    import meaning_kernels

    monkeypatch.setattr(meaning_kernels, "HEAD", meaning_kernels.HEAD.split("\n\ndef sum_of")[0] + HELPERS)


def check(component, native, count, rng, tries, bodies) -> set[int]:
    """Every case with random values; the cases that have been refused at least once."""
    refused = set()
    for case in range(count):
        for _ in range(tries):
            values = random_values(rng)
            plain, compiled, equal = run_both(component, native, case, values)
            shown = f"{bodies[case]}\n{values}\nplain: {plain}\nC: {compiled}"
            if plain or compiled:
                refused.add(case)
                assert (plain and compiled) or re.search(WIDER, compiled), shown
            else:
                assert equal, shown
    return refused


def test_every_expression_has_one_meaning(tmp_path):
    component = cases_component(tmp_path, EXPRESSIONS)
    refused = check(component, Kernels(component), len(EXPRESSIONS), random.Random(1), 12, EXPRESSIONS)
    assert len(refused) > 60  # the values do reach what is refused


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("compiler", "flags"),
    [(("gcc",), ("-O0",)), (("gcc",), ("-O1", *UNDEFINED)), (ZIG, ("-O1", *INTEGER))],
    ids=["plain", "sanitized", "integers"],
)
def test_every_expression_has_one_meaning_without_optimization(tmp_path, compiler, flags):
    """Also with the sanitizers that stop at what C leaves undefined (gcc's), and at what integers lose (clang's)."""
    component = cases_component(tmp_path, EXPRESSIONS)
    check(component, Kernels(component, compiler, flags), len(EXPRESSIONS), random.Random(2), 40, EXPRESSIONS)


INEXACT = re.compile(r"\*\*|math\.(?!sqrt|floor|ceil|trunc|fabs|copysign|fmod|is)|pow\(")
"""Functions whose last digit depends on the mathematics library."""

EXACT = [body for body in EXPRESSIONS if not INEXACT.search(body)]


@pytest.mark.thorough
def test_every_expression_has_one_meaning_on_32_bits(tmp_path):
    component, rng = cases_component(tmp_path, EXACT), random.Random(3)
    refused = check_on_32_bits(component, EXACT, rng, 40, tmp_path)
    assert len(EXACT) > 120
    assert len(refused) > 40


def check_on_32_bits(component, bodies, rng, count, tmp_path) -> set[int]:
    """Compare plain Python with a 32-bit program, and return the cases that Python refuses for some values."""
    wider = 0
    runs = [(case, run_plain(component, case, random_values(rng))) for case in range(len(bodies)) for _ in range(count)]
    for (case, (before, expected, error)), (found, failed) in zip(
        runs, on_32_bits(component, [run[1][0] for run in runs], tmp_path), strict=True
    ):
        shown = f"{bodies[case]}\n{before}\nplain: {error or expected}\nC: {found}"
        failed = failed or not np.isfinite(found["y"][0])
        assert failed or not error, shown
        assert failed or all(found[name].tobytes() == expected[name].tobytes() for name in expected.dtype.names or ()), shown
        wider += failed and not error
    assert wider < 0.1 * len(runs)  # integers of more than 64 bits
    return {case for (case, (_, _, error)) in runs if error}


def refusal(component) -> str:
    try:
        translated(component)
    except BuildError as error:
        return str(error)
    return ""


def random_bodies(rng: random.Random, count: int, tmp_path, without: re.Pattern[str] | None = None) -> list[str]:
    """Functions from the grammar that the translator takes, and that do not contain a pattern."""
    bodies: list[str] = []
    while len(bodies) < count:
        body = Grammar(rng).body()
        if without is not None and without.search(body):
            continue
        problem = refusal(cases_component(tmp_path / f"one{len(bodies)}", [body]))
        assert not problem or "integers on one path" in problem, f"{body}\n{problem}"
        bodies += [] if problem else [body]
    return bodies


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(5, 8))
def test_random_kernels_have_one_meaning_on_32_bits(tmp_path, seed):
    rng = random.Random(seed)
    bodies = random_bodies(rng, 60, tmp_path, INEXACT)
    check_on_32_bits(cases_component(tmp_path / "all", bodies), bodies, rng, 25, tmp_path)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(5))
def test_random_kernels_have_one_meaning(tmp_path, seed):
    """Sixty functions each: without optimization, with it, with gcc's sanitizers (what C leaves undefined), with clang's of integers."""
    bodies = random_bodies(random.Random(seed), 60, tmp_path)
    component = cases_component(tmp_path / "all", bodies)
    odd = ("-Wno-tautological-compare", "-Wno-type-limits")  # what nobody would write is among the random tests
    for compiler, flags in (
        (("gcc",), ("-O0", *odd)),
        (ZIG, ("-O2", *odd)),
        (("gcc",), ("-O1", *UNDEFINED, *odd)),
        (ZIG, ("-O1", *INTEGER, *odd)),
    ):
        check(component, Kernels(component, compiler, flags), len(bodies), random.Random(seed), 25, bodies)


@pytest.mark.thorough
def test_passes_that_leave_out_what_is_settled_find_the_same_as_whole_ones(tmp_path, monkeypatch):
    """The independent translation is the one in which every pass translates everything."""
    bodies = random_bodies(random.Random(77), 60, tmp_path)
    made = [cases_component(tmp_path / "all", bodies), *components().values()]
    short = [translated.__wrapped__(component) for component in made]
    monkeypatch.setattr(Function, "is_settled", lambda self, unit: False)
    assert [translated.__wrapped__(component) for component in made] == short


REFUSED = [
    ("m.k = m.u * 2.0", "m.k is an integer and is set to a real number; write int"),
    ("m.truth = m.n", "m.truth is a Boolean and is set to an integer; write bool"),
    ("m.k = 2 ** m.n", "an integer to the power of an integer that may be negative"),
    ("m.y = round(m.u, 2)", "rounds in decimal numbers"),
    ("if m.flag:\n    x = 1.0\nm.y = x", "x may have no value here: it is not set on every path"),
    ("for j in range(m.few):\n    x = 1.0\nm.y = x", "x may have no value here"),
    ("for j in range(m.few):\n    pass\nm.y = float(j)", "j may have no value here"),
    ("m.y = sum(PAIR)", "from Python 3.12 on it compensates"),
    ("m.y = -max(m.u, 0)", "integers on one path and real on another"),
    ("m.y = 1.0 if m.n is Kind.one else 0.0", "`is` compares Python's objects"),
    ("m.y = m.a[m.u]", "the index m.u is a real number; write int"),
    ("m.y = PAIR[2]", "there are 2 items, numbered from 0"),
    ("m.y = m.a[4]", "outside of the 4 elements"),
    ("for j in range(m.u):\n    m.k += 1", "of a real number; write int"),
    ("x = None\nif m.flag:\n    x = 1.0\nm.y = 1.0", "set to nothing"),
    ("m.y = 1.0 if m.flag and stored(m, 1.0) + m.secret > 0.0 else 0.0", "write the call as a line of its own"),
    ("m.a[:] = m.u", "m.a[:] is a copy in Python"),
    ("m.y = sum_of(m.a[1:3])", "m.a[1:3] is a copy in Python"),
    ("m.k = 1.5 if m.flag else m.n", "is set to a real number"),
]


@pytest.mark.parametrize(("body", "words"), REFUSED)
def test_what_has_two_meanings_is_refused_with_its_line(tmp_path, body, words):
    component = cases_component(tmp_path, [body])
    with pytest.raises(BuildError) as caught:
        translated(component)
    assert words in str(caught.value)
    assert re.search(r"cases\.py:\d+: ", str(caught.value))
