"""FMI 3.0: sizes that follow structural parameters, arrays with fewer start values than elements; numbers that are no item of an enumeration.

The FMU is fmus/sized3.c: product[i] = factor[i] * input[i], total = their sum, for the elements that there are.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from faulty_fmus import library

from shaper_fmu import Simulation, System
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.algorithms import ALGORITHMS
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.fmu import fmu_problems, load_fmu
from shaper_fmu.metrics.final import Final
from shaper_fmu.ssp.archive import load_ssp

ITEMS = '<EnumerationType name="Mode"><Item name="slow" value="1"/><Item name="fast" value="2"/><Item name="park" value="7"/></EnumerationType>'
DESCRIPTION = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="sized" instantiationToken="x"><CoSimulation modelIdentifier="sized"
canHandleVariableCommunicationStepSize="true"/><TypeDefinitions>{ITEMS}</TypeDefinitions><ModelVariables>
<UInt64 name="size" valueReference="0" causality="structuralParameter" variability="fixed" start="3"/>
<Float64 name="input" valueReference="1" causality="input" start="0"><Dimension valueReference="0"/></Float64>
<Float64 name="factor" valueReference="2" causality="parameter" variability="fixed" start="10 11 7"><Dimension valueReference="0"/></Float64>
<Float64 name="product" valueReference="3" causality="output"><Dimension valueReference="0"/></Float64>
<Float64 name="total" valueReference="4" causality="output"/>
<Enumeration name="mode" declaredType="Mode" valueReference="5" causality="input" start="2"/>
<Enumeration name="mode_out" declaredType="Mode" valueReference="6" causality="output"/>
<Float64 name="time" valueReference="9" causality="independent"/></ModelVariables><ModelStructure>
<Output valueReference="3"/><Output valueReference="4"/><Output valueReference="6"/>
<InitialUnknown valueReference="3"/><InitialUnknown valueReference="4"/><InitialUnknown valueReference="6"/>
</ModelStructure></fmiModelDescription>"""


def packed(path: Path, text: str = DESCRIPTION) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(library("sized3"), f"binaries/{fmpy.platform_tuple}/sized{fmpy.sharedLibraryExtension}")
    return path


@pytest.fixture
def sized(tmp_path) -> Path:
    return packed(tmp_path / "sized.fmu")


def last(system: System, **options) -> dict[str, float]:
    return {name.removeprefix("x."): values[-1] for name, values in system.simulate(0.2, 0.1, **options).values.items()}


def test_the_description_has_no_findings(sized):
    assert fmu_problems(sized) == []


@pytest.mark.representatives(size=[1, 40])
@pytest.mark.parametrize("size", [1, 2, 3, 5, 40])
def test_arrays_have_the_size_that_is_set(size, sized):
    factor, input_ = [2.0 + i for i in range(size)], [0.5 * i for i in range(size)]
    products = [a * b for a, b in zip(factor, input_, strict=True)]
    expected = {**{f"product[{i + 1}]": p for i, p in enumerate(products)}, "total": sum(products), "mode_out": 2.0}
    system = System()
    system.add("x", sized, size=size, factor=factor, input=input_)
    assert last(system) == expected
    assert system.simulate(0.2, 0.1, isolate=True)["x.total"][-1] == expected["total"]
    with Simulation(system) as simulation:  # a reset takes the size back, so that it is set again
        for _ in range(3):
            assert simulation.run(0.2, 0.1)["x.total"][-1] == expected["total"]


def test_two_instances_of_one_fmu_may_differ(sized):
    system = System()
    system.add("one", sized, size=2, factor=[1.0, 2.0])
    system.add("other", sized, size=2, factor=[1.0, 1.0])
    system.add("third", sized)
    for i in (1, 2):
        system.drive(f"one.input[{i}]", 3.0)
    system.connect("one.product", "other.input")
    found = system.simulate(0.2, 0.1)
    assert (found["other.total"][-1], found["third.total"][-1]) == (9.0, 0.0)
    with pytest.raises(ModelError, match=r"one.product has 2 elements but third.input has 3"):
        system.connect("one.product", "third.input")


def test_the_size_can_be_set_later_as_long_as_nothing_is_lost(sized):
    system = System()
    system.add("x", sized)
    system.set("x.size", 2)
    system.set("x.factor", [4.0, 5.0])
    system.drive("x.input[2]", 1.0)
    assert last(system) == {"product[1]": 0.0, "product[2]": 5.0, "total": 5.0, "mode_out": 2.0}
    with pytest.raises(ModelError, match=r"x\.size: x\.input\[2\], which is in use, would not exist"):
        system.set("x.size", 1)
    assert last(system)["total"] == 5.0


@pytest.mark.parametrize(
    ("size", "words"),
    [(-1, "size = -1 is not of type UInt64"), (2.5, "is not of type UInt64"), ("many", "not of type UInt64"),
     (10**12, "input would have 1000000000000 elements, more than 1000000"), (2**64, "not of type UInt64")],
)  # fmt: skip
def test_what_is_no_size_is_refused_in_words(size, words, sized):
    with pytest.raises(ModelError, match=words):
        System().add("x", sized, size=size)


