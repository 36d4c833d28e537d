"""Declarations that do not fit are refused by both versions' descriptions."""

from __future__ import annotations

import pytest
from description_cases import (
    TOKEN,
    both_versions,
)

from shaper_fmu.component import Component, Input, Local, Output, Variable
from shaper_fmu.errors import BuildError
from shaper_fmu.export.model_description import (
    fmi2_native_description,
    fmi3_native_description,
)


class Base(Component):
    """Something to be declared wrongly."""

    force = Input("N", "force")

    def step(self, t, h):
        pass


def of_states(*states: str, **variables: Variable) -> type[Component]:
    return type("Wrong", (Base,), {**variables, "continuous_states": states})


@pytest.mark.parametrize(
    ("component", "words"),
    [
        (lambda: of_states("force"), "continuous_states names 'force', which is not an output or local"),
        (lambda: of_states("x", x=Output("m", "x")), "the continuous state 'x' needs a derivative"),
        (
            lambda: of_states("x", x=Output("m", "x", derivative="w"), v=Output("m/s", "v")),
            "'w', must be an output or a local. Known: x, v",
        ),
        (lambda: of_states("x", x=Output("m", "x", derivative="n"), n=Output("", "n", start=1)), "must be of type float"),
        (
            lambda: of_states("x", x=Output("m", "x", derivative="v"), v=Output("m/s", "v", size=2)),
            "the same size as 'x'",
        ),
        (
            lambda: of_states(
                "x", "y", x=Output("m", "x", derivative="v"), y=Output("m", "y", derivative="v"), v=Local("m/s", "v")
            ),
            "'x' and 'y' cannot share the derivative 'v'",
        ),
        (
            lambda: of_states(x=Output("m", "x", derivative="y"), y=Output("m", "y", derivative="x")),
            "the derivatives x -> y -> x go round in a circle",
        ),
        (lambda: of_states(x=Output("m", "x", depends=("farce",))), "depends of 'x' names 'farce', which is not an input.*'force'"),
    ],
)
@both_versions
def test_a_declaration_that_does_not_fit_is_refused(component, words, version):
    make = fmi2_native_description if version == "2" else fmi3_native_description
    with pytest.raises(BuildError, match=words):
        make(component(), TOKEN, "the test")
