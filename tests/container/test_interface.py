"""The variables of a container: which, under which names, of which types and start values."""

from __future__ import annotations

from pathlib import Path

import pytest
from rich_fmus import rich_fmu

from shaper_fmu.container.inner import initial_of
from shaper_fmu.container.interface import not_shown, outer_variables
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.container.wrapping import not_wrapped, time_of, wrapped_variables
from shaper_fmu.errors import ModelError
from shaper_fmu.master.structure import SystemStructure


def both(tmp_path: Path) -> SystemStructure:
    """Two FMUs, of which one feeds a part of the other's array."""
    system = SystemStructure()
    system.add("two", rich_fmu(tmp_path, 2), mass=5.0)
    system.add("three", rich_fmu(tmp_path, 3), single=0.25)
    system.connect("two.x", "three.u[2]")
    return system


def names(found: list[OuterVariable]) -> list[str]:
    return [variable.name for variable in found]


def named(found: list[OuterVariable], name: str) -> OuterVariable:
    return next(variable for variable in found if variable.name == name)


INPUTS_2 = ["two.angle", "two.gear", "two.on", "two.label", "three.u[1]", "three.single", "three.small"]


def test_by_default_free_inputs_and_all_outputs_are_shown(tmp_path):
    system = both(tmp_path)
    outputs_2 = ["two.count", "two.warm", "two.x", "two.pi", "three.long", "three.gear"]
    flags, outputs = ["three.flags[1]", "three.flags[2]", "three.none"], ["three.y[1]", "three.y[2]"]
    assert names(outer_variables(system, 2)) == [*INPUTS_2, *flags, *outputs_2, *outputs, "three.also_y[1]", "three.also_y[2]"]
    assert names(outer_variables(system, 3)) == [
        *INPUTS_2, "three.flags", "three.blob", "three.none", *outputs_2, "three.y", "three.also_y"
    ]  # fmt: skip
    for fmi in (2, 3):
        outer = outer_variables(system, fmi)
        assert [variable.reference for variable in outer] == [i + (fmi == 3) for i in range(len(outer))]
    assert [text.split()[0] for text in not_shown(system, 2)] == ["three.blob", "three.tick"]
    assert [text.split()[0] for text in not_shown(system, 3)] == ["three.tick"]


