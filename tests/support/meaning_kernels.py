"""Kernels made of many small cases, to compare plain Python with C case by case."""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np
from compiled_kernels import Kernels, record_of

from shaper_fmu.component import Component
from shaper_fmu.errors import ComponentError
from shaper_fmu.registry import load_components

HEAD = '''"""Cases of what kernels compute."""

import math
from enum import IntEnum

from shaper_fmu.component import Component, Input, Output, Parameter, State


class Kind(IntEnum):
    one = 1
    two = 2
    seven = 7


PAIR = (1.5, -2.0)
NUMBERS = (3, 1, 4, 1, 5)
'''

CLASS = '''

class Cases(Component):
    """Computes the case that is asked for."""

    u = Input("", "real")
    v = Input("", "real")
    n = Input("", "integer", start=0, kind=int)
    m = Input("", "integer", start=0, kind=int)
    i = Input("", "integer", start=0, kind=int)
    flag = Input("", "Boolean", start=False, kind=bool)
    few = Parameter(2, "", "bounded", min=0, max=3)
    positive = Parameter(0.5, "", "bounded", min=0.0, exclusive=True)
    case = Parameter(0, "", "number of the case")
    y = Output("", "real result")
    k = State(0)
    truth = State(False)
    a = State([1.0, -2.0, 0.5, 1e300], size=4)
    b = State([1, -2, 3, 2147483647], size=4)
    secret = State(42.0)

    def step(self, t, h):
'''

REALS = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    2.5,
    -2.5,
    3.5,
    1e-300,
    -1e-300,
    1e300,
    -1e300,
    1e19,
    -1e19,
    9007199254740993.0,
    0.1,
    7.0,
    -7.0,
]
REALS += [5e-324, 1.7976931348623157e308, 709.0, 711.0, 1e9, 2147483648.0, -2147483649.0, 9.223372036854775e18, 9.3e18]
INTEGERS = [
    0,
    1,
    -1,
    2,
    -2,
    3,
    -3,
    4,
    -5,
    6,
    7,
    8,
    12,
    20,
    40,
    63,
    64,
    70,
    1000,
    -1000,
    46341,
    100000,
    2147483647,
    -2147483648,
    -2147483647,
]


def cases_component(folder: Path, bodies: list[str]) -> type[Component]:
    """A component whose step runs the body numbered `case`; a body is lines of a function of the record m."""
    functions = [
        "\n\ndef case_{}(m):\n{}\n    return 0\n".format(i, "".join(f"    {line}\n" for line in body.splitlines()))
        for i, body in enumerate(bodies)
    ]
    steps = "".join(f"        if self.case == {i}:\n            return case_{i}(self)\n" for i in range(len(bodies)))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "cases.py"
    path.write_text(HEAD + "".join(functions) + CLASS + steps + "        return 0\n")
    return load_components(path)[0]


def random_values(rng: random.Random) -> dict:
    """Inputs and parameters, half of the time moderate, else also those at the ends of what numbers can be."""
    if rng.random() < 0.5:
        reals, integers = [rng.uniform(-3.0, 3.0), float(rng.randrange(4))], [rng.randrange(4), rng.randrange(-3, 9)]
        moderate = {name: rng.choice(reals) for name in ("u", "v")} | {name: rng.choice(integers) for name in ("n", "m", "i")}
        return {**moderate, "flag": rng.random() < 0.5, "few": rng.randrange(4), "positive": rng.uniform(0.1, 2.0)}
    return {
        "u": rng.choice(REALS), "v": rng.choice([*REALS, rng.uniform(-10, 10)]),
        "n": rng.choice(INTEGERS), "m": rng.choice([*INTEGERS, rng.randrange(-100, 100)]), "i": rng.choice(INTEGERS),
        "flag": rng.random() < 0.5, "few": rng.randrange(4), "positive": rng.choice([5e-324, 1e-3, 0.5, 3.0, 1e300]),
    }  # fmt: skip


def run_plain(component: type[Component], case: int, values: dict) -> tuple[np.ndarray, np.ndarray, str]:
    """The record before a step and, as plain Python makes it, afterwards; and the error, if there is one."""
    plain = component(case=case, **values)
    before = record_of(plain)
    try:
        plain.do_step(0.0, 0.1)
    except ComponentError as error:
        return before, before, str(error)
    return before, record_of(plain), ""


def run_both(component: type[Component], native: Kernels, case: int, values: dict) -> tuple[str, str, bool]:
    """What plain Python and C find: an empty text, or an error; and whether their records are equal, bit for bit."""
    record, expected, error = run_plain(component, case, values)
    errors = [error, ""]
    try:
        status = native.step(record, 0.0, 0.1)
        errors[1] = f"status {status}" if status else ""
    except ArithmeticError as error:
        errors[1] = str(error)
    if not errors[1] and not math.isfinite(record["y"][0]):
        errors[1] = "y is not finite"  # what the FMI layer refuses
    if errors[0] or errors[1]:
        return errors[0], errors[1], False
    for one in (expected, record):
        one["y"] += 0.0  # gcc 12 makes -x of 0.0 - x where x is a converted integer: the sign of zero is not compared there
    return "", "", all(expected[name].tobytes() == record[name].tobytes() for name in expected.dtype.names or ())
