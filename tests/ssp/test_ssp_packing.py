"""The variables of an archive's container: the system's own connectors, their units and what happens on the way inside."""

from __future__ import annotations

from pathlib import Path

import pytest
from bare_fmus import CO, fmi_2
from rich_fmus import rich_fmu
from ssp_archives import binding, component, connection, linear, ssd, system, table

from shaper_fmu.archives import write_archive
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.errors import ModelError
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.loaded import SspSystem
from shaper_fmu.ssp.packing import connector_variables, connectors_not_shown

PLANT = """<ScalarVariable name="force" valueReference="0" causality="input" description="pushes"><Real unit="N" min="-10" max="20" start="3"/></ScalarVariable>
<ScalarVariable name="mass" valueReference="1" causality="parameter" variability="tunable"><Real unit="kg" start="2" nominal="4"/></ScalarVariable>
<ScalarVariable name="on" valueReference="2" causality="input" variability="discrete"><Boolean start="true"/></ScalarVariable>
<ScalarVariable name="x" valueReference="3" causality="output" initial="exact"><Real unit="m" min="-1" max="2" nominal="0.5" start="0.25"/></ScalarVariable>
<ScalarVariable name="count" valueReference="4" causality="output" variability="discrete"><Integer/></ScalarVariable>
<ScalarVariable name="mode" valueReference="5" causality="input" variability="discrete"><Integer start="7"/></ScalarVariable>"""
UNITS = (
    '<UnitDefinitions><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit><Unit name="m"><BaseUnit m="1"/></Unit>'
    '<Unit name="kg"><BaseUnit kg="1"/></Unit></UnitDefinitions>'
)


def connectors(**kinds: str) -> str:
    """Connectors "kind type unit", of the keyword's name."""
    lines = []
    for name, text in kinds.items():
        kind, type_, *unit = text.split(" ")
        typed = f"<ssc:{type_}{''.join(f' unit={chr(34)}{one}{chr(34)}' for one in unit)}/>" if type_ != "-" else ""
        lines.append(f'<ssd:Connector name="{name}" kind="{kind}">{typed}</ssd:Connector>')
    return f"<ssd:Connectors>{''.join(lines)}</ssd:Connectors>"


def load(folder: Path, interface: str, connections: str, *bound: str, elements: str = "") -> SspSystem:
    plant = fmi_2(folder / "plant.fmu", CO + UNITS, PLANT).read_bytes()
    content = {"resources/plant.fmu": plant, "resources/rich.fmu": rich_fmu(folder, 3).read_bytes()}
    elements = elements or component("a", "plant", *bound) + component("b", "plant")
    description = ssd(system(interface, elements, connections), "2.0")
    return load_ssp(write_archive(folder / "x.ssp", {**content, "SystemStructure.ssd": description}))


def by_name(found: list[OuterVariable]) -> dict[str, OuterVariable]:
    return {variable.name: variable for variable in found}


def test_connectors_have_their_own_units_and_bounds(tmp_path):
    """1 kN is 1000 N and 1 m 1000 mm: 3 N are 0.003 kN, and the bounds and the nominal value follow."""
    interface = connectors(push="input Real kN", mass="parameter Real g", position="output Real mm")
    wires = connection("push", "a.force") + connection("mass", "a.mass") + connection("a.x", "position")
    loaded = load(tmp_path, interface, wires, binding("mass Real 5 kg"))
    found = by_name(connector_variables(loaded, 2))
    assert list(found) == ["push", "mass", "position"]
    push, mass, position = found.values()
    assert (push.causality, push.type, push.elements[0][0].gain) == ("input", "Real", 1000.0)
    assert push.unit is not None
    assert push.unit.baseUnit is not None
    assert (push.unit.name, push.unit.baseUnit.factor, push.shown.description) == ("kN", 1000.0, "pushes")
    assert (float(str(push.shown.min)), float(str(push.shown.max)), push.starts) == (-0.01, 0.02, (0.003,))
    assert (mass.causality, mass.variability, mass.elements[0][0].gain) == ("parameter", "tunable", 0.001)
    assert mass.starts[0] == pytest.approx(5000.0, rel=1e-15)
    assert float(str(mass.shown.nominal)) == 4000.0
    assert (position.causality, position.elements[0][0].gain, position.starts) == ("output", 1000.0, (250.0,))
    assert (float(str(position.shown.min)), float(str(position.shown.max)), float(str(position.shown.nominal))) == (
        -1000.0,
        2000.0,
        500.0,
    )


