"""Random kernels from a grammar: functions of the record of meaning_kernels.Cases."""

from __future__ import annotations

import random

_REAL_FUNCTIONS = [
    "math.sin({})",
    "math.cos({})",
    "math.sqrt({})",
    "math.exp({})",
    "math.floor({}) * 1.0",
    "abs({})",
    "math.atan({})",
    "-({})",
    "math.log({})",
]
_INTEGER_FUNCTIONS = ["abs({})", "-({})", "~({})", "int({})"]


class Grammar:
    """Makes the body of a function, with names that have a value wherever they are read."""

    def __init__(self, rng: random.Random):
        self.rng, self.lines = rng, []
        self.reals, self.integers = ["m.u", "m.v", "m.positive", "m.secret"], ["m.n", "m.m", "m.few", "m.k"]
        self.serial = 0

    def body(self) -> str:
        self.block(0, self.rng.randrange(2, 6))
        self.lines.append(f"m.y = {self.real(2)}")
        return "\n".join(self.lines)

    def block(self, depth: int, statements: int) -> None:
        for _ in range(statements):
            self.statement(depth)

    def say(self, depth: int, text: str) -> None:
        self.lines.append("    " * depth + text)

    def statement(self, depth: int) -> None:
        kind = self.rng.randrange(10 if depth < 3 else 5)
        if kind <= 1:
            self.assign(depth, self.reals, self.real(2), "x")
        elif kind == 2:
            self.assign(depth, self.integers, self.integer(2), "j")
        elif kind == 3:
            self.say(
                depth,
                self.rng.choice(["m.a[{0}] = float({1})", "m.a[{0}] += {1}", "m.secret -= {1}"]).format(self.index(), self.real(1)),
            )
        elif kind == 4:
            self.say(
                depth,
                self.rng.choice(["m.b[{0}] = {1}", "m.k = {1}", "m.truth = {2}", "m.k += {1}"]).format(
                    self.index(), self.integer(1), self.test(1)
                ),
            )
        elif kind <= 6:
            self.branch(depth)
        elif kind == 7:
            self.over_range(depth)
        elif kind == 8:
            self.counting(depth)
        else:
            self.over_array(depth)

    def assign(self, depth: int, names: list[str], value: str, base: str) -> None:
        own = [name for name in names if name.startswith(base)]  # not the counters of loops, which would not end
        if own and self.rng.random() < 0.4:
            self.say(depth, f"{self.rng.choice(own)} {self.rng.choice(['=', '+=', '-='])} {value}")
            return
        self.serial += 1
        self.say(depth, f"{base}{self.serial} = {value}")
        names.append(f"{base}{self.serial}")

    def inside(self, depth: int, statements: int) -> None:
        """A block after which its own names are forgotten: they may have no value there."""
        kept = list(self.reals), list(self.integers)
        self.block(depth, statements)
        self.reals, self.integers = kept

    def branch(self, depth: int) -> None:
        self.say(depth, f"if {self.test(2)}:")
        self.inside(depth + 1, self.rng.randrange(1, 3))
        if self.rng.random() < 0.5:
            self.say(depth, "else:")
            self.inside(depth + 1, self.rng.randrange(1, 3))

    def over_range(self, depth: int) -> None:
        self.serial += 1
        name = f"i{self.serial}"
        ends = self.rng.choice(["3", "1, 4", "4, 0, -1", "m.few", "0, m.few + 1, 2", "m.few, -2, -1"])
        self.say(depth, f"for {name} in range({ends}):")
        self.integers.append(name)
        self.inside(depth + 1, self.rng.randrange(1, 3))
        self.integers = [n for n in self.integers if n != name]

    def counting(self, depth: int) -> None:
        self.serial += 1
        name = f"c{self.serial}"
        self.say(depth, f"{name} = 0")
        self.say(depth, f"while {name} < {self.rng.randrange(1, 5)}:")
        self.say(depth + 1, f"{name} += 1")
        if self.rng.random() < 0.4:
            self.say(depth + 1, f"if {self.test(1)}:")
            self.say(depth + 2, self.rng.choice(["break", "continue"]))
        self.integers.append(name)
        self.inside(depth + 1, self.rng.randrange(1, 3))
        self.integers = [n for n in self.integers if n != name]

    def over_array(self, depth: int) -> None:
        self.serial += 1
        name, whole = f"e{self.serial}", self.rng.choice(["m.a", "PAIR", "m.b", "NUMBERS"])
        names = self.reals if whole in ("m.a", "PAIR") else self.integers
        self.say(depth, f"for {name} in {whole}:")
        names.append(name)
        self.inside(depth + 1, self.rng.randrange(1, 3))
        self.reals, self.integers = [n for n in self.reals if n != name], [n for n in self.integers if n != name]

    def index(self) -> str:
        return self.rng.choice(["0", "3", "-1", "m.few", "m.i", "m.n % 4", "(m.k + 1) % 4", "m.m // 7"])

    def real(self, depth: int) -> str:
        choice = self.rng.randrange(9) if depth else self.rng.randrange(3)
        if choice == 0:
            return repr(self.rng.choice([0.0, 1.0, 0.5, -2.0, 3.25, 1e-3]))
        if choice <= 2:
            return self.rng.choice([*self.reals, f"m.a[{self.index()}]"])
        if choice <= 5:
            return f"({self.real(depth - 1)} {self.rng.choice(['+', '-', '*', '/', '%', '//'])} {self.either(depth - 1)})"
        if choice == 6:
            return self.rng.choice(_REAL_FUNCTIONS).format(self.real(depth - 1))
        if choice == 7:
            return f"{self.rng.choice(['min', 'max'])}({self.real(depth - 1)}, {self.either(depth - 1)})"
        return f"({self.real(depth - 1)} if {self.test(depth - 1)} else {self.real(depth - 1)})"

    def either(self, depth: int) -> str:
        return self.real(depth) if self.rng.random() < 0.7 else self.integer(depth)

    def integer(self, depth: int) -> str:
        choice = self.rng.randrange(8) if depth else self.rng.randrange(3)
        if choice == 0:
            return str(self.rng.choice([0, 1, 2, 7, -3, 100]))
        if choice <= 2:
            return self.rng.choice([*self.integers, f"m.b[{self.index()}]"])
        if choice <= 5:
            return f"({self.integer(depth - 1)} {self.rng.choice(['+', '-', '*', '//', '%', '&', '|', '^'])} {self.integer(depth - 1)})"
        if choice == 6:
            return self.rng.choice(_INTEGER_FUNCTIONS).format(self.integer(depth - 1))
        return f"int({self.real(depth - 1)})"

    def test(self, depth: int) -> str:
        choice = self.rng.randrange(7) if depth else self.rng.randrange(4)
        if choice <= 2:
            return f"{self.either(depth)} {self.rng.choice(['<', '<=', '>', '>=', '==', '!='])} {self.either(depth)}"
        if choice == 3:
            return self.rng.choice(["m.flag", "m.truth", "not m.flag", "m.n in (1, 2, 7)"])
        if choice == 4:
            return f"0 < {self.either(depth - 1)} <= {self.either(depth - 1)}"
        return f"({self.test(depth - 1)} {self.rng.choice(['and', 'or'])} {self.test(depth - 1)})"
