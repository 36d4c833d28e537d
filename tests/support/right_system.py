"""A system that uses most of what SSP has and is right, and how a change makes it wrong.

A profile and a shaper in a system of their own, a position controller around an oscillator, whose position passes through a
signal dictionary; parameters at all levels, with prefix, mapping, units and an enumeration.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from shaper_fmu.archives import write_archive

SSD, COMMON, GAINS, MAPPING, BUS, SET = (
    "SystemStructure.ssd",
    "resources/common.ssv",
    "resources/gains.ssv",
    "resources/gains.ssm",
    "resources/bus.ssb",
    "parameter_sets/heavy.ssv",
)
FMUS = ("MotionProfile", "InputShaper", "PositionController", "MassSpringDamper")

NAMES = " ".join(
    f'xmlns:{prefix}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for prefix, name in (
        ("ssd", "Description"),
        ("ssc", "Common"),
        ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
        ("ssb", "SignalDictionary"),
    )
)
_OSP = 'xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"'

RIGHT: dict[str, str] = {
    SSD: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {NAMES} {_OSP} version="1.0" name="lift">
  <ssd:System name="root">
    <ssd:ParameterBindings>
      <ssd:ParameterBinding source="resources/common.ssv"/>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:System name="command">
        <ssd:Connectors>
          <ssd:Connector name="out" kind="output"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="distance" kind="parameter"><ssc:Real unit="mm"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:Elements>
          <ssd:Component name="profile" source="resources/MotionProfile.fmu">
            <ssd:Connectors>
              <ssd:Connector name="position" kind="output"><ssc:Real unit="m"/></ssd:Connector>
              <ssd:Connector name="distance" kind="parameter"><ssc:Real unit="m"/></ssd:Connector>
              <ssd:Connector name="profile" kind="parameter"><ssc:Enumeration name="Profile"/></ssd:Connector>
              <ssd:Connector name="moving" kind="output"><ssc:Boolean/></ssd:Connector>
            </ssd:Connectors>
          </ssd:Component>
          <ssd:Component name="shaper" source="resources/InputShaper.fmu" implementation="CoSimulation">
            <ssd:Connectors>
              <ssd:Connector name="command" kind="input"><ssc:Real/></ssd:Connector>
              <ssd:Connector name="shaped_mean" kind="output"><ssc:Real/></ssd:Connector>
            </ssd:Connectors>
          </ssd:Component>
        </ssd:Elements>
        <ssd:Connections>
          <ssd:Connection startElement="profile" startConnector="position" endElement="shaper" endConnector="command"/>
          <ssd:Connection startElement="shaper" startConnector="shaped_mean" endConnector="out"/>
          <ssd:Connection startConnector="distance" endElement="profile" endConnector="distance"/>
        </ssd:Connections>
      </ssd:System>
      <ssd:Component name="controller" type="application/x-fmu-sharedlibrary" source="resources/PositionController.fmu">
        <ssd:Connectors>
          <ssd:Connector name="reference" kind="input"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="position" kind="input"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="velocity" kind="input"><ssc:Real unit="m/s"/></ssd:Connector>
          <ssd:Connector name="force" kind="output"><ssc:Real unit="N"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings>
          <ssd:ParameterBinding source="resources/gains.ssv" prefix="pd.">
            <ssd:ParameterMapping source="resources/gains.ssm"/>
          </ssd:ParameterBinding>
        </ssd:ParameterBindings>
      </ssd:Component>
      <ssd:Component name="plant" source="resources/MassSpringDamper.fmu">
        <ssd:Connectors>
          <ssd:Connector name="force" kind="input"><ssc:Real unit="N"/></ssd:Connector>
          <ssd:Connector name="position" kind="output"><ssc:Real unit="m"/></ssd:Connector>
          <ssd:Connector name="velocity" kind="output"><ssc:Real unit="m/s"/></ssd:Connector>
          <ssd:Connector name="acceleration" kind="output"><ssc:Real unit="m/s2"/></ssd:Connector>
        </ssd:Connectors>
        <ssd:ParameterBindings>
          <ssd:ParameterBinding>
            <ssd:ParameterValues>
              <ssv:ParameterSet version="1.0" name="inline">
                <ssv:Parameters>
                  <ssv:Parameter name="mass"><ssv:Real value="2" unit="t"/></ssv:Parameter>
                </ssv:Parameters>
                <ssv:Units>
                  <ssc:Unit name="t"><ssc:BaseUnit kg="1" factor="1000"/></ssc:Unit>
                </ssv:Units>
              </ssv:ParameterSet>
            </ssd:ParameterValues>
          </ssd:ParameterBinding>
        </ssd:ParameterBindings>
      </ssd:Component>
      <ssd:SignalDictionaryReference name="bus_entry" dictionary="bus">
        <ssd:Connectors>
          <ssd:Connector name="position" kind="inout"><ssc:Real unit="mm"/></ssd:Connector>
        </ssd:Connectors>
      </ssd:SignalDictionaryReference>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="command" startConnector="out" endElement="controller" endConnector="reference"/>
      <ssd:Connection startElement="plant" startConnector="force" endElement="controller" endConnector="force"/>
      <ssd:Connection startElement="plant" startConnector="position" endElement="bus_entry" endConnector="position"/>
      <ssd:Connection startElement="bus_entry" startConnector="position" endElement="controller" endConnector="position"/>
      <ssd:Connection startElement="plant" startConnector="velocity" endElement="controller" endConnector="velocity">
        <ssc:LinearTransformation factor="1"/>
      </ssd:Connection>
    </ssd:Connections>
    <ssd:SignalDictionaries>
      <ssd:SignalDictionary name="bus" source="resources/bus.ssb"/>
    </ssd:SignalDictionaries>
  </ssd:System>
  <ssd:Enumerations>
    <ssc:Enumeration name="Profile">
      <ssc:Item name="step" value="1"/>
      <ssc:Item name="s_curve" value="7"/>
    </ssc:Enumeration>
  </ssd:Enumerations>
  <ssd:Units>
    <ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
    <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
    <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>
    <ssc:Unit name="m/s2"><ssc:BaseUnit m="1" s="-2"/></ssc:Unit>
    <ssc:Unit name="N"><ssc:BaseUnit kg="1" m="1" s="-2"/></ssc:Unit>
  </ssd:Units>
  <ssd:DefaultExperiment startTime="0" stopTime="5">
    <ssd:Annotations>
      <ssc:Annotation type="com.opensimulationplatform">
        <osp:Algorithm>
          <osp:FixedStepAlgorithm baseStepSize="0.01"/>
        </osp:Algorithm>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
""",
    COMMON: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet {NAMES} version="1.0" name="common">
  <ssv:Parameters>
    <ssv:Parameter name="command.distance"><ssv:Real value="300" unit="mm"/></ssv:Parameter>
    <ssv:Parameter name="command.profile.duration"><ssv:Real value="1.5"/></ssv:Parameter>
    <ssv:Parameter name="command.profile.profile"><ssv:Enumeration value="s_curve" name="Profile"/></ssv:Parameter>
    <ssv:Parameter name="command.shaper.shaper"><ssv:Integer value="3"/></ssv:Parameter>
    <ssv:Parameter name="command.shaper.modes"><ssv:Integer value="1"/></ssv:Parameter>
    <ssv:Parameter name="command.shaper.shape_mode[1]"><ssv:Boolean value="true"/></ssv:Parameter>
    <ssv:Parameter name="plant.damping"><ssv:Real value="50"/></ssv:Parameter>
  </ssv:Parameters>
  <ssv:Enumerations>
    <ssc:Enumeration name="Profile">
      <ssc:Item name="cycloid" value="3"/>
      <ssc:Item name="s_curve" value="7"/>
    </ssc:Enumeration>
  </ssv:Enumerations>
  <ssv:Units>
    <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
  </ssv:Units>