def test_what_cannot_be_done_with_sizes_is_told(sized):
    system = System()
    system.add("x", sized, size=2, factor=[1.0, 2.0])
    with pytest.raises(ModelError, match=r"size is a structural parameter, which sizes of arrays follow: give it to System\.add"):
        Simulation(system).run(0.2, 0.1, start_values={"x.size": 3})
    with pytest.raises(ModelError, match=r"structural parameters, which a reset takes back, need Simulation\.run"):
        Batch(system, Plan(stop_time=0.2, step=0.1), {"last": Final("x.total")}, [])
    with pytest.raises(ModelError, match=r"sized\.fmu has no input or parameter 'factor\[3\]'"):
        system.set("x.factor[3]", 1.0)
    system = System()
    system.add("x", sized, {"size": 4, "factor[1]": 1.0})  # the told start values are those of another size
    with pytest.raises(ModelError, match=r"factor\[2\] has no start value, so give it one"):
        system.simulate(0.2, 0.1)


@pytest.mark.parametrize(
    ("starts", "given", "expected"),
    [("10 11", {"factor": [1.0, 2.0, 3.0]}, 6.0), ("10 11", {}, 28.0), ("5", {"factor[2]": 1.0}, 11.0), ("1 2 3 4", {}, 28.0)],
)
def test_arrays_may_have_other_than_as_many_start_values(starts, given, expected, tmp_path):
    """One counts for all; too few or too many are a finding. What is not set has the FMU's own value: 10, 11 and 7."""
    path = packed(tmp_path / "few.fmu", DESCRIPTION.replace('"10 11 7"', f'"{starts}"'))
    system = System()
    system.add("x", path, {**given, "input": [1.0, 1.0, 1.0]})
    assert last(system)["total"] == expected
    several = len(starts.split())
    told = [] if several == 1 else [f"array 'factor' (line 6) has 3 elements but {several} start values"]
    assert fmu_problems(path) == told


def test_an_element_alone_of_which_the_others_are_not_known_is_told(tmp_path):
    path = packed(tmp_path / "few.fmu", DESCRIPTION.replace('"10 11 7"', '"10 11"'))
    system = System()
    system.add("x", path, {"factor[1]": 1.0})
    with pytest.raises(ModelError, match=r"factor\[3\] has no start value, so give it one"):
        system.simulate(0.2, 0.1)


def test_arrays_of_no_elements_are_left_out(tmp_path):
    path = packed(
        tmp_path / "none.fmu", DESCRIPTION.replace('fixed" start="3"', 'fixed" start="0"').replace(' start="10 11 7"', "")
    )
    assert [name for name in load_fmu(path).variables if "[" in name] == []


def test_sizes_go_into_archives_and_out_of_them(sized, tmp_path):
    system = System("s")
    system.add("x", sized, size=4, factor=[1.0, 2.0, 3.0, 4.0], input=[1.0, 1.0, 1.0, 1.0])
    loaded = load_ssp(system.to_ssp(tmp_path / "s.ssp", stop_time=1.0, step=0.1))
    assert loaded.system.fmus["x"].structure == {"size": 4}
    assert loaded.simulate(0.2, 0.1)["x.total"][-1] == 10.0
    plain = System("s")
    plain.add("x", sized)
    loaded = load_ssp(plain.to_ssp(tmp_path / "plain.ssp", stop_time=1.0, step=0.1))
    loaded.set("x.size", 2)
    assert list(loaded.simulate(0.2, 0.1).values) == ["x.product[1]", "x.product[2]", "x.total", "x.mode_out"]


# Enumerations

WRONG = r"mode = .*3.* is not an item of the enumeration: slow \(1\), fast \(2\), park \(7\)"


@pytest.mark.parametrize("value", [3, 3.0, "3", 0, -1])
def test_numbers_that_are_no_item_are_refused(value, sized):
    words = WRONG.replace("3", str(int(float(value))))
    system = System()
    with pytest.raises(ModelError, match=words):
        system.add("x", sized, mode=value)
    system.add("x", sized)
    with pytest.raises(ModelError, match=words):
        system.set("x.mode", value)
    with pytest.raises(ModelError, match=words):
        system.drive("x.mode", float(value))
    with pytest.raises(ModelError, match=words):
        system.drive("x.mode", [(0.0, 1), (0.1, float(value))])
    with pytest.raises(ModelError, match=words):
        Simulation(system).run(0.2, 0.1, start_values={"x.mode": value})
    for good, number in ((7, 7.0), ("park", 7.0), ("1", 1.0)):
        system.set("x.mode", good)
        assert last(system)["mode_out"] == number


