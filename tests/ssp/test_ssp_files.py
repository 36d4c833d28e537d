"""SSP files written and read again: they mean the same, hold to the standard's schemas, and nothing is lost."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lxml import etree
from ssp_documents import descriptions, dictionaries, mappings, parameter_sets

from shaper_fmu.errors import ArchiveError, ModelError
from shaper_fmu.ssp import document as d
from shaper_fmu.ssp.names import PREFIXES
from shaper_fmu.ssp.read import read_description, read_dictionary, read_mapping, read_parameter_set
from shaper_fmu.ssp.schemas import schema_problems
from shaper_fmu.ssp.write import write_description, write_dictionary, write_mapping, write_parameter_set

NAMESPACES = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in PREFIXES.items())
RANDOM = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large], derandomize=True
)
VERSIONS = st.sampled_from(["1.0", "2.0"])


@RANDOM
@given(VERSIONS.flatmap(descriptions))
def test_descriptions_come_back_as_they_were(description):
    written = write_description(description)
    assert schema_problems(written, "x.ssd") == []
    assert read_description(written, "x.ssd") == description
    assert write_description(read_description(written, "x.ssd")) == written


@RANDOM
@given(VERSIONS.flatmap(parameter_sets), VERSIONS.flatmap(mappings), VERSIONS.flatmap(dictionaries))
def test_sets_mappings_and_dictionaries_come_back_as_they_were(values, mapping, dictionary):
    for thing, write, read in (
        (values, write_parameter_set, read_parameter_set),
        (mapping, write_mapping, read_mapping),
        (dictionary, write_dictionary, read_dictionary),
    ):
        written = write(thing)
        assert schema_problems(written, "x") == []
        assert read(written, "x") == thing


def ssd(inner: str, version: str = "1.0", **attributes: str) -> bytes:
    more = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f'<ssd:SystemStructureDescription {NAMESPACES} version="{version}" name="n"{more}>{inner}</ssd:SystemStructureDescription>'.encode()


def test_unknown_content_survives_where_it_is():
    """Elements and attributes of others, in any element, with text, white space and prefixes in values."""
    content = ssd(
        """<ssd:System name="root" xmlns:o="http://example.org/o" o:mark="1">
          <o:first a="o:b"> text <o:in/>\n</o:first>
          <ssd:Elements><ssd:Component name="c" source="x.fmu" o:colour="red"><ssd:Future x="1"/></ssd:Component></ssd:Elements>
          <ssd:Annotations><ssc:Annotation type="o"><o:deep>  a<o:b/>c </o:deep></ssc:Annotation></ssd:Annotations>
        </ssd:System>"""
    )
    found = read_description(content, "x.ssd")
    again = read_description(write_description(found), "x.ssd")
    assert again == found
    assert again.system.attributes == {"{http://example.org/o}mark": "1"}
    assert again.system.extra == ['<o:first xmlns:o="http://example.org/o" a="o:b"> text <o:in></o:in>\n</o:first>']
    component = again.system.elements[0]
    assert component.attributes == {"{http://example.org/o}colour": "red"}
    assert etree.fromstring(component.extra[0]).get("x") == "1"
    assert "<o:deep" in again.system.annotations[0].xml
    assert ">  a<o:b></o:b>c </o:deep>" in again.system.annotations[0].xml


def test_any_prefixes_and_any_order_are_read():
    """The standard names namespaces, not prefixes; some tools write annotations first."""
    uris = dict(PREFIXES)
    content = f"""<SystemStructureDescription xmlns="{uris["ssd"]}" xmlns:q="{uris["ssc"]}" version="1.0" name="n">
      <DefaultExperiment stopTime="2"/>
      <System name="root"><Annotations><q:Annotation type="a"/></Annotations>
        <Connectors><Connector name="x" kind="output"><q:Real unit="m"/></Connector></Connectors></System>
    </SystemStructureDescription>""".encode()
    found = read_description(content, "x.ssd")
    assert (found.stop_time, found.system.connectors[0].type) == (2.0, d.DataType("Real", "m"))
    assert schema_problems(content, "x.ssd")
    assert schema_problems(write_description(found), "x.ssd") == []  # written in the standard's order


@pytest.mark.parametrize(
    ("inner", "words"),
    [
        ("", "x.ssd: no System"),
        ("<ssd:System/>", "x.ssd, line 1: System has no name"),
        (
            "<ssd:System name='s'>\n<ssd:Elements>\n<ssd:Thing name='t'/></ssd:Elements></ssd:System>",
            "line 3: Thing is not a kind of element",
        ),
        (
            "<ssd:System name='s'><ssd:Connections>\n<ssd:Connection startElement='a'/></ssd:Connections></ssd:System>",
            "line 2: Connection has no startConnector.*\n.*line 2: Connection has no endConnector",
        ),
        (
            "<ssd:System name='s'/><ssd:Units>\n<ssc:Unit name='u'><ssc:BaseUnit factor='0'/></ssc:Unit></ssd:Units>",
            "line 2: unit 'u' has the factor 0",
        ),
        (
            "<ssd:System name='s'/><ssd:Units>\n<ssc:Unit name='u'><ssc:BaseUnit m='one'/></ssc:Unit></ssd:Units>",
            "line 2: m = 'one' is not an integer",
        ),
        ("<ssd:System name='s'/><ssd:DefaultExperiment startTime='NaN'/>", "startTime = 'NaN' is not a number"),
        ("<ssd:System name='s'/><ssd:DefaultExperiment startTime='1_0'/>", "startTime = '1_0' is not a number"),
    ],
)
def test_what_cannot_be_understood_is_named_with_its_line(inner, words):
    with pytest.raises(ModelError, match=words):
        read_description(ssd(inner), "x.ssd")


def test_a_mapping_that_is_ambiguous_is_refused():
    entry = '<ssc:MapEntry source="1" target="2"/>'
    content = f"""<ssm:ParameterMapping {NAMESPACES} version="1.0"><ssm:MappingEntry source="a" target="b">
      <ssc:IntegerMappingTransformation>{entry}{entry}</ssc:IntegerMappingTransformation></ssm:MappingEntry></ssm:ParameterMapping>"""
    with pytest.raises(ModelError, match="line 2: IntegerMappingTransformation maps '1' more than once"):
        read_mapping(content.encode(), "x.ssm")


def test_a_version_that_is_left_out_is_1_0():
    found = read_parameter_set(f"<ssv:ParameterSet {NAMESPACES} name='s'><ssv:Parameters/></ssv:ParameterSet>".encode(), "x.ssv")
    assert found == d.ParameterSet("s")
    assert found.version == "1.0"


@pytest.mark.parametrize("read", [read_description, read_parameter_set, read_mapping, read_dictionary])
def test_a_file_of_another_kind_is_refused(read):
    with pytest.raises(ModelError, match=r"x: not an SSP .* \(root html; expected"):
        read(b"<html/>", "x")
    with pytest.raises(ArchiveError, match="DTD"):
        read(b'<!DOCTYPE a [<!ENTITY e "1">]><a>&e;</a>', "x")


OSP = '<o:Algorithm xmlns:o="http://opensimulationplatform.com/SSP/OSPAnnotations"><o:FixedStepAlgorithm baseStepSize="0.5"/></o:Algorithm>'
OMS = '<m:SimulationInformation xmlns:m="{}"><m:FixedStepMaster description="oms-ma" stepSize="0.25"/></m:SimulationInformation>'
VARIABLE = OMS.replace('FixedStepMaster description="oms-ma" stepSize="0.25"', 'VariableStepMaster maximumStepSize="0.125"')
OMS_URI = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"


def described(*annotations: tuple[str, str]) -> d.SystemDescription:
    """A description whose root system has annotations of these types with this content."""
    inner = "".join(f'<ssc:Annotation type="{kind}">{text}</ssc:Annotation>' for kind, text in annotations)
    return read_description(ssd(f'<ssd:System name="s"><ssd:Annotations>{inner}</ssd:Annotations></ssd:System>'), "x.ssd")


def test_settings_of_other_tools_are_found():
    osp, oms = ("com.opensimulationplatform", OSP), ("org.openmodelica", OMS.format(OMS_URI))
    variable = ("org.openmodelica", f'<m:Annotations xmlns:m="{OMS_URI}">{VARIABLE.format(OMS_URI)}</m:Annotations>')
    found = [described(*texts) for texts in ((), (osp,), (osp, oms), (variable,))]
    assert [(x.step_size, x.algorithm) for x in found] == [
        (None, None),
        (0.5, "parallel"),
        (0.25, "jacobi"),
        (0.125, "jacobi"),
    ]
    with pytest.raises(ModelError, match=r"annotation FixedStepMaster: stepSize = '0' is not a number greater than 0"):
        described((oms[0], oms[1].replace("0.25", "0"))).step_size  # noqa: B018


@pytest.mark.parametrize(
    "text",
    [
        OMS.format("http://openmodelica.org/oms"),  # as Vico writes it for OMSimulator
        "<oms:SimulationInformation><oms:FixedStepMaster stepSize='0.25'/></oms:SimulationInformation>",  # not declared
        "<oms:SimulationInformation><FixedStepMaster stepSize='0.25'/></oms:SimulationInformation>",  # older, in no namespace
    ],
)
def test_settings_of_omsimulator_as_files_have_them(text):
    assert [(x.tool, x.step_size) for x in described(("org.openmodelica", text)).settings] == [("OMSimulator", 0.25)]


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("com.github.ntnu-ihb.vico", OMS.format("http://github.com/NTNU-IHB/Vico/schema/SSP1/Vico")),
        ("com.github.ntnu-ihb.vico", OMS.format(OMS_URI)),
        ("com.github.ntnu-ihb.vico", VARIABLE.format("http://github.com/NTNU-IHB/Vico/schema/SSP1/Vico")),
        ("com.github.ntnu-ihb.vico", OSP),
        ("com.github.ntnu-ihb.vico", OMS.format("m").replace("m:", "").replace(":m", "")),
        ("org.openmodelica", OMS.format("http://github.com/NTNU-IHB/Vico/schema/SSP1/Vico")),
        ("org.openmodelica", OSP),
        ("com.opensimulationplatform", OMS.format(OMS_URI)),
        ("com.opensimulationplatform", OSP.replace("opensimulationplatform", "example")),
        ("com.opensimulationplatform", '<FixedStepAlgorithm baseStepSize="0.5"/>'),
        ("", OMS.format(OMS_URI)),
    ],
)
def test_settings_of_tools_that_are_not_known_are_nobodys(kind, text):
    """Elements of the same names, steps that make no sense among them; they are kept."""
    for changed in (text, text.replace("0.25", "none").replace("0.5", "none")):
        found = described((kind, changed))
        assert (found.settings, found.step_size, found.algorithm) == ([], None, None)
        assert len(found.all_annotations()) == 1


def test_prefixes_that_are_not_declared_mean_what_they_usually_do():
    """OSP's demo systems do not declare theirs; with a declaration the settings are the same."""
    annotation = (
        '<ssd:System name="root"/><ssd:DefaultExperiment stopTime="2"><ssd:Annotations><ssc:Annotation '
        'type="com.opensimulationplatform"><osp:Algorithm{}><osp:FixedStepAlgorithm baseStepSize="0.25" odd:x="1"/></osp:Algorithm>'
        "</ssc:Annotation></ssd:Annotations></ssd:DefaultExperiment>"
    )
    for root in (ssd(annotation.format("")), b"<!-- <a> -->\n<?x <b?>\n" + ssd(annotation.format(""))):
        found = read_description(root, "x.ssd")
        assert [(one.tool, one.step_size) for one in found.settings] == [("OSP", 0.25)]
        told = schema_problems(root, "x.ssd")
        line = root.count(b"\n") + 1
        assert set(told) >= {f"x.ssd, line {line}: the prefix {prefix!r} is not declared" for prefix in ("osp", "odd")}
    assert schema_problems(ssd(annotation.format("").replace(' odd:x="1"', "").replace("osp:", "")), "x.ssd") == []
    with pytest.raises(ArchiveError, match="not well-formed"):
        read_description(ssd(annotation.format("")).replace(b"</ssc:Annotation>", b""), "x.ssd")