</ssv:ParameterSet>
""",
    GAINS: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet {NAMES} version="1.0" name="gains">
  <ssv:Parameters>
    <ssv:Parameter name="p"><ssv:Real value="3"/></ssv:Parameter>
    <ssv:Parameter name="d"><ssv:Real value="900"/></ssv:Parameter>
  </ssv:Parameters>
</ssv:ParameterSet>
""",
    MAPPING: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssm:ParameterMapping {NAMES} version="1.0">
  <ssm:MappingEntry source="pd.p" target="proportional_gain"><ssc:LinearTransformation factor="1000"/></ssm:MappingEntry>
  <ssm:MappingEntry source="pd.d" target="derivative_gain"/>
</ssm:ParameterMapping>
""",
    BUS: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssb:SignalDictionary {NAMES} version="1.0">
  <ssb:DictionaryEntry name="position"><ssc:Real unit="mm"/></ssb:DictionaryEntry>
  <ssb:Units>
    <ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>
  </ssb:Units>
</ssb:SignalDictionary>
""",
    SET: f"""<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet {NAMES} version="1.0" name="heavy">
  <ssv:Parameters>
    <ssv:Parameter name="plant.mass"><ssv:Real value="5"/></ssv:Parameter>
  </ssv:Parameters>
</ssv:ParameterSet>
""",
}


