"""Declaring a component, and using it as a plain Python object."""

from __future__ import annotations

import math

import pytest

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.component import Component, Input, Output, Parameter, State
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.plants.mass_spring_damper import MassSpringDamper
from shaper_fmu.units import parse_unit


def test_variables_keep_the_order_of_the_file():
    names = list(MassSpringDamper.variables)
    assert names[:5] == ["left_limits", "force", "mass", "stiffness", "damping"]
    assert names[-4:] == ["known_step", "transition", "held_response", "ramp_response"]


def test_variables_of_a_base_class_come_first():
    class Base(Component):
        first = Input("m", "first")

        def step(self, t, h):
            pass

    class Derived(Base):
        second = Output("m", "second")

    assert list(Derived.variables) == ["left_limits", "first", "second"]


def test_types_follow_the_start_values():
    kinds = {name: v.kind for name, v in InputShaper.variables.items()}
    assert (kinds["command"], kinds["modes"], kinds["shape_mode"], kinds["shaper"]) == (float, int, bool, Shaper)


def test_array_elements_are_scalars_in_fmi_2():
    assert InputShaper.variables["natural_frequency"].scalar_names == [f"natural_frequency[{i}]" for i in (1, 2, 3, 4)]


def test_start_values_by_keyword_sequence_element_and_item_name():
    shaper = InputShaper(shaper="zvd", natural_frequency=[1.0, 2.0])
    shaper.set("natural_frequency[4]", 8)
    assert shaper.shaper == Shaper["zvd"]
    assert shaper.natural_frequency == [1.0, 2.0, 10.0, 8.0]


def test_instances_do_not_share_arrays():
    one, other = InputShaper(), InputShaper()
    one.set("natural_frequency[1]", 3.0)
    assert other.natural_frequency[0] == 10.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"natural_frequencies": 1.0}, "Did you mean 'natural_frequency'?"),
        ({"natural_frequency": [1.0] * 5}, "elements 1 to 4"),
        ({"shaper": "zvf"}, "Did you mean 'zv"),
        ({"modes": 1.5}, "not of type int"),
        ({"command": "fast"}, "not of type float"),
        ({"duration": 1.0}, "has no input or parameter 'duration'"),
    ],
)
def test_wrong_start_values_are_refused(values, words):
    with pytest.raises(ComponentError, match=words.replace("?", r"\?")):
        InputShaper(**values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"natural_frequency": [-5.0]}, r"natural_frequency\[1\] = -5 rad/s must be greater than 0 rad/s"),
        ({"damping_ratio": [0.0, 1.0]}, r"damping_ratio\[2\] = 1 must be less than 1"),
        ({"modes": 5}, "modes = 5 must be at most 4"),
        ({"shaper": 99}, r"shaper = 99 is not one of none \(1\), zv \(2\)"),
        ({"vibration_tolerance": math.nan}, "vibration_tolerance is nan; it must be a finite number"),
        ({"command": math.inf}, "input command is inf"),
    ],
)
def test_initialization_names_the_value_outside_its_domain(values, words):
    with pytest.raises(ComponentError, match=words):
        InputShaper(**values).initialize()


def test_a_step_refuses_an_input_that_is_not_finite():
    plant = MassSpringDamper()
    plant.initialize()
    plant.force = math.nan
    with pytest.raises(ComponentError, match=r"input force is nan; .* at t = 0.5 s"):
        plant.do_step(0.5, 0.1)


@pytest.mark.parametrize(("time", "step"), [(0.0, -0.1), (math.nan, 0.1), (0.0, math.inf)])
def test_impossible_steps_are_refused(time, step):
    plant = MassSpringDamper()
    plant.initialize()
    with pytest.raises(ComponentError, match="is not possible"):
        plant.do_step(time, step)


def test_an_output_that_is_not_finite_is_an_error():
    class Runaway(Component):
        value = Output("", "grows")

        def step(self, t, h):
            self.value = math.inf if h > 0.0 else 0.0

    component = Runaway()
    component.initialize()
    with pytest.raises(ComponentError, match="value became inf at t = 2 s"):
        component.do_step(2.0, 0.1)


def test_a_status_is_explained_with_values():
    class Picky(Component):
        messages = {3: "no more than {limit} please"}
        limit = Parameter(2.5, "", "limit")

        def step(self, t, h):
            return 3 if h > 0.0 else 0

    component = Picky()
    component.initialize()
    with pytest.raises(ComponentError, match=r"Picky: no more than 2.5 please \(t = 1 s\)"):
        component.do_step(1.0, 0.1)


def test_state_of_another_component_is_refused():
    with pytest.raises(ComponentError, match="not the state of this component"):
        InputShaper().set_state(MassSpringDamper().get_state())


def test_reserved_names_are_refused():
    with pytest.raises(ComponentError, match="cannot be called 'initialize'"):

        class Wrong(Component):
            initialize = State(0.0)  # pyright: ignore[reportAssignmentType]


@pytest.mark.parametrize(
    ("text", "exponents", "factor"),
    [
        ("N.s/m", {"kg": 1, "s": -1}, 1.0),
        ("m/s2", {"m": 1, "s": -2}, 1.0),
        ("rad/s", {"rad": 1, "s": -1}, 1.0),
        ("1/s", {"s": -1}, 1.0),
        ("mm", {"m": 1}, 1e-3),
        ("J/kg/K", {"m": 2, "s": -2, "K": -1}, 1.0),
    ],
)
def test_units_are_base_unit_exponents(text, exponents, factor):
    unit = parse_unit(text)
    assert dict(unit.exponents) == exponents
    assert unit.factor == factor


def test_an_unknown_unit_is_refused():
    with pytest.raises(ComponentError, match="'Nm' is not a known unit symbol"):
        parse_unit("Nm/rad")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("damping_ratio", 0.1, r"an array of 4 elements, not 0.1; give a list, or one element: damping_ratio\[1\]"),
        ("damping_ratio", "0.1", "an array of 4 elements, not '0.1'"),
        ("damping_ratio", None, "an array of 4 elements, not None"),
        ("vibration_tolerance", [0.1], r"vibration_tolerance = \[0.1\] is not of type float"),
        ("vibration_tolerance", None, "vibration_tolerance = None is not of type float"),
        ("shape_mode", [[1.0], True], "is not of type bool"),
        ("shaper", math.nan, "shaper = nan is not of type"),
        ("shaper", math.inf, "shaper = inf is not of type"),
    ],
)
def test_a_value_of_another_shape_or_type_is_refused_by_name(name, value, said):
    with pytest.raises(ComponentError, match=said):
        InputShaper().set(name, value)
