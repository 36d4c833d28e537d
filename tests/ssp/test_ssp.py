"""Reading and running SSP archives."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import pytest

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.errors import ArchiveError, BuildError, ModelError
from shaper_fmu.master.system import System
from shaper_fmu.ssp.archive import load_ssp, pack_ssp

SYSTEMS = Path(__file__).parents[2] / "ssp"


@pytest.fixture
def crane_files(fmus, tmp_path) -> dict[str, bytes]:
    return read_archive(pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / "crane.ssp").read_bytes(), "crane.ssp")


def changed(files: dict[str, bytes], tmp_path: Path, name: str, old: str, new: str) -> Path:
    """An archive in which a text is replaced, once, in one file."""
    text = files[name].decode()
    assert old in text
    return write_archive(tmp_path / "changed.ssp", {**files, name: text.replace(old, new, 1).encode()})


def test_the_crane_equals_the_same_system_built_in_python(fmus, tmp_path):
    loaded = load_ssp(pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / "crane.ssp"))
    assert (loaded.structure.stop_time, loaded.structure.step_size) == (25.0, 0.01)
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", profile="cycloid", distance=10.0, duration=8.0)
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[math.sqrt(9.81 / 8.0)], damping_ratio=[0.0])
    system.add("crane", fmus / "OverheadCrane.fmu", initial_rope_length=8.0, damping_ratio=0.0, hoist_speed=0.0)
    system.connect("profile.acceleration", "shaper.command")
    system.connect("shaper.shaped_mean", "crane.trolley_acceleration")
    one, other = loaded.system.simulate(2.0, 0.01), system.simulate(2.0, 0.01)
    for name in one.values:
        assert one[name].tobytes() == other[name].tobytes()


def test_packing_is_reproducible(fmus, tmp_path):
    one, other = (pack_ssp(SYSTEMS / "overhead_crane", fmus, tmp_path / name) for name in ("a.ssp", "b.ssp"))
    assert one.read_bytes() == other.read_bytes()


def test_packing_names_a_missing_fmu(tmp_path):
    with pytest.raises(BuildError, match=r"component 'profile' needs .*MotionProfile.fmu"):
        pack_ssp(SYSTEMS / "overhead_crane", tmp_path, tmp_path / "crane.ssp")
    assert not (tmp_path / "crane.ssp").exists()


def test_inline_parameter_sets_are_read(crane_files, tmp_path):
    inline = """<ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="inline"><ssv:Parameters>
      <ssv:Parameter name="initial_rope_length"><ssv:Real value="3" unit="m"/></ssv:Parameter>
      <ssv:Parameter name="hoist_speed"><ssv:Real value="0"/></ssv:Parameter>
      </ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>"""
    path = changed(crane_files, tmp_path, "SystemStructure.ssd", '<ssd:ParameterBinding source="resources/crane.ssv"/>', inline)
    assert load_ssp(path).system.start_values["crane"] == {"initial_rope_length": 3.0, "hoist_speed": 0.0}


SSD = "SystemStructure.ssd"


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (
            SSD,
            'endConnector="command"',
            'endConnector="comand"',
            r"line 41: connection to shaper.comand: shaper has no connector 'comand'. Did you mean 'command'\?",
        ),
        (
            SSD,
            'startElement="profile"',
            'startElement="prfile"',
            r"line 41: connection to prfile.*the system has no element 'prfile'.*Did you mean 'profile'\?",
        ),
        (
            SSD,
            'name="acceleration" kind="output"',
            'name="accel" kind="output"',
            "connector profile.accel is not a variable of MotionProfile.fmu. Did you mean 'acceleration'",
        ),
        (
            SSD,
            'name="command" kind="input"',
            'name="command" kind="output"',
            "connector shaper.command is of kind output, but input in InputShaper.fmu",
        ),
        (SSD, "resources/MotionProfile.fmu", "resources/Motion.fmu", "component 'profile': 'resources/Motion.fmu' is missing"),
        (
            SSD,
            "resources/crane.ssv",
            "resources/none.ssv",
            "parameter binding of crane: 'resources/none.ssv' is missing in the archive",
        ),
        (
            SSD,
            'version="1.0" name=',
            'version="3.0" name=',
            "line 7: version '3.0'; of the SSP standard, versions 1.0 and 2.0 are known",
        ),
        (SSD, "SSP1/SystemStructureDescription", "SSP9/SystemStructureDescription", "not an SSP system structure"),
        (SSD, 'stopTime="25"', 'stopTime="soon"', "attribute 'stopTime': 'soon' is not a valid value"),
        (
            SSD,
            ' startConnector="acceleration"',
            "",
            "line 41: element 'ssd:Connection': The attribute 'startConnector' is required",
        ),
        (
            SSD,
            'name="crane" type="',
            'name="crane" implementation="ScheduledExecution" type="',
            "component 'crane' asks for ScheduledExecution; FMUs are run by CoSimulation and ModelExchange",
        ),
        (
            SSD,
            'name="crane" type="application/x-fmu-sharedlibrary"',
            'name="crane" type="text/x-modelica"',
            "component 'crane' is of type 'text/x-modelica'",
        ),
        (
            SSD,
            'kind="input"><ssc:Real/>',
            'kind="input"><ssc:Real/><ssc:Integer/>',
            "line 20: element 'ssc:Integer': This element is not expected",
        ),
        (
            SSD,
            '<ssc:Unit name="rad">',
            '<ssc:Unit name="rad"><ssc:Base rad="1"/></ssc:Unit><ssc:Unit name="grad">',
            "element 'ssc:Base': This element is not expected. Expected is .* ssc:BaseUnit",
        ),
        (
            "resources/crane.ssv",
            'value="8"',
            'value="eight"',
            "parameter initial_rope_length -> crane.initial_rope_length: 'eight' is not a value of kind real",
        ),
        (
            "resources/crane.ssv",
            'value="8"',
            'value="8" unit="mm"',
            "line 4: parameter initial_rope_length: unit 'mm' is not declared in Units",
        ),
        ("resources/crane.ssv", '<ssv:Real value="8"/>', "", "line 4: element 'ssv:Parameter': Missing child element"),
        (
            "resources/shaper.ssv",
            "</ssv:Parameters>",
            '<ssv:Parameter name="shaper"><ssv:Enumeration value="zvvd"/></ssv:Parameter></ssv:Parameters>',
            r"'zvvd' is not a value of shaper. Did you mean 'zvd'\?",
        ),
    ],
)
def test_wrong_systems_are_refused_in_words(crane_files, tmp_path, file, old, new, words):
    with pytest.raises(ModelError, match=words):
        load_ssp(changed(crane_files, tmp_path, file, old, new))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</ssd:System>", "</ssd:Sistem>", "not well-formed"),
        (
            "<ssd:SystemStructureDescription",
            "<!DOCTYPE x [<!ENTITY e SYSTEM 'file:///etc/passwd'>]><ssd:SystemStructureDescription",
            "document type",
        ),
    ],
)
def test_hostile_or_damaged_xml_is_refused(crane_files, tmp_path, old, new, words):
    with pytest.raises(ArchiveError, match=words):
        load_ssp(changed(crane_files, tmp_path, SSD, old, new))


def test_an_archive_without_a_system_is_refused(fmus, tmp_path):
    shutil.copy(fmus / "InputShaper.fmu", tmp_path / "x.ssp")
    with pytest.raises(ArchiveError, match=r"no SystemStructure.ssd, so this is not an SSP archive"):
        load_ssp(tmp_path / "x.ssp")