def test_types_and_starts_follow_the_outer_version(tmp_path):
    system = both(tmp_path)
    two, three = (outer_variables(system, fmi, expose=["two.*", "three.m", "three.labels"]) for fmi in (2, 3))
    types = {
        "two.angle": ("Real", "Float64", (0.25,)), "two.gear": ("Enumeration", "Enumeration", (3,)),
        "two.label": ("String", "String", ("as <is>",)), "two.count": ("Integer", "Int32", ()), "two.x": ("Real", "Float64", (1.5,)),
        "two.mass": ("Real", "Float64", (5.0,)), "two.gain": ("Real", "Float64", (float("inf"),)),
        "three.single": ("Real", "Float32", (0.25,)), "three.small": ("Integer", "UInt8", (7,)),
        "three.long": ("Integer", "Int64", ()), "three.none": ("Real", "Float64", (2.0,)),
    }  # fmt: skip
    for name, (of_2, of_3, starts) in types.items():
        assert (named(two, name).type, named(two, name).starts) == (of_2, starts)
        assert (named(three, name).type, named(three, name).starts) == (of_3, starts)
    assert named(three, "three.blob").starts == (b"\x0a\xff",)
    matrix = named(three, "three.m")
    assert (matrix.dimensions, matrix.starts) == ((2, 3), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    assert [target.port for (target,) in matrix.elements][:2] == [("three", "m[1,1]"), ("three", "m[1,2]")]
    assert named(two, "three.m[2,1]").starts == (4.0,)
    assert named(three, "three.labels").starts == ("one two", "three")
    assert named(two, "three.labels[2]").starts == ("three",)


def test_a_name_with_a_star_exposes_parameters_and_local_variables(tmp_path):
    system = both(tmp_path)
    shown = names(outer_variables(system, 3))
    more = names(outer_variables(system, 3, expose=["two.*"]))[len(shown) :]
    assert more == ["two.mass", "two.gain", "two.double", "two.der(x)", "two.guess", "two.crank.speed"]
    assert names(outer_variables(system, 3, expose=["two.crank.*", "two.crank.speed", "two.x"]))[len(shown) :] == [
        "two.crank.speed"
    ]
    initials = {v.name: initial_of(v) for v in outer_variables(system, 3, expose=["two.*"])}
    expected = {"two.angle": None, "two.x": "exact", "two.pi": "exact", "two.count": "calculated", "two.mass": "exact"}
    expected |= {"two.double": "calculated", "two.guess": "approx", "three.y": "calculated"}
    assert expected.items() <= initials.items()


def test_names_are_changed(tmp_path):
    found = outer_variables(both(tmp_path), 3, rename={"two.x": "position", "three.flags": "flags"})
    assert (named(found, "position").elements[0][0].port, named(found, "flags").dimensions) == (("two", "x"), (2,))


@pytest.mark.parametrize(
    ("fmi", "arguments", "problem"),
    [
        (2, {"expose": ["three.blob"]}, "three.blob is of type Binary, which FMI 2.0 does not have: make a container of FMI 3.0"),
        (3, {"expose": ["three.tick"]}, "three.tick is a clock, which no container shows"),
        (3, {"expose": ["two.time"]}, "two.time is the time, of which the container has its own"),
        (3, {"expose": ["two.mas"]}, "Did you mean 'mass'?"),
        (3, {"expose": ["two"]}, "two is an instance: name a variable of it, or two.* for all"),
        (3, {"expose": ["tow.*"]}, "tow.*: no parameter, calculated parameter or local variable has such a name"),
        (3, {"expose": ["three.u[2]"]}, "three.u[2] is fed inside: expose its source, two.x"),
        (2, {"expose": ["three.huge"]}, "three.huge starts at 9000000000, which is no Integer of FMI 2.0"),
        (3, {"rename": {"two.y": "z"}}, "two.y: there is no such variable to rename. Did you mean 'two.x'?"),
        (3, {"rename": {"two.x": "two.pi"}}, "two.pi would be the name of two.x and of two.pi: rename one of them"),
        (3, {"rename": {"two.x": "a\nb"}}, "'a\\nb' is not a name for a variable (two.x)"),
    ],
)
def test_what_cannot_be_shown_is_refused(tmp_path, fmi, arguments, problem):
    with pytest.raises(ModelError) as error:
        outer_variables(both(tmp_path), fmi, **arguments)
    assert len(error.value.problems) == 1
    assert problem in error.value.problems[0]


def test_all_problems_are_told(tmp_path):
    with pytest.raises(ModelError) as error:
        outer_variables(both(tmp_path), 3, expose=["three.tick", "two.nothing"])
    assert len(error.value.problems) == 2


def test_a_system_without_free_inputs_and_outputs_has_nothing_to_show():
    with pytest.raises(ModelError, match="nothing to show"):
        outer_variables(SystemStructure(), 2)


def test_a_structural_parameter_is_a_constant_at_its_value(tmp_path):
    system = SystemStructure()
    system.add("three", rich_fmu(tmp_path, 3), n=3)
    found = outer_variables(system, 3, expose=["three.n"])
    size = named(found, "three.n")
    assert (size.causality, size.variability, size.starts, initial_of(size)) == ("local", "constant", (3,), "exact")
    assert named(found, "three.u").dimensions == (3,)


def shaped(tmp_path: Path, version: int, *inputs: str) -> SystemStructure:
    """A plant with shapers before some of its inputs, by FMUs that are descriptions alone."""
    system = SystemStructure()
    system.add("plant", rich_fmu(tmp_path, version))
    for i, name in enumerate(inputs):
        shaper = "shaper" if i == 0 else f"shaper{i + 1}"
        system.add(shaper, shaper_fmu(tmp_path))
        system.connect(f"{shaper}.shaped", f"plant.{name}")
    return system


def shaper_fmu(folder: Path) -> Path:
    from bare_fmus import CO, fmi_2

    variables = """<ScalarVariable name="command" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="kind" valueReference="1" causality="parameter" variability="fixed"><Integer start="2"/></ScalarVariable>
<ScalarVariable name="length" valueReference="2" causality="calculatedParameter" variability="fixed"><Real/></ScalarVariable>
<ScalarVariable name="shaped" valueReference="3" causality="output"><Real/></ScalarVariable>"""
    return fmi_2(folder / "shaper.fmu", CO, variables)


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_wrapped_plant_has_its_own_interface_and_the_shapers_parameters(tmp_path, fmi):
    system = shaped(tmp_path, 2, "angle")
    found = wrapped_variables(system, fmi)
    plant = [str(v.name) for v in system.fmus["plant"].description.modelVariables if v.causality != "independent"]
    assert names(found) == [*plant, "shaper.kind", "shaper.length"]
    angle = found[0]
    assert angle.elements[0][0].port == ("shaper", "command")
    assert (angle.causality, angle.starts, angle.shown.description) == ("input", (0.25,), "of the crank")
    for outer, inner in zip(found, [v for v in system.fmus["plant"].description.modelVariables if v.name != "time"], strict=False):
        assert (outer.causality, outer.variability) == (inner.causality, inner.variability)
    assert time_of(system) == "time"


def test_one_element_of_a_plants_array_is_shaped(tmp_path):
    system = shaped(tmp_path, 3, "u[2]", "none")
    with pytest.raises(ModelError, match=r"plant\.huge starts at 9000000000"):
        wrapped_variables(system, 2)
    found = wrapped_variables(system, 3)
    u = named(found, "u")
    assert (u.dimensions, u.starts) == ((2,), (1.0, 2.0))
    assert [target.port for (target,) in u.elements] == [("plant", "u[1]"), ("shaper", "command")]
    assert named(found, "none").elements[0][0].port == ("shaper2", "command")
    assert names(found)[-4:] == ["shaper.kind", "shaper.length", "shaper2.kind", "shaper2.length"]
    assert [text.split()[0] for text in not_wrapped(system, 3)] == ["tick"]


def test_a_shapers_parameters_get_a_prefix_that_the_plant_does_not_have(tmp_path):
    system = SystemStructure()
    system.add("plant", rich_fmu(tmp_path, 2))
    system.add("crank", shaper_fmu(tmp_path))
    system.connect("crank.shaped", "plant.angle")
    assert names(wrapped_variables(system, 2))[-2:] == ["crank_2.kind", "crank_2.length"]
