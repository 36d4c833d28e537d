"""Small archives with one fault each, of which the checking and the running of archives once told different things, or none.

Each with its findings and whether they keep the archive from being read ("load"), or from being run ("run"), or neither ("note").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ssp_archives import binding, bindings, component, connection, connectors, linear, ssd, ssv, system, table

PLANT, PULSE, PROFILE, SHAPER = "MassSpringDamper", "PulseTrain", "MotionProfile", "InputShaper"


@dataclass(frozen=True)
class Broken:
    """What is in the root system, further files, and what is found: words -> "load", "run" or "note"."""

    root: str
    found: dict[str, str]
    files: dict[str, bytes] = field(default_factory=dict)
    version: str = "1.0"
    change: Callable[[dict[str, bytes]], None] | None = None
    more: str = ""


def part(name: str, fmu: str, *interface: str, bound: str = "") -> str:
    """A component that declares its connectors."""
    inner = connectors(*interface) + (bindings(bound) if bound else "")
    return f'<ssd:Component name="{name}" source="resources/{fmu}.fmu">{inner}</ssd:Component>'


def reference(name: str, *interface: str) -> str:
    return f'<ssd:SignalDictionaryReference name="{name}" dictionary="bus">{connectors(*interface)}</ssd:SignalDictionaryReference>'


def dictionary(inner: str = "", **attributes: str) -> str:
    text = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f'<ssd:SignalDictionaries><ssd:SignalDictionary name="bus"{text}>{inner}</ssd:SignalDictionary></ssd:SignalDictionaries>'


SIGNAL = (
    '<ssb:SignalDictionary version="1.0"><ssb:DictionaryEntry name="force"><ssc:Real/></ssb:DictionaryEntry></ssb:SignalDictionary>'
)
TRAIN, MASS = part("train", PULSE, "pulse output"), part("plant", PLANT, "force input", "position output m")
PUSHED = connection("train.pulse", "plant.force")
THROUGH = connection("train.pulse", "out.force") + connection("in.force", "plant.force")
IN_AND_OUT = TRAIN + MASS + reference("out", "force inout") + reference("in", "force inout")


def one(bound: str) -> str:
    """A plant alone with a binding."""
    return system("", part("plant", PLANT, bound=bound))


def _own_set(files: dict[str, bytes]) -> None:
    files["parameter_sets/own.ssv"] = ssv("plant.force Real 2").encode()


BROKEN: dict[str, Broken] = {
    # what the check saw, and the run bore in silence
    "a connector not declared": Broken(
        system("", component("train", PULSE) + MASS, PUSHED),
        {"connection to train.pulse: train has no connector 'pulse'.": "note"},
    ),
    "an input with a value outside its limits": Broken(
        one(binding("mass Real -1")),
        {
            "parameter mass -> plant.mass = -1 kg is less than the FMU's minimum": "note",
        },
    ),
    "two dictionaries of one name": Broken(
        system("", TRAIN + MASS, PUSHED)
        + "<ssd:SignalDictionaries>"
        + 2 * f'<ssd:SignalDictionary name="bus">{SIGNAL}</ssd:SignalDictionary>'
        + "</ssd:SignalDictionaries>",
        {"signal dictionary 'bus' is there twice": "note"},
    ),
    "a parameter twice": Broken(one(binding("mass Real 2", "mass Real 3")), {"parameter 'mass' is there twice": "note"}),
    "two parameters for one": Broken(
        one(
            binding(
                "a Real 2",
                "b Real 3",
                mapping='<ssm:MappingEntry source="a" target="mass"/><ssm:MappingEntry source="b" target="mass"/>',
            )
        ),
        {"two parameters are mapped to 'mass'": "note"},
    ),
    "a mapping of what is not there": Broken(
        one(binding("a Real 2", mapping='<ssm:MappingEntry source="b" target="mass"/>')),
        {"mapping of 'b': no such parameter in SystemStructure.ssd. Known: a.": "note"},
    ),
    "an output of a system that is a parameter's": Broken(
        system("", TRAIN + part("plant", PLANT, "mass parameter kg"), connection("train.pulse", "plant.mass")),
        {
            "train.pulse -> plant.mass: an output of an element and a parameter of an element cannot be connected": "note",
            "train.pulse -> plant.mass: train.pulse feeds the parameter plant.mass; this master connects only inputs": "load",
        },
    ),
    # what the run refused, and the check told only if there was nothing else, or not at all
    "a dictionary that cannot be read": Broken(
        system("", IN_AND_OUT, THROUGH) + dictionary(source="bus.ssb"),
        {"not an SSP signal dictionary": "load"},
        {"bus.ssb": ssv().encode()},
    ),
    "a dictionary without anything": Broken(
        system("", IN_AND_OUT, THROUGH) + dictionary(),
        {"signal dictionary 'bus' has neither a source nor entries inline": "note"},
    ),
    "a signal that the same output drives twice": Broken(
        system("", IN_AND_OUT, THROUGH + connection("train.pulse", "in.force")) + dictionary(SIGNAL),
        {"signal 'force' of the dictionary 'bus' is driven twice: by train.pulse and by train.pulse": "load"},
    ),
    "a value that its way spoils": Broken(
        system(
            connectors("modes parameter") + bindings(binding("modes Integer 1")),
            part("shaper", SHAPER, "modes parameter"),
            connection("modes", "shaper.modes", linear(1.5)),
        ),
        {
            "modes -> shaper.modes: a linear transformation is for real numbers only": "load",
            "parameter modes -> modes -> shaper.modes: modes = 1.5 is not of type Integer": "load",
        },
    ),
    "a single element of an array": Broken(
        system("", TRAIN + MASS, connection("train.pulse", "plant.force", endIndices="1")),
        {"train.pulse -> plant.force: connections of single elements of arrays are not read": "load"},
        version="2.0",
    ),
    "an output of the system in another unit": Broken(
        system(connectors("x output s"), MASS, connection("plant.position", "x")),
        {"plant.position -> x: unit m does not convert to s": "run"},
    ),
    "a set for what something feeds": Broken(
        system("", TRAIN + MASS, PUSHED),
        {"parameter plant.force -> plant.force: plant.force is fed by train.pulse; setting it would have no effect": "run"},
        change=_own_set,
    ),
    "a value of a text's type": Broken(
        one(binding("mass Integer 1_0")),
        {"'1_0' is not a valid value of the atomic type": "note", "parameter mass -> plant.mass: '1_0' is not a value": "load"},
    ),
    "infinitely much": Broken(
        one(binding("mass Real INF")),
        {"parameter mass -> plant.mass = inf is not a finite number": "note"},
    ),
    "a source that leads out": Broken(
        one('<ssd:ParameterBinding source="../p.ssv"/>'),
        {"parameter binding of plant: source '../p.ssv' leads out of the archive; a path relative to the description": "load"},
    ),
    "a set inside a system": Broken(
        bindings('<ssd:ParameterBinding source="p.ssv" sourceBase="component"/>') + system("", MASS),
        {"parameter binding of the system: sourceBase is 'component', but the system is not a component with a source": "load"},
    ),
    "a set that the FMU has not": Broken(
        one('<ssd:ParameterBinding source="resources/p.ssv" sourceBase="component"/>'),
        {"parameter binding of plant: 'resources/p.ssv' is missing in MassSpringDamper.fmu": "load"},
        {"resources/resources/p.ssv": ssv("mass Real 2").encode()},
    ),
    # other structures
    "a connector that the inner system has not": Broken(
        system(
            "",
            TRAIN
            + f'<ssd:Component name="part" type="application/x-ssp-definition" source="part.ssd">{connectors("g input")}</ssd:Component>',
            connection("train.pulse", "part.g"),
        ),
        {"connection to part.g: the system in part.ssd has no connector 'g'. Known: f.": "load"},
        {"part.ssd": ssd(system(connectors("f input"), MASS, connection("f", "plant.force")))},
    ),
    "a fault in an inner system": Broken(
        system("", '<ssd:Component name="part" type="application/x-ssp-definition" source="part.ssd"/>'),
        {"connection to plant.forze: plant has no connector 'forze'. Did you mean 'force'?": "load"},
        {"part.ssd": ssd(system(connectors("f input"), MASS, connection("f", "plant.forze")))},
    ),
    "no such inner archive": Broken(
        system("", '<ssd:Component name="part" type="application/x-ssp-package" source="resources/part.ssp"/>'),
        {"component 'part': 'resources/part.ssp' is missing in the archive.": "load"},
    ),
    "a mapping of a real": Broken(
        system(
            "",
            part("profile", PROFILE, "position output m") + MASS,
            connection("profile.position", "plant.force", table("Integer", of_1="2")),
        ),
        {
            "profile.position -> plant.force: an IntegerMappingTransformation, but the source is a real": "load",
            "profile.position -> plant.force: an IntegerMappingTransformation, but the target is a real": "load",
        },
    ),
}
