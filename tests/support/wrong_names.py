"""Systems that are wrong in names, declarations, dictionaries, the experiment or a variant, and in several places at once."""

from __future__ import annotations

from right_system import BUS, COMMAND_OUT, COMMON, SSD, Wrong


def _variant(files: dict[str, bytes]) -> None:
    text = files[SSD].decode().replace('endConnector="command"', 'endConnector="comand"')
    files["Variant.ssd"] = text.replace('name="lift"', 'name="another"').encode()


NAMES: dict[str, Wrong] = {
    "an element twice": Wrong(
        (
            (
                SSD,
                '<ssd:SignalDictionaryReference name="bus_entry"',
                '<ssd:Component name="plant" source="resources/MassSpringDamper.fmu"/>\n<ssd:SignalDictionaryReference name="bus_entry"',
            ),
        ),
        ((SSD, 'MassSpringDamper.fmu"/>', "element 'plant' is there twice, first in line 48"),),
    ),
    "a connector twice": Wrong(
        (
            (SSD, '<ssd:Connector name="acceleration"', '<ssd:Connector name="velocity"'),
            (SSD, '<ssc:Real unit="m/s2"/></ssd:Connector>', '<ssc:Real unit="m/s"/></ssd:Connector><!-- second -->'),
        ),
        ((SSD, "second", "connector 'plant.velocity' is there twice, first in line 52"),),
    ),
    "a unit twice": Wrong(
        (
            (
                SSD,
                '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>',
                '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>\n<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.01"/></ssc:Unit>',
            ),
        ),
        ((SSD, 'factor="0.01"', "unit 'mm' is declared twice"),),
    ),
    "a unit not declared": Wrong(
        ((SSD, '<ssc:Unit name="m/s2">', '<ssc:Unit name="m/s^2">'),),
        (
            (
                SSD,
                '<ssd:Connector name="acceleration"',
                "connector plant.acceleration: unit 'm/s2' is not declared in Units. Did you mean 'm/s^2'?",
            ),
        ),
    ),
    "an enumeration not declared": Wrong(
        ((SSD, '<ssc:Enumeration name="Profile"/>', '<ssc:Enumeration name="Profiles"/>'),),
        (
            (
                SSD,
                "Profiles",
                "connector command.profile.profile: enumeration 'Profiles' is not declared in Enumerations. Did you mean 'Profile'?",
            ),
        ),
    ),
    "items of one value": Wrong(
        ((SSD, '<ssc:Item name="s_curve" value="7"/>', '<ssc:Item name="s_curve" value="1"/>'),),
        (
            (
                SSD,
                '<ssd:Connector name="profile" kind',
                "connector command.profile.profile: item 's_curve' has the value 1, but 7 in MotionProfile.fmu",
            ),
            (SSD, '<ssc:Enumeration name="Profile">', "enumeration 'Profile': items step and s_curve have the same value 1"),
        ),
    ),
    "an empty name": Wrong(
        (
            (
                SSD,
                '<ssd:SignalDictionaryReference name="bus_entry"',
                '<ssd:System name=""/>\n<ssd:SignalDictionaryReference name="bus_entry"',
            ),
        ),
        (
            (
                SSD,
                '<ssd:System name=""/>',
                "element 'ssd:System', attribute 'name': [facet 'minLength'] The value '' has a length of '0'; this underruns the allowed minimum length of '1'",
            ),
            (SSD, '<ssd:System name=""/>', "an element of the system has an empty name"),
        ),
        seen_by_schema=True,
    ),
    "a reference to no dictionary": Wrong(
        ((SSD, 'dictionary="bus"', 'dictionary="buss"'),),
        ((SSD, "buss", "bus_entry stands for the signal dictionary 'buss', which is none. Did you mean 'bus'?"),),
    ),
    "a connector that is not a signal": Wrong(
        ((BUS, 'name="position"', 'name="place"'),),
        (
            (
                SSD,
                'name="position" kind="inout"',
                "connector bus_entry.position is not a signal of the dictionary 'bus'. Known: place.",
            ),
        ),
    ),
    "a signal of another type": Wrong(
        ((BUS, '<ssc:Real unit="mm"/>', "<ssc:Boolean/>"),),
        ((SSD, 'name="position" kind="inout"', "connector bus_entry.position is of type Real, but Boolean in the dictionary"),),
    ),
    "a signal's unit not declared": Wrong(
        ((BUS, '<ssc:Real unit="mm"/>', '<ssc:Real unit="cm"/>'),),
        ((BUS, '"cm"', "signal position: unit 'cm' is not declared in Units. Did you mean 'mm'?"),),
    ),
    "a signal with two sources": Wrong(
        (
            (
                SSD,
                "</ssd:SignalDictionaryReference>",
                '</ssd:SignalDictionaryReference>\n<ssd:SignalDictionaryReference name="second" dictionary="bus"><ssd:Connectors><ssd:Connector name="position" kind="input"><ssc:Real unit="mm"/></ssd:Connector></ssd:Connectors></ssd:SignalDictionaryReference>',
            ),
            (
                SSD,
                COMMAND_OUT,
                COMMAND_OUT
                + '\n<ssd:Connection startElement="command" startConnector="out" endElement="second" endConnector="position"/>',
            ),
        ),
        (
            (
                SSD,
                'name="second"',
                "signal 'position' of the dictionary 'bus' is driven twice: by plant.position and by command.out",
            ),
        ),
    ),
    # the experiment, variants, versions, and several at once
    "an end before the beginning": Wrong(
        ((SSD, 'startTime="0" stopTime="5"', 'startTime="6" stopTime="5"'),),
        ((SSD, 'startTime="6"', "default experiment: stopTime = 5 s is not after startTime = 6 s"),),
    ),
    "a step longer than the run": Wrong(
        ((SSD, 'stopTime="5"', 'stopTime="0.005"'),),
        (
            (
                SSD,
                "<ssd:DefaultExperiment",
                "default experiment: a step of 0.01 s does not fit into a run of 0.005 s; give a step of 0.005 s at most",
            ),
        ),
    ),
    "a step too small for the run": Wrong(
        ((SSD, 'startTime="0" stopTime="5"', 'startTime="0" stopTime="1e18"'),),
        (
            (
                SSD,
                "<ssd:DefaultExperiment",
                "default experiment: steps of 0.01 s from 0.0 s to 1e+18 s are too small or too many (1e+08 at most)",
            ),
        ),
    ),
    "a step of no size": Wrong(
        ((SSD, 'baseStepSize="0.01"', 'baseStepSize="-0.01"'),),
        ((SSD, "<ssc:Annotation", "annotation FixedStepAlgorithm: baseStepSize = '-0.01' is not a number greater than 0"),),
    ),
    "a wrong variant": Wrong(
        (),
        (
            (
                "Variant.ssd",
                "comand",
                "connection to command.shaper.comand: command.shaper has no connector 'comand'. Did you mean 'command'?",
            ),
        ),
        change=_variant,
    ),
    "a version to come": Wrong(
        ((SSD, 'version="1.0" name="lift"', 'version="3.0" name="lift"'),),
        ((SSD, 'version="3.0"', "version '3.0'; of the SSP standard, versions 1.0 and 2.0 are known"),),
        seen_by_schema=True,
    ),
    "a misspelt kind": Wrong(
        ((SSD, 'name="acceleration" kind="output"', 'name="acceleration" kind="outpt"'),),
        (
            (
                SSD,
                "outpt",
                "element 'ssd:Connector', attribute 'kind': [facet 'enumeration'] The value 'outpt' is not an element of the set {'input', 'output', 'parameter', 'calculatedParameter', 'inout'}",
            ),
            (SSD, "outpt", "connector plant.acceleration is of kind outpt, but output in MassSpringDamper.fmu"),
        ),
        seen_by_schema=True,
    ),
    "a misspelt element inline": Wrong(
        ((SSD, '<ssv:Real value="2" unit="t"/>', '<ssv:Reel value="2" unit="t"/>'),),
        (
            (
                SSD,
                "Reel",
                "element 'ssv:Reel': This element is not expected. Expected is one of ( ssv:Real, ssv:Integer, ssv:Boolean, ssv:String, ssv:Enumeration, ssv:Binary )",
            ),
        ),
        seen_by_schema=True,
    ),
    "a connector without a name": Wrong(
        ((SSD, '<ssd:Connector name="acceleration" kind', "<ssd:Connector kind"),),
        ((SSD, "<ssd:Connector kind", "element 'ssd:Connector': The attribute 'name' is required but missing"),),
        seen_by_schema=True,
    ),
    "four at once": Wrong(
        (
            (SSD, 'endConnector="command"/>', 'endConnector="comand"/>'),
            (SSD, "<ssc:Boolean/></ssd:Connector>", "<ssc:Integer/></ssd:Connector>"),
            (COMMON, "plant.damping", "plant.dampening"),
            (SSD, 'stopTime="5"', 'stopTime="soon"'),
        ),
        (
            (SSD, '"moving"', "connector command.profile.moving is of type Integer, but Boolean in MotionProfile.fmu"),
            (
                SSD,
                "comand",
                "connection to command.shaper.comand: command.shaper has no connector 'comand'. Did you mean 'command'?",
            ),
            (
                SSD,
                "soon",
                "element 'ssd:DefaultExperiment', attribute 'stopTime': 'soon' is not a valid value of the atomic type 'xs:double'",
            ),
            (
                COMMON,
                "dampening",
                "parameter plant.dampening: the system has nothing called 'plant.dampening', so the value has no effect. Did you mean 'plant.damping'?",
            ),
        ),
        seen_by_schema=True,
    ),
}
