"""Every component as an FMU file: valid, documented, reproducible, and honest about its dependencies."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import pytest
from conftest import GAIN, gain_component
from fmpy.validation import validate_fmu
from lxml import etree

from shaper_fmu.errors import BuildError
from shaper_fmu.export.model_description import dependencies
from shaper_fmu.export.pythonfmu_backend import build_fmu
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.registry import components, load_components

every_component = pytest.mark.parametrize("name", components())


@every_component
def test_validators_have_no_findings(name, python_fmus):
    assert validate_fmu(str(python_fmus / f"{name}.fmu")) == []
    schema = etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"))
    with zipfile.ZipFile(python_fmus / f"{name}.fmu") as archive:
        schema.assertValid(etree.fromstring(archive.read("modelDescription.xml")))


@every_component
def test_the_description_says_everything_that_is_declared(name, python_fmus):
    fmu = load_fmu(python_fmus / f"{name}.fmu")
    declared = [v for v in components()[name].variables.values() if v.causality != "state"]
    assert list(fmu.variables) == [label for v in declared for label in v.scalar_names]
    for variable in declared:
        for label, start in zip(variable.scalar_names, variable.starts, strict=True):
            found = fmu.variables[label]
            assert variable.description
            assert str(found.description).startswith(variable.description)
            assert (found.unit or "") == variable.unit
            assert (found.displayUnit or "") == variable.display_unit
            if variable.causality in ("parameter", "input"):
                assert float({"true": "1", "false": "0"}.get(str(found.start), str(found.start))) == float(start)
            else:
                assert found.start is None
            for bound in ("min", "max"):
                expected = variable.published_bounds.get(bound)
                assert (getattr(found, bound) is None) == (expected is None)
                assert expected is None or float(str(getattr(found, bound))) == expected


@every_component
def test_units_are_defined_by_base_units(name, python_fmus):
    fmu = load_fmu(python_fmus / f"{name}.fmu")
    used = {v.unit for v in fmu.variables.values() if v.unit}
    assert used == {unit.name for unit in fmu.description.unitDefinitions}
    assert all(unit.baseUnit is not None for unit in fmu.description.unitDefinitions)


@every_component
def test_model_structure_lists_outputs_and_initial_unknowns(name, python_fmus):
    description = load_fmu(python_fmus / f"{name}.fmu").description
    outputs = [v.name for v in description.modelVariables if v.causality == "output"]
    calculated = [v.name for v in description.modelVariables if v.causality in ("output", "calculatedParameter")]
    assert [u.variable.name for u in description.outputs if u.variable] == outputs
    assert sorted(u.variable.name for u in description.initialUnknowns if u.variable) == sorted(calculated)


@every_component
def test_declared_dependencies_are_true(name):
    """An input that is changed at one instant changes exactly the outputs that name it, by a step of length zero."""
    component = components()[name]
    for source in [v for v in component.variables.values() if v.causality == "input"]:
        values = []
        for change in (0.0, 0.125):
            instance = component()
            instance.initialize(0.0)
            value = source.starts[0] + change if source.kind is float else source.kind(change)
            setattr(instance, source.name, value if source.size is None else [value] * source.size)
            instance.do_step(0.0, 0.0)
            values.append({v.name: getattr(instance, v.name) for v in component.variables.values() if v.causality == "output"})
        for output in values[0]:
            changed = values[0][output] != values[1][output]
            declared = source.name in dependencies(component, component.variables[output])
            assert changed <= declared, f"{output} depends on {source.name} but does not say so"


@every_component
def test_builds_are_the_same_to_the_byte(name, python_fmus, tmp_path):
    again = build_fmu(components()[name], tmp_path)
    assert again.read_bytes() == (python_fmus / f"{name}.fmu").read_bytes()


@every_component
def test_python_files_are_packed_under_hashed_names(name, python_fmus):
    with zipfile.ZipFile(python_fmus / f"{name}.fmu") as archive:
        names = [n.split("/")[1] for n in archive.namelist() if n.startswith("resources/")]
        entry = archive.read("resources/slavemodule.txt").decode()
    roots = {n for n in names if "." not in n}
    assert len(roots) == 1
    digest = roots.pop().removeprefix("shaper_fmu_")
    assert len(digest) == 16
    assert entry == f"entry_{digest}"
    assert set(names) == {f"shaper_fmu_{digest}", f"entry_{digest}.py", "slavemodule.txt"}


@every_component
def test_the_documentation_page_names_every_variable(name, python_fmus):
    with zipfile.ZipFile(python_fmus / f"{name}.fmu") as archive:
        page = etree.HTML(archive.read("documentation/index.html").decode())
        assert {"documentation/licenses/shaper-fmu.txt", "documentation/licenses/pythonfmu.txt"} <= set(archive.namelist())
    shown = [str(element.text) for element in page.findall(".//table//tr/td[1]/code")]
    assert sorted(shown) == sorted(v.name for v in components()[name].variables.values() if v.causality != "state")


def test_the_guid_comes_from_the_content(tmp_path):
    one = load_fmu(build_fmu(gain_component(tmp_path / "a", 2.0), tmp_path / "a"))
    other = load_fmu(build_fmu(gain_component(tmp_path / "b", 3.0), tmp_path / "b"))
    assert one.description.guid != other.description.guid


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("import numpy", "line 3: an FMU carries no 'numpy'"),
        ("import shaper_fmu.units", r"line 3: write 'from shaper_fmu.units import ...'"),
        ("from shaper_fmu.analysis.identification import identify", "line 3: import from the module that defines the name"),
    ],
)
def test_what_an_fmu_cannot_carry_is_named_and_nothing_is_written(line, words, tmp_path):
    source = f'''"""A component that imports too much."""

{line}
from shaper_fmu.component import Component


class Heavy(Component):
    """Imports too much."""

    def step(self, t, h):
        pass
'''
    (tmp_path / "heavy.py").write_text(source)
    component = load_components(tmp_path / "heavy.py")[0]
    with pytest.raises(BuildError, match=words):
        build_fmu(component, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_build_leaves_no_draft_behind(tmp_path):
    path = build_fmu(components()["MotionProfile"], tmp_path)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("self.result =", "self.reslt =", "sets 'reslt', which is not declared. Did you mean 'result'"),
        ("Parameter(1.0,", "Parameter(math.nan,", "the start value of factor is nan; it must be a finite number"),
        ("def step(self, t, h)", "def step(self, t)", "does not run with its start values"),
        ("class Gain", "class Gäin", "must be an ASCII identifier"),
    ],
)
def test_a_component_that_could_not_run_is_not_built(tmp_path, old, new, words):
    source = GAIN.format(factor=2.0).replace("from shaper_fmu", "import math\n\nfrom shaper_fmu", 1)
    assert old in source
    (tmp_path / "gain.py").write_text(source.replace(old, new))
    with pytest.raises(BuildError, match=words):
        build_fmu(load_components(tmp_path / "gain.py")[0], tmp_path / "out")
    assert not (tmp_path / "out").exists()