def test_a_transformation_turns_bounds_round(tmp_path):
    """force = -2 push + 4 N: from -10 N to 20 N it is from -8 to 7, and 3 N is 0.5."""
    loaded = load(tmp_path, connectors(push="input Real N"), connection("push", "a.force", linear(-2.0, 4.0)))
    push = connector_variables(loaded, 3)[0]
    assert (push.elements[0][0].gain, push.elements[0][0].offset, push.starts) == (-2.0, 4.0, (0.5,))
    assert (float(str(push.shown.min)), float(str(push.shown.max))) == (-8.0, 7.0)


def test_one_connector_feeds_several_inputs_each_in_its_way(tmp_path):
    wires = connection("push", "a.force") + connection("push", "b.force", linear(0.5))
    push = connector_variables(load(tmp_path, connectors(push="input Real N"), wires), 2)[0]
    assert [(target.port, target.gain) for target in push.elements[0]] == [(("a", "force"), 1.0), (("b", "force"), 0.5)]


def test_booleans_and_integers_are_mapped(tmp_path):
    interface = connectors(off="input Boolean", mode="input Integer", other="input Boolean")
    wires = connection("off", "a.on", table("Boolean", true="false", false="true"))
    wires += connection("mode", "a.mode", table("Integer", of_1="7")) + connection("other", "b.on", table("Boolean", true="false"))
    found = by_name(connector_variables(load(tmp_path, interface, wires), 2))
    assert found["off"].elements[0][0].mapping == ((0, 1), (1, 0))
    assert found["off"].starts == (False,)
    assert (found["mode"].elements[0][0].mapping, found["mode"].starts) == (((1, 7),), (1,))
    assert found["other"].elements[0][0].mapping == ((1, 0),)


def test_an_untyped_boolean_connector_is_mapped(tmp_path):
    wires = connection("off", "a.on", table("Boolean", true="false", false="true"))
    assert connector_variables(load(tmp_path, connectors(off="input -"), wires), 2)[0].elements[0][0].mapping == ((0, 1), (1, 0))


def test_an_integer_comes_out_as_the_real_number_that_the_connector_declares(tmp_path):
    loaded = load(
        tmp_path, connectors(n="output Real", m="output Integer"), connection("a.count", "n") + connection("b.count", "m")
    )
    assert [variable.type for variable in connector_variables(loaded, 2)] == ["Real", "Integer"]
    assert [variable.type for variable in connector_variables(loaded, 3)] == ["Float64", "Int32"]


def test_an_array_stays_one_in_fmi_3(tmp_path):
    interface = connectors(angles="input -", out="output -")
    loaded = load(tmp_path, interface, connection("angles", "r.u") + connection("r.y", "out"), elements=component("r", "rich"))
    three, two = by_name(connector_variables(loaded, 3)), by_name(connector_variables(loaded, 2))
    assert list(three) == ["angles", "out"]
    assert (three["angles"].dimensions, three["angles"].starts, three["out"].dimensions) == ((2,), (1.0, 2.0), (2,))
    assert list(two) == ["angles[1]", "angles[2]", "out[1]", "out[2]"]
    assert two["angles[2]"].starts == (2.0,)


def test_without_connectors_of_its_own_a_system_shows_what_is_free(tmp_path):
    loaded = load(tmp_path, "", connection("a.x", "b.force", suppressUnitConversion="true"))
    found = [variable.name for variable in connector_variables(loaded, 2)]
    assert found == ["a.force", "a.on", "a.mode", "b.on", "b.mode", "a.x", "a.count", "b.x", "b.count"]
    assert connectors_not_shown(loaded, 2) == []


def test_more_is_shown_on_demand(tmp_path):
    loaded = load(tmp_path, connectors(push="input Real N"), connection("push", "a.force"))
    found = connector_variables(loaded, 2, expose=["b.force", "a.force", "a.mass"], rename={"push": "f"})
    assert [variable.name for variable in found] == ["f", "b.force", "a.mass"]


def test_what_leads_nowhere_is_told_and_what_cannot_be_is_refused(tmp_path):
    interface = connectors(push="input Real N", unused="input Real", heavy="input Real kg")
    loaded = load(tmp_path, interface, connection("push", "a.force"))
    assert [text.split()[0] for text in connectors_not_shown(loaded, 2)] == ["unused", "heavy"]
    loaded = load(tmp_path, interface, connection("heavy", "a.mass"))
    with pytest.raises(ModelError, match=r"the system's input heavy feeds a.mass, which is of causality parameter"):
        connector_variables(loaded, 2)