@dataclass(frozen=True)
class Wrong:
    """A wrong system: texts to replace, as (file, old, new), and the findings, as (file, a text in the line meant, words).

    `seen_by_schema` tells whether the standard's schemas find something, too. `change` alters files that are no texts.
    """

    edits: tuple[tuple[str, str, str], ...]
    findings: tuple[tuple[str, str, str], ...]
    seen_by_schema: bool = False
    change: Callable[[dict[str, bytes]], None] | None = None


def system_files(fmus: Path) -> dict[str, bytes]:
    """The right system's files."""
    packed = {f"resources/{name}.fmu": (fmus / f"{name}.fmu").read_bytes() for name in FMUS}
    return {**{name: text.encode() for name, text in RIGHT.items()}, **packed}


def wrong_files(wrong: Wrong, right: Mapping[str, bytes]) -> dict[str, bytes]:
    """The wrong system's files."""
    files = dict(right)
    for file, old, new in wrong.edits:
        text = files[file].decode()
        assert text.count(old) == 1, (file, old, text.count(old))
        files[file] = text.replace(old, new).encode()
    if wrong.change is not None:
        wrong.change(files)
    return files


def expected(wrong: Wrong, files: Mapping[str, bytes]) -> list[str]:
    """The findings in the checker's words."""
    found = []
    for file, text, words in wrong.findings:
        lines = [i for i, line in enumerate(files[file].decode().splitlines(), 1) if text in line] if text else [0]
        assert lines, (file, text)
        found.append(f"{file}, line {lines[0]}: {words}" if text else f"{file}: {words}")
    return found


def save(files: dict[str, bytes], path: Path) -> Path:
    """Write an archive."""
    return write_archive(path, files)


PLANT = '<ssd:Component name="plant" source="resources/MassSpringDamper.fmu">'
FORCE = '<ssd:Connection startElement="plant" startConnector="force" endElement="controller" endConnector="force"/>'
VELOCITY = '<ssd:Connection startElement="plant" startConnector="velocity" endElement="controller" endConnector="velocity">'
COMMAND_OUT = '<ssd:Connection startElement="command" startConnector="out" endElement="controller" endConnector="reference"/>'
DISTANCE = '<ssv:Parameter name="command.distance"><ssv:Real value="300" unit="mm"/></ssv:Parameter>'
DURATION = '<ssv:Parameter name="command.profile.duration"><ssv:Real value="1.5"/></ssv:Parameter>'
KIND = '<ssv:Parameter name="command.profile.profile"><ssv:Enumeration value="s_curve" name="Profile"/></ssv:Parameter>'
