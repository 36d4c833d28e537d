"""The model descriptions of containers: valid, and saying of each variable what the FMU inside says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from bare_fmus import CO, bare_fmu, fmi_2, large
from description_cases import element, read_back, unknowns
from fmpy.model_description import ModelDescription, ModelVariable, SimpleType
from lxml import etree
from rich_fmus import THREE, TWO, rich_fmu
from test_interface import both, shaped

from shaper_fmu.archives import read_archive
from shaper_fmu.container.description2 import description2
from shaper_fmu.container.description3 import description3
from shaper_fmu.container.head import Capabilities, Experiment, Head
from shaper_fmu.container.interface import outer_variables
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.container.wrapping import time_of, wrapped_variables
from shaper_fmu.master.description import read_description
from shaper_fmu.master.structure import SystemStructure

DESCRIBE = {2: description2, 3: description3}
HEAD = Head("both", "both", "{1}", "two in one", Experiment(0.5, 2.0, 0.01, 1e-6))
versions = pytest.mark.parametrize("fmi", [2, 3])


def described(system: SystemStructure, fmi: int, outer: Sequence[OuterVariable], head: Head = HEAD) -> ModelDescription:
    """What fmpy makes of it, with all its checks and ours; the same bytes each time."""
    xml = DESCRIBE[fmi](system, outer, head)
    assert xml == DESCRIBE[fmi](system, outer, head)
    assert read_description(xml, "x.fmu")[1] == []
    return read_back(xml)


def root_of(system: SystemStructure, fmi: int, outer: Sequence[OuterVariable], head: Head = HEAD) -> etree._Element:
    return etree.fromstring(DESCRIBE[fmi](system, outer, head))


def variable(description: ModelDescription, name: str) -> ModelVariable:
    return next(one for one in description.modelVariables if one.name == name)


def type_of(found: ModelVariable) -> SimpleType:
    assert found.declaredType is not None
    return found.declaredType


ALL = ["two.*", "three.m", "three.labels", "three.n"]


@versions
def test_a_container_with_all_that_descriptions_can_say_is_valid(tmp_path, fmi):
    system = both(tmp_path)
    outer = outer_variables(system, fmi, expose=ALL)
    found = described(system, fmi, outer)
    expected = [(v.name, v.reference, v.causality, v.variability, v.type) for v in outer]
    shown = [(v.name, v.valueReference, v.causality, v.variability, v.type) for v in found.modelVariables]
    assert shown[: len(expected)] == expected
    assert [name for name, *_ in shown[len(expected) :]] == (["time"] if fmi == 3 else [])
    experiment = found.defaultExperiment
    assert [experiment.startTime, experiment.stopTime, experiment.stepSize, experiment.tolerance] == ["0.5", "2.0", "0.01", "1e-06"]
    assert found.variableNamingConvention == "flat"  # two.der(x) is no structured name
    assert described(system, fmi, outer_variables(system, fmi)).variableNamingConvention == "structured"


ATTRIBUTES = ["description", "start", "min", "max", "nominal", "quantity", "unit", "displayUnit", "unbounded", "initial"]


@versions
def test_a_wrapped_plant_says_what_the_plant_says(tmp_path, fmi):
    """Every attribute of every variable of the inner FMU of FMI 2.0, numbers compared as numbers."""
    system = shaped(tmp_path, 2, "angle")
    plant = system.fmus["plant"].description
    found = described(system, fmi, wrapped_variables(system, fmi), Head("p", "p", "{2}", time=time_of(system)))
    for inner in plant.modelVariables:
        outer = variable(found, str(inner.name))
        assert outer.causality == inner.causality
        if inner.name == "time":
            continue
        for name in ATTRIBUTES:
            assert value_of(outer, name) == value_of(inner, name), (inner.name, name)
        assert (outer.declaredType is None) == (inner.declaredType is None)
        if inner.declaredType is not None and outer.declaredType is not None:
            for name in [*ATTRIBUTES[2:-1], "description"]:
                assert value_of(outer.declaredType, name) == value_of(inner.declaredType, name), (inner.name, name)
            items = [[(item.name, item.value, item.description) for item in type_of(one).items] for one in (inner, outer)]
            assert items[0] == items[1]
    of = variable(found, "der(x)").derivative
    assert of is not None
    assert of.name == "x"
    for name, count in (("rad", 1), ("K", 0)):
        unit = next(one for one in found.unitDefinitions if one.name == name)
        assert len(unit.displayUnits) == count
    assert "degC" not in [unit.name for unit in found.unitDefinitions]  # which no variable has
    warm = [one for one in root_of(system, fmi, wrapped_variables(system, fmi)).iter() if one.get("relativeQuantity") == "true"]
    assert len(warm) == 1


def value_of(thing: object, name: str) -> object:
    value = getattr(thing, name, None)
    try:
        return float(value) if name in ("start", "min", "max", "nominal") else value  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError):
        return value


def test_equal_names_with_other_meanings_get_new_ones(tmp_path):
    """K is twice as large in the second FMU, and its Angle and Gear are others; rad has the display units of both."""
    system = both(tmp_path)
    found = described(system, 3, outer_variables(system, 3, expose=ALL))
    units = {unit.name: unit for unit in found.unitDefinitions}
    factors = [units[name].baseUnit for name in ("K", "K_2")]
    assert [base.factor for base in factors if base is not None] == [1.0, 2.0]
    assert (variable(found, "two.warm").unit, variable(found, "three.m").unit) == ("K", "K_2")
    assert [display.name for display in units["rad"].displayUnits] == ["deg", "rev"]
    types = {name: type_of(variable(found, name)) for name in ("two.gear", "three.gear", "two.angle", "three.u[1]")}
    assert [type_.name for type_ in types.values()] == ["Gear", "Gear_2", "Angle", "Angle_2"]
    assert [item.value for item in types["three.gear"].items] == ["1", "2"]
    assert described(system, 2, outer_variables(system, 2, expose=ALL)) is not None


def test_equal_definitions_are_one(tmp_path):
    system = SystemStructure()
    for name in ("a", "b"):
        system.add(name, rich_fmu(tmp_path, 2))
    system.add("c", bare_fmu(tmp_path / "other.fmu", TWO.replace('modelName="rich"', 'modelName="other"')))
    found = described(system, 2, outer_variables(system, 2))
    assert [type_.name for type_ in found.typeDefinitions] == ["Angle", "Gear", "Count"]
    assert [unit.name for unit in found.unitDefinitions] == ["rad", "K"]


def test_a_type_is_not_called_like_a_variable(tmp_path):
    system = SystemStructure()
    system.add("two", rich_fmu(tmp_path, 2))
    found = described(system, 2, outer_variables(system, 2, rename={"two.on": "Gear"}))
    assert type_of(variable(found, "two.gear")).name == "Gear_2"


def test_outputs_depend_on_inputs_through_the_whole_system(tmp_path):
    """By hand: two.x depends on nothing and feeds three.u[2], on which y depends, and on u[1]."""
    system = both(tmp_path)
    outputs = dict(unknowns(described(system, 2, outer_variables(system, 2)), "outputs"))
    assert outputs["two.count"] == ["two.gear"]
    assert outputs["two.warm"] == ["two.angle"]
    assert outputs["two.x"] == outputs["two.pi"] == []
    assert outputs["three.y[1]"] == ["three.u[1]"]
    assert outputs["three.gear"] == ["three.small"]
    assert outputs["three.long"] == ["three.u[1]", *[f"three.{n}" for n in ("single", "small", "flags[1]", "flags[2]", "none")]]
    three = dict(unknowns(described(system, 3, outer_variables(system, 3, expose=["three.m"])), "outputs"))
    assert three["three.gear"] == ["three.small", "three.m", "time"]


def test_a_long_list_of_everything_is_left_out(tmp_path):
    """Which means the same: 300 variables in turn are inputs, outputs and parameters of an FMU that declares nothing."""
    system = SystemStructure()
    system.add("p", large(tmp_path / "large.fmu", 300))
    found = described(system, 2, outer_variables(system, 2, expose=["p.*"]))
    assert [len(getattr(found, kind)) for kind in ("outputs", "initialUnknowns")] == [100, 100]
    assert all(unknown.dependencies is None for unknown in [*found.outputs, *found.initialUnknowns])


def test_a_chain_is_followed_to_its_beginning(tmp_path):
    """in -> a -> b -> c, where a passes on its input u at once, b declares nothing, and c feeds a's other input w."""
    system = chain(tmp_path)
    outputs = dict(unknowns(described(system, 2, outer_variables(system, 2)), "outputs"))
    assert outputs == {"a.y": ["a.u"], "b.y": ["a.u", "b.w"], "c.y": ["a.u", "b.w"]}
    initial = dict(unknowns(described(system, 2, outer_variables(system, 2, expose=["a.p", "b.p"])), "initialUnknowns"))
    assert initial["a.y"] == ["a.u", "b.w", "a.p", "b.p"]


