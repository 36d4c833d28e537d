"""Systems that are wrong in their connections."""

from __future__ import annotations

from right_system import COMMAND_OUT, FORCE, SSD, VELOCITY, Wrong

CONNECTIONS: dict[str, Wrong] = {
    "connection to no element": Wrong(
        ((SSD, 'endElement="shaper" endConnector="command"', 'endElement="shapper" endConnector="command"'),),
        ((SSD, "shapper", "connection to command.shapper.command: command has no element 'shapper'. Did you mean 'shaper'?"),),
    ),
    "connection to no connector": Wrong(
        ((SSD, 'endConnector="command"/>', 'endConnector="comand"/>'),),
        (
            (
                SSD,
                "comand",
                "connection to command.shaper.comand: command.shaper has no connector 'comand'. Did you mean 'command'?",
            ),
        ),
    ),
    "connection to no connector of the system": Wrong(
        ((SSD, 'startConnector="shaped_mean" endConnector="out"', 'startConnector="shaped_mean" endConnector="output"'),),
        ((SSD, 'endConnector="output"', "connection to command.output: command has no connector 'output'. Did you mean 'out'?"),),
    ),
    "both ends dangle": Wrong(
        (
            (SSD, 'startElement="plant" startConnector="force"', 'startElement="plan" startConnector="force"'),
            (SSD, 'endConnector="force"', 'endConnector="forze"'),
        ),
        (
            (SSD, "forze", "connection to plan.force: the system has no element 'plan'. Did you mean 'plant'?"),
            (SSD, "forze", "connection to controller.forze: controller has no connector 'forze'. Did you mean 'force'?"),
        ),
    ),
    "an input with two sources": Wrong(
        (
            (
                SSD,
                FORCE,
                FORCE
                + '\n<ssd:Connection startElement="command" startConnector="out" endElement="plant" endConnector="force" suppressUnitConversion="true"/>',
            ),
        ),
        (
            (
                SSD,
                'startConnector="out" endElement="plant"',
                "plant.force is driven twice: by command.out, and by controller.force in line 78",
            ),
        ),
    ),
    "a system's output with two sources": Wrong(
        (
            (
                SSD,
                '<ssd:Connection startConnector="distance"',
                '<ssd:Connection startElement="profile" startConnector="position" endConnector="out"/>\n<ssd:Connection startConnector="distance"',
            ),
        ),
        (
            (
                SSD,
                'startConnector="position" endConnector="out"',
                "command.out is driven twice: by command.profile.position, and by command.shaper.shaped_mean in line 31",
            ),
        ),
    ),
    "an element of an empty name": Wrong(
        (
            (
                SSD,
                'startConnector="shaped_mean" endConnector="out"',
                'startConnector="shaped_mean" endElement="" endConnector="out"',
            ),
        ),
        ((SSD, 'endElement=""', "connection with an empty endElement: leave the attribute out to name a connector of command"),),
    ),
    "output to output": Wrong(
        ((SSD, COMMAND_OUT, COMMAND_OUT.replace('endConnector="reference"', 'endConnector="force"')),),
        (
            (
                SSD,
                'startElement="command" startConnector="out"',
                "command.out -> controller.force: an output of an element and an output of an element cannot be connected",
            ),
        ),
    ),
    "input to input": Wrong(
        ((SSD, COMMAND_OUT, COMMAND_OUT.replace("command", "plant").replace('startConnector="out"', 'startConnector="force"')),),
        (
            (
                SSD,
                'startElement="plant" startConnector="force" endElement="controller" endConnector="reference"',
                "plant.force -> controller.reference: an input of an element and an input of an element cannot be connected",
            ),
        ),
    ),
    "parameter to input of an element": Wrong(
        (
            (
                SSD,
                '<ssd:Connection startConnector="distance"',
                '<ssd:Connection startElement="profile" startConnector="distance" endElement="profile" endConnector="profile"/>\n<ssd:Connection startConnector="distance"',
            ),
        ),
        (
            (
                SSD,
                'endConnector="profile"/>',
                "command.profile.distance -> command.profile.profile: a parameter of an element and a parameter of an element cannot be connected",
            ),
        ),
    ),
    "boolean to real": Wrong(
        (
            (
                SSD,
                'startElement="profile" startConnector="position" endElement="shaper"',
                'startElement="profile" startConnector="moving" endElement="shaper"',
            ),
        ),
        ((SSD, 'startConnector="moving"', "command.profile.moving -> command.shaper.command: a boolean cannot become a real"),),
    ),
    "units that do not convert": Wrong(
        ((SSD, VELOCITY, VELOCITY.replace('startConnector="velocity"', 'startConnector="position"')),),
        (
            (
                SSD,
                'startConnector="position" endElement="controller" endConnector="velocity"',
                "plant.position -> controller.velocity: unit m does not convert to m/s",
            ),
        ),
    ),
    "linear transformation of a boolean": Wrong(
        (
            (
                SSD,
                'startConnector="position" endElement="shaper" endConnector="command"/>',
                'startConnector="moving" endElement="shaper" endConnector="command"><ssc:LinearTransformation factor="2"/></ssd:Connection>',
            ),
        ),
        (
            (
                SSD,
                'factor="2"',
                "command.profile.moving -> command.shaper.command: a linear transformation cannot be applied to a boolean",
            ),
        ),
    ),
    "mapping of items of a real": Wrong(
        (
            (
                SSD,
                '<ssc:LinearTransformation factor="1"/>',
                '<ssc:EnumerationMappingTransformation><ssc:MapEntry source="a" target="b"/></ssc:EnumerationMappingTransformation>',
            ),
        ),
        (
            (
                SSD,
                "MapEntry",
                "plant.velocity -> controller.velocity: an EnumerationMappingTransformation, but the source is a real",
            ),
            (
                SSD,
                "MapEntry",
                "plant.velocity -> controller.velocity: an EnumerationMappingTransformation, but the target is a real",
            ),
        ),
    ),
    "a loop of direct feedthrough": Wrong(
        (
            (
                SSD,
                VELOCITY,
                VELOCITY.replace('startConnector="velocity"', 'startConnector="acceleration" suppressUnitConversion="true"'),
            ),
        ),
        (
            (
                SSD,
                FORCE,
                "a loop acts on itself without delay: controller.force -> plant.force -> plant.acceleration -> controller.velocity -> controller.force; put a delay or a state into it",
            ),
        ),
    ),
}
