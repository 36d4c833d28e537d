"""Names by the convention "structured": what is allowed is what fmpy's grammar allows, which its Earley parser takes milliseconds for."""

from __future__ import annotations

import pytest
from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.validation import validate_model_description
from hypothesis import example, given, settings
from hypothesis import strategies as st

from shaper_fmu.master.variable_names import wrong_names

PIECES = [
    *"abzAZ_019", *"'\\\"?.,()[]{}!#$%&*+-/:;<>=@^|~ `", "\n", "\t", "\r", "\f", "\v", "\a", "\b", "\0", "é",
    "der(", ")", "[1]", "[1,2]", ",2)", "\\'", "\\\\", "\\n", "\\q", "'a'", "a.b", "'.'",
]  # fmt: skip
NAMES = st.lists(st.sampled_from(PIECES), max_size=8).map("".join)


def described(convention: str, *names: str) -> ModelDescription:
    variables = [ModelVariable(name=name, sourceline=line, type="Real") for line, name in enumerate(names, 1)]
    return ModelDescription(fmiVersion="1.0", variableNamingConvention=convention, modelVariables=variables)  # pyright: ignore[reportArgumentType]


def of_fmpy(*names: str) -> list[str]:
    """fmpy's findings, without what its parser says of a name (and that it cannot read it)."""
    found = validate_model_description(described("structured", *names), validate_variable_names=True)
    end = 'naming convention "structured".'
    return [problem[: problem.index(end) + len(end)] for problem in found if end in problem]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.lists(NAMES, min_size=1, max_size=8, unique=True))
@example(
    [
        "a",
        "'a'",
        "''",
        "'''",
        r"'\''",
        r"'\'",
        r"'a\'b'.c",
        "der(a)",
        "der(a,2)",
        "der(a, 2)",
        "der(der(a))",
        "a[1,2].b[3]",
        "a[]",
        "",
    ]
)
@example(
    [r"'\'.'\'.'\'.'", r"'a'.'\'[1].'b\'c'", "'\n'", "a\n", "a ", " a", "'a\v'", "der(", "a.", ".a", "1a", "a1", "_", "é", "'é'"]
)
def test_the_same_names_are_wrong_as_by_fmpys_grammar(names):
    assert wrong_names(described("structured", *names)) == of_fmpy(*names)


def test_long_and_hostile_names_take_no_time():
    """100,000 characters each, made to send a matcher back again and again."""
    quoted = "'" + "\\'" * 50_000
    names = [
        "a" * 100_000,
        "a." * 50_000,
        "a[1]" * 25_000,
        quoted,
        quoted + "'",
        "'\\'." * 25_000,
        "'a'." * 25_000 + "?",
        "der(" * 25_000,
    ]
    wrong = wrong_names(described("structured", *names))
    assert [int(problem.rpartition("(line ")[2].split(")")[0]) for problem in wrong] == [2, 3, 6, 7, 8]


@pytest.mark.parametrize("name", ["a b", "a\tb"])
def test_flat_names_are_told_by_fmpy(name):
    assert wrong_names(described("flat", name)) == []