def chain(folder: Path) -> SystemStructure:
    def made(name: str, outputs: str) -> Path:
        variables = "".join(
            f'<ScalarVariable name="{v}" valueReference="{i}" causality="{causality}" variability="{kind}"><Real{start}/></ScalarVariable>'
            for i, (v, causality, kind, start) in enumerate([
                ("u", "input", "continuous", ' start="0"'), ("w", "input", "continuous", ' start="0"'),
                ("y", "output", "continuous", ""), ("p", "parameter", "fixed", ' start="1"'),
            ])
        )  # fmt: skip
        path = fmi_2(folder / f"{name}.fmu", CO, variables)
        text = read_archive(path.read_bytes(), name)["modelDescription.xml"].decode()
        initial = "<InitialUnknowns><Unknown index='3'/></InitialUnknowns>"
        return bare_fmu(path, text.replace("</ModelStructure>", f"<Outputs>{outputs}</Outputs>{initial}</ModelStructure>"))

    system = SystemStructure()
    system.add("a", made("a", '<Unknown index="3" dependencies="1"/>'))
    system.add("b", made("b", '<Unknown index="3"/>'))
    system.add("c", made("c", '<Unknown index="3" dependencies="1"/>'))
    for source, target in (("a.y", "b.u"), ("b.y", "c.u"), ("c.y", "a.w"), ("c.y", "c.w")):
        system.connect(source, target)
    return system


