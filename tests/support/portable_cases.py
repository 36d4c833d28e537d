"""Archives that differ from a plain one in one feature, to see what other tools make of it.

The plain one: a profile, through a shaper without shaping, pushes an oscillator.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from right_system import NAMES

from shaper_fmu.archives import write_archive

SSD = "SystemStructure.ssd"
_OMS = 'xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"'
_OSP = 'xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations"'
_FMU = 'type="application/x-fmu-sharedlibrary" source="resources/'
LAST = '<ssd:Connection startElement="shaper" startConnector="shaped" endElement="plant" endConnector="force"/>'

PLAIN = f"""<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription {NAMES} {_OMS} version="1.0" name="plain">
<ssd:System name="root">
<ssd:Elements>
<ssd:Component name="profile" {_FMU}MotionProfile.fmu"><ssd:Connectors>
<ssd:Connector name="position" kind="output"><ssc:Real unit="m"/></ssd:Connector></ssd:Connectors>
</ssd:Component>
<ssd:Component name="shaper" {_FMU}InputShaper.fmu"><ssd:Connectors>
<ssd:Connector name="command" kind="input"><ssc:Real/></ssd:Connector>
<ssd:Connector name="shaped" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>
<!--of the shaper-->
</ssd:Component>
<ssd:Component name="plant" {_FMU}MassSpringDamper.fmu"><ssd:Connectors>
<ssd:Connector name="force" kind="input"><ssc:Real/></ssd:Connector>
<ssd:Connector name="position" kind="output"><ssc:Real unit="m"/></ssd:Connector></ssd:Connectors>
<!--of the plant-->
</ssd:Component>
</ssd:Elements>
<ssd:Connections>
<ssd:Connection startElement="profile" startConnector="position" endElement="shaper" endConnector="command"/>
{LAST}
</ssd:Connections>
<ssd:Annotations><ssc:Annotation type="org.openmodelica"><oms:Annotations><oms:SimulationInformation>
<oms:FixedStepMaster description="oms-ma" stepSize="0.01"/></oms:SimulationInformation></oms:Annotations></ssc:Annotation></ssd:Annotations>
</ssd:System>
<ssd:Units><ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit></ssd:Units>
<ssd:DefaultExperiment startTime="0" stopTime="2"/>
</ssd:SystemStructureDescription>
"""


def a_set(parameters: str, name: str = "nominal", more: str = "") -> str:
    """A parameter set as a file or inline."""
    head = f'<ssv:ParameterSet {NAMES} version="1.0" name="{name}">'
    return f"{head}<ssv:Parameters>{parameters}</ssv:Parameters>{more}</ssv:ParameterSet>"


def value(name: str, number: str = "3", kind: str = "Real", more: str = "") -> str:
    """A parameter with its value."""
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{number}"{more}/></ssv:Parameter>'


def bound(*sources: str, attributes: str = "", inner: str = "") -> str:
    """Bindings of sets by their sources; none for one that has its values inside."""
    each = [f'source="resources/{source}.ssv"' for source in sources] or [""]
    found = "".join(f"<ssd:ParameterBinding {source} {attributes}>{inner}</ssd:ParameterBinding>" for source in each)
    return f"<ssd:ParameterBindings>{found}</ssd:ParameterBindings>"


SHAPER, PLANT, ROOT = "<!--of the shaper-->", "<!--of the plant-->", '<ssd:System name="root">'
FORCE = '<ssd:Connector name="force" kind="input"><ssc:Real/></ssd:Connector>'


@dataclass(frozen=True)
class Case:
    """Texts to replace in the plain description, further files, and the features that `--portable` has to find."""

    edits: tuple[tuple[str, str], ...]
    features: tuple[str, ...]
    files: dict[str, str] = field(default_factory=dict)
    instance: str = "plant"


SUB = PLAIN[PLAIN.index('<ssd:Component name="profile"') : PLAIN.index('<ssd:Component name="plant"')]
GRAMS = '<ssv:Units><ssc:Unit name="g"><ssc:BaseUnit kg="1" factor="0.001"/></ssc:Unit></ssv:Units>'
_SET = {"resources/p.ssv": a_set(value("mass"))}
_MAPPING = '<ssd:ParameterMapping><ssm:ParameterMapping version="1.0"><ssm:MappingEntry source="m" target="mass"/></ssm:ParameterMapping></ssd:ParameterMapping>'
_BUS = (
    '<ssd:SignalDictionaryReference name="bus_entry" dictionary="bus"><ssd:Connectors>'
    '<ssd:Connector name="f" kind="inout"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:SignalDictionaryReference>'
)
_SYSTEM_OUT = '<ssd:Connectors><ssd:Connector name="y" kind="output"><ssc:Real/></ssd:Connector></ssd:Connectors>'
_TO_BUS = LAST.replace("plant", "bus_entry").replace('"force"', '"f"') + LAST.replace('"shaper"', '"bus_entry"').replace(
    '"shaped"', '"f"'
)
_FIRST = '<ssd:Connection startElement="profile" startConnector="position" endElement="shaper" endConnector="command"/>\n'
BOUND = "parameters bound to a component"

CASES: dict[str, Case] = {
    "nothing": Case((), ()),
    "version": Case((('version="1.0" name="plain"', 'version="2.0" name="plain"'),), ("version 2.0",)),
    "type": Case(
        (('version="1.0" name="plain"', 'version="2.0" name="plain"'), (FORCE, FORCE.replace("Real", "Float64"))),
        ("version 2.0", "a type of version 2.0"),
    ),
    "prefixes": Case((("ssd:", ""), ("xmlns:ssd", "xmlns")), ("other prefixes than ssd:, ssc: and ssv:",)),
    "nested": Case(
        (
            ('<ssd:Component name="profile"', f'<ssd:System name="sub">{_SYSTEM_OUT}<ssd:Elements><ssd:Component name="profile"'),
            (
                f"{SHAPER}\n</ssd:Component>",
                f"</ssd:Component></ssd:Elements><ssd:Connections>{_FIRST}"
                '<ssd:Connection startElement="shaper" startConnector="shaped" endConnector="y"/></ssd:Connections></ssd:System>',
            ),
            (f"<ssd:Connections>\n{_FIRST}", "<ssd:Connections>"),
            (LAST, LAST.replace('"shaper"', '"sub"').replace('"shaped"', '"y"')),
        ),
        ("a nested system", "a connection of the system's own connector"),
    ),
    "another structure": Case(
        (
            (
                SUB,
                '<ssd:Component name="sub" type="application/x-ssp-definition" source="resources/sub.ssd">'
                + _SYSTEM_OUT
                + "</ssd:Component>\n",
            ),
            (f"<ssd:Connections>\n{_FIRST}", "<ssd:Connections>"),
            (LAST, LAST.replace('"shaper"', '"sub"').replace('"shaped"', '"y"')),
        ),
        ("a component that is another system",),
        {
            "resources/sub.ssd": f'<ssd:SystemStructureDescription {NAMES} version="1.0" name="sub"><ssd:System name="sub">{_SYSTEM_OUT}<ssd:Elements>'
            + SUB.replace("resources/", "")
            + f'</ssd:Elements><ssd:Connections>{_FIRST}<ssd:Connection startElement="shaper" startConnector="shaped" endConnector="y"/>'
            "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
        },
    ),
    "system connector": Case(
        (
            (ROOT, ROOT + _SYSTEM_OUT),
            (LAST, f'{LAST}<ssd:Connection startElement="plant" startConnector="position" endConnector="y"/>'),
        ),
        ("a connection of the system's own connector",),
    ),
    "idle system connector": Case(((ROOT, ROOT + _SYSTEM_OUT),), ("a connector of the system that nothing is connected to",)),
    "dictionary": Case(
        (
            ("</ssd:Elements>", f"{_BUS}</ssd:Elements>"),
            (LAST, _TO_BUS),
            (
                "</ssd:Connections>",
                '</ssd:Connections><ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="resources/b.ssb"/></ssd:SignalDictionaries>',
            ),
        ),
        ("a signal dictionary",),
        {
            "resources/b.ssb": f'<ssb:SignalDictionary {NAMES} version="1.0"><ssb:DictionaryEntry name="f"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary>'
        },
    ),
    "component's set": Case(((PLANT, bound("p")),), (BOUND,), _SET),
    "inline set": Case(((PLANT, bound(inner=f"<ssd:ParameterValues>{a_set(value('mass'))}</ssd:ParameterValues>")),), (BOUND,)),
    "system's set": Case(
        ((ROOT, ROOT + bound("p")),), ("parameters bound to the system",), {"resources/p.ssv": a_set(value("plant.mass"))}
    ),
    "two sets": Case(
        ((PLANT, bound("p", "q")),),
        (BOUND, "a further set for the same component"),
        {**_SET, "resources/q.ssv": a_set(value("mass", "5"))},
    ),
    "sets of two names": Case(
        ((SHAPER, bound("p")), (PLANT, bound("q"))),
        (BOUND, BOUND, "a set of another name than the first one"),
        {"resources/p.ssv": a_set(value("modes", "1", "Integer")), "resources/q.ssv": a_set(value("mass"), "other")},
    ),
    "prefix of a binding": Case(
        ((PLANT, bound("p", attributes='prefix="ma"')),), (BOUND, "a prefix of a binding"), {"resources/p.ssv": a_set(value("ss"))}
    ),
    "mapping": Case(((PLANT, bound("p", inner=_MAPPING)),), (BOUND, "a parameter mapping"), {"resources/p.ssv": a_set(value("m"))}),
    "item": Case(
        ((SHAPER, bound("p")),),
        (BOUND, "a value for an enumeration by its item"),
        {"resources/p.ssv": a_set(value("shaper", "zvd", "Enumeration"))},
    ),
    "number of an item": Case(
        ((SHAPER, bound("p")),),
        (BOUND, "a value for an enumeration by its number"),
        {"resources/p.ssv": a_set(value("shaper", "3", "Integer"))},
    ),
    "grams": Case(
        ((PLANT, bound("p")),),
        (BOUND, "a value in another unit than the FMU's"),
        {"resources/p.ssv": a_set(value("mass", "3000", more=' unit="g"'), more=GRAMS)},
    ),
    "enumeration's connector": Case(
        (
            (
                '<ssd:Connector name="command"',
                '<ssd:Connector name="shaper" kind="parameter"><ssc:Enumeration name="Kind"/></ssd:Connector><ssd:Connector name="command"',
            ),
            (
                "<ssd:Units>",
                '<ssd:Enumerations><ssc:Enumeration name="Kind"><ssc:Item name="zv" value="2"/></ssc:Enumeration></ssd:Enumerations><ssd:Units>',
            ),
        ),
        ("a connector that is an enumeration",),
    ),
    "no type": Case(((FORCE, '<ssd:Connector name="force" kind="input"/>'),), ("a connector without a type",)),
    "against the flow": Case(
        ((LAST, '<ssd:Connection startElement="plant" startConnector="force" endElement="shaper" endConnector="shaped"/>'),),
        ("a connection whose start is an input",),
    ),
    "transformation": Case(
        ((LAST, LAST.replace("/>", '><ssc:LinearTransformation factor="2" offset="1"/></ssd:Connection>')),),
        ("a linear transformation",),
    ),
    "unfed input": Case(((LAST, ""),), ("an input that nothing feeds",)),
    "OSP below the root": Case(
        (
            (
                '<ssd:DefaultExperiment startTime="0" stopTime="2"/>',
                '<ssd:DefaultExperiment startTime="0" stopTime="2"><ssd:Annotations><ssc:Annotation type="com.opensimulationplatform">'
                f'<osp:Algorithm {_OSP}><osp:FixedStepAlgorithm baseStepSize="0.01"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>'
                "</ssd:DefaultExperiment>",
            ),
        ),
        ("an OSP annotation without its namespace on the root element",),
    ),
    "variant": Case((), ("further variants",), {"Variant.ssd": PLAIN}),
    "blank in a name": Case(
        (('name="plant"', 'name="the plant"'), ('endElement="plant"', 'endElement="the plant"')),
        ("a name that is not an identifier",),
        instance="the plant",
    ),
    "without OMSimulator's annotation": Case(
        (('<oms:FixedStepMaster description="oms-ma" stepSize="0.01"/>', ""),), ("no FixedStepMaster annotation",)
    ),
}


def archive(case: Case, fmus: Path, path: Path) -> Path:
    """Write a case's archive."""
    text = PLAIN
    for old, new in case.edits:
        assert old in text, old
        text = text.replace(old, new)
    files = {SSD: text.encode(), **{name: content.encode() for name, content in case.files.items()}}
    files |= {
        f"resources/{name}.fmu": (fmus / f"{name}.fmu").read_bytes()
        for name in ("MotionProfile", "InputShaper", "MassSpringDamper")
    }
    return write_archive(path, files)