def test_connections_of_enumerations_bring_items_alone(sized, tmp_path):
    other = packed(tmp_path / "other.fmu", DESCRIPTION.replace('value="7"', 'value="3"'))
    system = System()
    system.add("x", sized)
    system.add("y", other, mode="park")
    words = r"y\.mode_out -> x\.mode: 3 is not an item of the enumeration: slow \(1\), fast \(2\), park \(7\); a mapping of values is needed"
    with pytest.raises(ModelError, match=words):
        system.connect("y.mode_out", "x.mode")
    with pytest.raises(ModelError, match=words):
        system.connect_raw("y.mode_out", "x.mode")
    with pytest.raises(ModelError, match=r"x\.mode: 5 is not an item"):
        system.connect_raw("y.mode_out", "x.mode", mapping={3: 5})
    system.connect_raw("y.mode_out", "x.mode", mapping={3: 7})
    assert last(system)["mode_out"] == 7.0


def test_a_start_value_of_the_fmu_that_is_no_item_is_its_own_affair(tmp_path):
    path = packed(tmp_path / "odd.fmu", DESCRIPTION.replace('causality="input" start="2"', 'causality="input" start="0"'))
    system = System()
    system.add("x", path)
    assert last(system)["mode_out"] == 2.0
    assert fmu_problems(path) == ["the start value 0 of 'mode' (line 9) is not an item of its enumeration"]


MODES = DESCRIPTION[DESCRIPTION.index("<Enumeration name") : DESCRIPTION.index('<Float64 name="time"')]
INTEGERS = MODES.replace("Enumeration", "Int64").replace('declaredType="Mode" ', "")
NO_ITEM = r": the value for input mode is {}, from y\.mode_out, which is not an item of the enumeration: slow \(1\), fast \(2\), park \(7\)"


def fed_by_an_integer(path: Path, sized: Path, bounds: str = "", mapping: dict[int, int] | None = None) -> System:
    """x.mode is an enumeration, y.mode_out an integer and what y.mode is."""
    system = System()
    system.add("x", sized)
    system.add("y", packed(path, DESCRIPTION.replace(MODES, INTEGERS.replace('"output"', f'"output"{bounds}'))))
    system.connect_raw("y.mode_out", "x.mode", mapping=mapping)
    return system


def test_an_integer_that_feeds_an_enumeration_is_known_by_its_bounds(sized, tmp_path):
    for bounds in ("", ' min="1" max="2"'):
        system = fed_by_an_integer(tmp_path / f"{len(bounds)}.fmu", sized, bounds)
        assert [note for note in system.simulate(0.2, 0.1).notes if "enumeration" in note] == []
        assert last(system)["mode_out"] == 2.0
    with pytest.raises(ModelError, match=r"y\.mode_out -> x\.mode: 3 is not an item of the enumeration"):
        fed_by_an_integer(tmp_path / "y.fmu", sized, ' min="1" max="3"')


@pytest.mark.representatives(algorithm=["jacobi"])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize(("mapping", "wrong"), [(None, 3), ({3: 7, 4: 1}, 5), (None, -1), (None, 2**40)])
def test_a_number_that_is_no_item_ends_the_run(algorithm, mapping, wrong, sized, tmp_path):
    """It comes out of y at t = 0.3 s; until then all are items, the mapping's among them."""
    system = fed_by_an_integer(tmp_path / "y.fmu", sized, mapping=mapping)
    first = [3, 4, 2] if mapping else [7, 1, 2]
    system.drive("y.mode", (np.arange(4) * 0.1, np.array([*first, wrong], float)))
    options = {"algorithm": algorithm, "record": ["x.mode_out", "y.mode_out"]}
    found = system.simulate(0.2, 0.1, **options)
    assert set(found["x.mode_out"]) <= {1.0, 2.0, 7.0}
    for more in ({}, {"isolate": True}):
        with pytest.raises(SimulationError, match=r"x at t = 0\.[34]\d* s" + NO_ITEM.format(wrong)):
            system.simulate(0.5, 0.1, **options, **more)


def test_a_number_that_is_no_item_at_initialization_ends_the_run_of_a_batch_too(sized, tmp_path):
    system = fed_by_an_integer(tmp_path / "y.fmu", sized)
    with pytest.raises(SimulationError, match=r"x at initialization" + NO_ITEM.format(3)):
        Simulation(system).run(0.2, 0.1, start_values={"y.mode": 3})
    with Batch(system, Plan(0.2, 0.1), {"end": Final("x.mode_out")}, ["y.mode"]) as batch:
        assert batch.run({"y.mode": 7.0}) == {"end": 7.0}
        with pytest.raises(SimulationError, match=NO_ITEM.format(3)):
            batch.run({"y.mode": 3.0})


def test_an_enumeration_that_breaks_its_own_items_ends_the_run(sized):
    """y's own start value is not an item either: what it is told is not what it does."""
    system = System()
    for name in ("x", "y"):
        system.add(name, sized)
    system.connect("y.mode_out", "x.mode")
    system.start_values["y"]["mode"] = 3  # no public way leads here: it stands for an FMU with a fault
    with pytest.raises(SimulationError, match=NO_ITEM.format(3)):
        system.simulate(0.2, 0.1)
