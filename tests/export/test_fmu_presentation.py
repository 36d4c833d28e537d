"""What an importer shows of an FMU: icon, terminals, descriptions of items, author, version, copyright and date."""

from __future__ import annotations

import enum
import io
import re
import zipfile
from pathlib import Path

import fmpy
import matplotlib.image
import numpy as np
import pytest
from description_cases import TOKEN, both_versions, every_component
from lxml import etree

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.component import Component, Input, Output, Parameter
from shaper_fmu.errors import BuildError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.export.declarations import check_declaration
from shaper_fmu.export.docstrings import item_descriptions
from shaper_fmu.export.model_description import fmi2_native_description, fmi3_native_description
from shaper_fmu.export.terminals_and_icons import icon_and_terminals
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.registry import components
from shaper_fmu.shapers.zero_derivative import ZV
from shaper_fmu.version import __version__

TERMINALS = Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"
DESCRIBED = {"2": fmi2_native_description, "3": fmi3_native_description}


class Mode(enum.IntEnum):
    """How it works.

    - slow: takes its time;
    - `fast`: hurries,
      at any price.
    """

    slow = 1
    fast = 2
    other = 3


class Told(Component):
    """A component of somebody else."""

    about = {"author": "A. Maker", "copyright": "none"}
    terminals = {"plant": {"force": "push", "position": "place"}}

    push = Input("N", "force")
    mode = Parameter(Mode.slow, "", "mode")
    place = Output("m", "position")

    def step(self, t, h):
        self.place += h * self.push


def description(component: type[Component], version: str, token: str = TOKEN) -> etree._Element:
    return etree.fromstring(DESCRIBED[version](component, token, "a tool"))


def colours(png: bytes) -> int:
    """How many colours a picture of 200 by 200 points has."""
    picture = matplotlib.image.imread(io.BytesIO(png), format="png")
    assert picture.shape == (200, 200, 4)
    return len(np.unique(picture.reshape(-1, 4), axis=0))


@both_versions
def test_items_are_described_by_the_docstring_that_lists_them(version):
    found = {item.get("name"): item.get("description") for item in description(Told, version).iter("Item")}
    assert found == {"slow": "takes its time", "fast": "hurries, at any price", "other": None}


@both_versions
def test_methods_are_described_by_their_records(version):
    found = {item.get("name"): item.get("description") for item in description(InputShaper, version).iter("Item")}
    assert found["zv"] == ZV.described
    assert None not in found.values()
    assert item_descriptions(Shaper) == {}  # they are in the component's docstring


@both_versions
def test_ours_tell_version_and_copyright_and_others_what_they_say(version):
    ours, other = description(InputShaper, version), description(Told, version)
    assert (ours.get("author"), ours.get("version"), ours.get("license")) == ("shaper-fmu", __version__, "BSD-2-Clause")
    licence = (Path(__file__).parents[2] / "LICENSE").read_text()
    assert str(ours.get("copyright")) in licence
    assert (other.get("author"), other.get("copyright"), other.get("version"), other.get("license")) == (
        "A. Maker",
        "none",
        None,
        None,
    )


@both_versions
def test_the_date_is_that_of_the_environment_and_none_otherwise(version, monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert description(Told, version).get("generationDateAndTime") is None
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert description(Told, version).get("generationDateAndTime") == "1970-01-02T00:00:00Z"
    assert description(Told, version, "").get("generationDateAndTime") is None  # the token does not hang on it
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "tomorrow")
    with pytest.raises(BuildError, match="SOURCE_DATE_EPOCH is 'tomorrow'"):
        description(Told, version)


@pytest.mark.parametrize("backend", ["native", "python"])
def test_an_fmu_2_has_its_icon_where_importers_look_and_keeps_its_token_at_another_date(backend, tmp_path, monkeypatch):
    found = []
    for seconds in ("1", "2"):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
        with zipfile.ZipFile(build_fmu(components()["PositionController"], tmp_path, backend=backend, platforms=["this"])) as fmu:
            assert colours(fmu.read("model.png")) > 10
            found.append(re.findall(r'guid="([^"]+)"', fmu.read("modelDescription.xml").decode()))
    assert found[0] == found[1]


def test_an_fmu_3_has_icons_and_terminals(tmp_path):
    with zipfile.ZipFile(build_fmu(components()["PositionController"], tmp_path, fmi=3, platforms=["this"])) as fmu:
        names = {name for name in fmu.namelist() if name.startswith("terminalsAndIcons/")}
        assert names == {f"terminalsAndIcons/{name}" for name in ("icon.png", "icon.svg", "terminalsAndIcons.xml")}
        etree.XMLSchema(file=str(TERMINALS)).assertValid(etree.fromstring(fmu.read("terminalsAndIcons/terminalsAndIcons.xml")))


@every_component
def test_terminals_and_icons_are_valid_and_the_same_each_time(name):
    component = components().get(name)
    if component is None:
        pytest.skip(f"{name} is none of the components that are built")
    files = icon_and_terminals(component, 3)
    assert files == icon_and_terminals(component, 3)
    document = etree.fromstring(files["terminalsAndIcons/terminalsAndIcons.xml"])
    etree.XMLSchema(file=str(TERMINALS)).assertValid(document)
    assert document.find("Terminals/Terminal") is not None
    assert etree.fromstring(files["terminalsAndIcons/icon.svg"]).tag == "{http://www.w3.org/2000/svg}svg"
    assert icon_and_terminals(component, 2) == {"model.png": files["terminalsAndIcons/icon.png"]}


def members(component: type[Component], terminal: str) -> dict[str, str]:
    return component.terminals[terminal]


def test_terminals_that_are_meant_for_each_other_have_members_of_the_same_name_and_unit():
    all_of = components()
    for one, other in (("PositionController", "MassSpringDamper"),):
        for member, variable in members(all_of[one], "plant").items():
            met = all_of[other].variables[members(all_of[other], "plant")[member]]
            assert all_of[one].variables[variable].unit == met.unit
            assert {all_of[one].variables[variable].causality, met.causality} == {"input", "output"}
    commands = members(all_of["MotionProfile"], "command")
    for taker in ("PositionController", "OverheadCrane", "DoublePendulumCrane", "FlexibleBeam", "HydraulicPendulum"):
        shared = commands.keys() & members(all_of[taker], "command").keys()
        assert shared
        for member in shared:
            variable = all_of[taker].variables[members(all_of[taker], "command")[member]]
            assert (variable.causality, variable.unit) == ("input", all_of["MotionProfile"].variables[commands[member]].unit)


@pytest.mark.parametrize(("attribute", "value", "words"), [
    ("terminals", {"plant": {"force": "pushh"}}, "terminal 'plant' has 'pushh' as 'force', which is no input, output or parameter. Did you mean 'push'?"),
    ("terminals", {"plant": {}}, "terminal 'plant' has no members"),
    ("terminals", {"plant": "push"}, "it must be a dictionary of dictionaries"),
    ("about", {"licence": "MIT"}, "about tells 'licence'"),
    ("about", {"author": "\x01"}, "the author in about"),
    ("about", "me", "about is 'me'"),
])  # fmt: skip
def test_a_wrong_declaration_is_refused(attribute, value, words):
    wrong = type("Wrong", (Told,), {attribute: value})
    with pytest.raises(BuildError, match=re.escape(words)):
        check_declaration(wrong)
