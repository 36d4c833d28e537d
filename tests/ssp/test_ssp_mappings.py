"""Types, arrays and mappings of values on the connections of SSP archives, through FMUs that pass on what they get."""

from __future__ import annotations

from pathlib import Path

import pytest
from ssp_archives import binding, component, connection, linear, ssd, ssv, system, table
from test_connections import SOURCE

from shaper_fmu.archives import write_archive
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import load_components
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.conversion import affine_of, transformed, value_table
from shaper_fmu.ssp.document import LinearTransformation, MappingTransformation
from shaper_fmu.ssp.loaded import SspSystem


@pytest.fixture(scope="module", params=[2, 3], ids=["fmi2", "fmi3"])
def parts(tmp_path_factory, request) -> dict[str, bytes]:
    """Source and Sink of test_connections.py, whose Sink passes on what comes in."""
    folder = tmp_path_factory.mktemp("parts")
    (folder / "parts.py").write_text(SOURCE)
    made = [build_fmu(part, folder, fmi=request.param, platforms=["this"]) for part in load_components(folder / "parts.py")]
    return {f"resources/{path.name}": path.read_bytes() for path in made}


def load(parts: dict[str, bytes], folder: Path, connections: str, *bound: str, version: str = "1.0") -> SspSystem:
    root = system("", component("source", "Source") + component("sink", "Sink", *bound), connections)
    return load_ssp(write_archive(folder / "x.ssp", {**parts, "SystemStructure.ssd": ssd(root, version)}))


def last(loaded: SspSystem, name: str) -> float:
    return float(loaded.simulate(0.2, 0.1)[f"sink.seen_{name}"][-1])


def test_booleans_are_mapped(parts, tmp_path):
    """The source is on from the first step: inverted it is off; where only false is mapped, it stays on."""
    inverted = table("Boolean", true="false", false="true")
    assert last(load(parts, tmp_path, connection("source.on", "sink.on", inverted)), "on") == 0.0
    assert last(load(parts, tmp_path, connection("source.on", "sink.on", table("Boolean", false="true"))), "on") == 1.0
    assert last(load(parts, tmp_path, connection("source.on", "sink.on", table("Boolean", true="false"))), "on") == 0.0


def test_an_integer_may_feed_a_real_linearly(parts, tmp_path):
    assert last(load(parts, tmp_path, connection("source.count", "sink.number", linear(0.5, 1.0))), "number") == 4.5
    assert last(load(parts, tmp_path, connection("source.count", "sink.count")), "count") == 7.0


def test_units_are_converted_before_the_transformation(parts, tmp_path):
    """2000 mm are 2 m, doubled and 0.5 m more; as numbers, 2000 doubled and 0.5."""
    changed = linear(2.0, 0.5)
    assert last(load(parts, tmp_path, connection("source.length", "sink.length", changed)), "length") == pytest.approx(
        4.5, rel=1e-15
    )
    loaded = load(parts, tmp_path, connection("source.length", "sink.length", changed, suppressUnitConversion="true"))
    assert last(loaded, "length") == 4000.5


def test_integers_are_mapped_and_those_that_are_not_named_stay(parts, tmp_path):
    """The source counts 7: a mapping without a gain and an offset that would do the same, of a number without bounds."""
    for entries, expected in (({"of_7": "40", "of_8": "1", "of_9": "3"}, 40.0), ({"of_6": "40", "of_8": "1"}, 7.0)):
        loaded = load(parts, tmp_path, connection("source.count", "sink.count", table("Integer", **entries)))
        assert last(loaded, "count") == expected
        again = load_ssp(loaded.system.to_ssp(tmp_path / "again.ssp", stop_time=1.0, step=0.1))
        assert again.system.mappings == loaded.system.mappings != {}
        assert last(again, "count") == expected


def test_mappings_are_not_for_real_numbers_and_gains_for_no_others(parts, tmp_path):
    with pytest.raises(ModelError, match="an IntegerMappingTransformation, but the source is a real"):
        load(parts, tmp_path, connection("source.length", "sink.length", table("Integer", of_7="8")))
    with pytest.raises(ModelError, match=r"source\.count -> sink\.count: a linear transformation is for real numbers only"):
        load(parts, tmp_path, connection("source.count", "sink.count", linear(2.0)))