@versions
def test_capabilities_are_declared(tmp_path, fmi):
    system = both(tmp_path)
    can = Capabilities(True, True, True, False, True, True, 2, False)
    found = element(
        root_of(system, fmi, outer_variables(system, fmi), Head("m", "i", "t", capabilities=can)), "CoSimulation"
    ).attrib
    common = {"modelIdentifier": "i", "canHandleVariableCommunicationStepSize": "false", "maxOutputDerivativeOrder": "2"}
    common |= {"canBeInstantiatedOnlyOncePerProcess": "true", "needsExecutionTool": "false"}
    of_2 = {"canGetAndSetFMUstate", "canSerializeFMUstate", "canInterpolateInputs"}
    of_3 = {"canGetAndSetFMUState", "canSerializeFMUState", "hasEventMode", "mightReturnEarlyFromDoStep"}
    more = dict.fromkeys(of_2 if fmi == 2 else of_3, "true") | ({"canNotUseMemoryManagementFunctions": "false"} if fmi == 2 else {})
    assert dict(found) == common | more


def test_the_time_gets_a_name_that_is_free(tmp_path):
    system = both(tmp_path)
    outer = outer_variables(system, 3, rename={"two.x": "time"})
    found = described(system, 3, outer)
    assert [(v.name, v.valueReference) for v in found.modelVariables if v.causality == "independent"] == [("time_", len(outer) + 1)]


def test_other_names_of_inputs_are_kept_in_fmi_3(tmp_path):
    system = SystemStructure()
    system.add("three", rich_fmu(tmp_path, 3))
    found = described(system, 3, outer_variables(system, 3))
    alias = variable(found, "three.also_u")
    assert alias.alias is not None
    assert (alias.alias.name, alias.description) == ("three.u", "u again")
    assert variable(found, "three.also_y").displayUnit == "rev"


def test_an_inverse_display_unit_is_kept_where_fmi_knows_it(tmp_path):
    text = THREE.replace('<DisplayUnit name="rev" factor="0.15915494309189535"/>', '<DisplayUnit name="rev" inverse="true"/>')
    system = SystemStructure()
    system.add("three", bare_fmu(tmp_path / "inverse.fmu", text))
    displays = root_of(system, 3, outer_variables(system, 3)).findall("UnitDefinitions/Unit/DisplayUnit")
    assert [dict(one.attrib) for one in displays] == [{"name": "rev", "inverse": "true"}]
    found = root_of(system, 2, outer_variables(system, 2))
    assert found.findall("UnitDefinitions/Unit/DisplayUnit") == []
    assert not any(one.get("displayUnit") for one in found.iter())


def test_numbers_that_fmi_2_does_not_have_are_left_out(tmp_path):
    """The type Long begins at -9000000000."""
    system = SystemStructure()
    system.add("three", rich_fmu(tmp_path, 3))
    assert type_of(variable(described(system, 2, outer_variables(system, 2)), "three.long")).min is None
    assert type_of(variable(described(system, 3, outer_variables(system, 3)), "three.long")).min == "-9000000000"


@versions
def test_own_log_categories(tmp_path, fmi):
    system = both(tmp_path)
    head = Head("m", "i", "t", categories=[("inner", "Messages of the FMUs inside.")])
    assert [one.name for one in read_back(DESCRIBE[fmi](system, outer_variables(system, fmi), head)).logCategories] == ["inner"]