def test_arrays_are_connected_and_set_as_a_whole(parts, tmp_path):
    whole = connection("source.lengths", "sink.lengths")
    values = '<ssv:Parameter name="pair"><ssv:Real value="3000 4000" unit="mm"/><ssc:Dimension size="2"/></ssv:Parameter>'
    given = ssv(version="2.0").replace("<ssv:Parameters>", f"<ssv:Parameters>{values}")
    bound = f"<ssd:ParameterBinding><ssd:ParameterValues>{given}</ssd:ParameterValues></ssd:ParameterBinding>"
    if load(parts, tmp_path, "").system.fmus["sink"].version == 2:
        with pytest.raises(
            ModelError, match=r"connection to source\.lengths: source has no connector 'lengths'\. Did you mean 'length"
        ):
            load(parts, tmp_path, whole)
        return
    loaded = load(parts, tmp_path, whole, bound, version="2.0")
    assert [last(loaded, f"lengths[{i}]") for i in (1, 2, 3)] == [2.0, 3.0, 4.0]
    assert [loaded.system.start_values["sink"][f"pair[{i}]"] for i in (1, 2)] == [3.0, 4.0]
    with pytest.raises(ModelError, match=r"sink\.pair has 2 elements but is given 3 values"):
        load(parts, tmp_path, "", bound.replace("4000", "4000 5"), version="2.0")


def test_single_elements_of_arrays_are_not_guessed_at(parts, tmp_path):
    with pytest.raises(ModelError, match="connections of single elements of arrays are not read"):
        load(parts, tmp_path, connection("source.length", "sink.length", startIndices="1"), version="2.0")


def test_a_value_of_another_type_is_refused(parts, tmp_path):
    with pytest.raises(ModelError, match=r"parameter count -> sink\.count: a real cannot become an integer"):
        load(parts, tmp_path, "", binding("count Real 2.5"))


# The functions behind.


def test_a_mapping_over_few_values_may_be_a_gain_and_an_offset():
    assert affine_of([1, 2, 3], [10, 20, 30]) == (10.0, 0.0)
    assert affine_of([0, 1], [1, 0]) == (-1.0, 1.0)
    assert affine_of([4, 9], [4, 9]) == (1.0, 0.0)
    assert affine_of([1, 2, 3], [1, 2, 4]) is None
    items = {"low": 1, "high": 2}
    by_name = MappingTransformation("Enumeration", [("low", "high"), ("high", "low")])
    assert value_table(by_name, [1, 2], items, items) == [2, 1]
    with pytest.raises(ModelError, match="the enumeration has no item 'hihg'"):
        value_table(MappingTransformation("Enumeration", [("hihg", "low")]), [1], items, items)


@pytest.mark.parametrize(
    ("transformation", "value", "found"),
    [
        (None, "text", "text"),
        (LinearTransformation(2.0, 1.0), 3, 7.0),
        (MappingTransformation("Boolean", [("true", "false")]), True, False),
        (MappingTransformation("Boolean", [("true", "false")]), False, False),
        (MappingTransformation("Integer", [("3", "5")]), 3, 5),
        (MappingTransformation("Integer", [("3", "5")]), 4, 4),
        (MappingTransformation("Integer", [("2", "1")]), "high", 1),
        (MappingTransformation("Enumeration", [("low", "off")]), "low", "off"),
        (MappingTransformation("Enumeration", [("low", "off")]), 1, "off"),
        (MappingTransformation("Enumeration", [("low", "off")]), "high", "high"),
    ],
)
def test_parameters_are_transformed(transformation, value, found):
    """The standard: values that a table does not name stay unchanged; items have numbers and names."""
    assert transformed(transformation, value, {"low": 1, "high": 2}) == found


def test_only_numbers_are_transformed_linearly():
    with pytest.raises(ModelError, match="'low' is not a number"):
        transformed(LinearTransformation(2.0), "low")


@pytest.mark.parametrize(("given", "expected"), [(True, 0.0), (False, 1.0)])
def test_a_systems_own_boolean_is_mapped_on_its_way_inside(parts, tmp_path, given, expected):
    """Inverted, both where it is a start value and where it is driven."""
    interface = '<ssd:Connectors><ssd:Connector name="off" kind="input"><ssc:Boolean/></ssd:Connector></ssd:Connectors>'
    inverted = connection("off", "sink.on", table("Boolean", true="false", false="true"))
    root = system(interface, component("source", "Source") + component("sink", "Sink"), inverted)
    path = write_archive(tmp_path / "x.ssp", {**parts, "SystemStructure.ssd": ssd(root)})
    started, driven = load_ssp(path), load_ssp(path)
    started.set("off", given)
    driven.drive("off", given)
    assert (last(started, "on"), last(driven, "on")) == (expected, expected)
