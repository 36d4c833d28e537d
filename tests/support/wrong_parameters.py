"""Systems that are wrong in their parameters."""

from __future__ import annotations

from right_system import COMMON, DISTANCE, DURATION, KIND, MAPPING, SET, SSD, Wrong

from shaper_fmu.kinds.shapers import Shaper

PARAMETERS: dict[str, Wrong] = {
    "a parameter that matches nothing": Wrong(
        ((COMMON, "plant.damping", "plant.dampening"),),
        (
            (
                COMMON,
                "dampening",
                "parameter plant.dampening: the system has nothing called 'plant.dampening', so the value has no effect. Did you mean 'plant.damping'?",
            ),
        ),
    ),
    "a parameter of a whole set that matches nothing": Wrong(
        ((SET, "plant.mass", "plnt.mass"),),
        (
            (
                SET,
                "plnt",
                "parameter plnt.mass: the system has nothing called 'plnt.mass', so the value has no effect. Did you mean 'plant.mass'?",
            ),
        ),
    ),
    "an output as a parameter": Wrong(
        ((COMMON, "plant.damping", "plant.position"),),
        ((COMMON, "plant.position", "parameter plant.position: plant.position is not a parameter; its kind is output"),),
    ),
    "below the minimum": Wrong(
        ((COMMON, DURATION, DURATION.replace("1.5", "-1.5")),),
        (
            (
                COMMON,
                "-1.5",
                "parameter command.profile.duration -> command.profile.duration = -1.5 s is less than the FMU's minimum 1e-09 s",
            ),
        ),
    ),
    "above the maximum": Wrong(
        ((COMMON, 'modes"><ssv:Integer value="1"', 'modes"><ssv:Integer value="5"'),),
        ((COMMON, 'value="5"', "parameter command.shaper.modes -> command.shaper.modes = 5 is more than the FMU's maximum 4"),),
    ),
    "below the minimum once mapped": Wrong(
        ((MAPPING, 'factor="1000"', 'factor="-1000"'),),
        (
            (
                MAPPING,
                "-1000",
                "mapping of 'pd.p' -> controller.proportional_gain = -3000 N/m is less than the FMU's minimum 0.0 N/m",
            ),
        ),
    ),
    "no number": Wrong(
        ((COMMON, DURATION, DURATION.replace("1.5", "soon")),),
        (
            (COMMON, "soon", "element 'ssv:Real', attribute 'value': 'soon' is not a valid value of the atomic type 'xs:double'"),
            (COMMON, "soon", "parameter command.profile.duration -> command.profile.duration: 'soon' is not a value of kind real"),
        ),
        seen_by_schema=True,
    ),
    "infinitely much": Wrong(
        ((COMMON, DURATION, DURATION.replace("1.5", "INF")),),
        ((COMMON, "INF", "parameter command.profile.duration -> command.profile.duration = inf is not a finite number"),),
    ),
    "a real for an integer": Wrong(
        ((COMMON, 'modes"><ssv:Integer value="1"', 'modes"><ssv:Real value="1"'),),
        ((COMMON, "modes", "parameter command.shaper.modes -> command.shaper.modes: a real cannot become an integer"),),
    ),
    "a text for a boolean": Wrong(
        ((COMMON, '<ssv:Boolean value="true"/>', '<ssv:String value="true"/>'),),
        (
            (
                COMMON,
                "ssv:String",
                "parameter command.shaper.shape_mode[1] -> command.shaper.shape_mode[1]: a string cannot become a boolean",
            ),
        ),
    ),
    "an item unknown": Wrong(
        ((COMMON, KIND, KIND.replace("s_curve", "scurve")),),
        (
            (
                COMMON,
                "scurve",
                "parameter command.profile.profile -> command.profile.profile: 'scurve' is not a value of profile. Did you mean 's_curve'?",
            ),
        ),
    ),
    "an item's number unknown": Wrong(
        ((COMMON, 'shaper.shaper"><ssv:Integer value="3"', 'shaper.shaper"><ssv:Integer value="33"'),),
        (
            (
                COMMON,
                "33",
                f"parameter command.shaper.shaper -> command.shaper.shaper: shaper = 33 is not an item of the enumeration: {', '.join(f'{item.name} ({item.value})' for item in Shaper)}",
            ),
        ),
    ),
    "a parameter in another unit": Wrong(
        ((SSD, '<ssc:Unit name="t"><ssc:BaseUnit kg="1" factor="1000"/>', '<ssc:Unit name="t"><ssc:BaseUnit s="1"/>'),),
        ((SSD, 'unit="t"', "parameter mass -> plant.mass: unit t does not convert to kg"),),
    ),
    "a parameter's unit not declared": Wrong(
        ((COMMON, DISTANCE, DISTANCE.replace('unit="mm"', 'unit="cm"')),),
        ((COMMON, '"cm"', "parameter command.distance: unit 'cm' is not declared in Units. Did you mean 'mm'?"),),
    ),
    "a parameter twice": Wrong(
        ((COMMON, DURATION, f"{DURATION}\n{DURATION.replace('1.5', '2.5')}"),),
        ((COMMON, "2.5", "parameter 'command.profile.duration' is there twice"),),
    ),
    "no such parameter set": Wrong(
        ((SSD, 'source="resources/common.ssv"', 'source="resources/commons.ssv"'),),
        (
            (
                SSD,
                "commons",
                "parameter binding of the system: 'resources/commons.ssv' is missing in the archive. Did you mean 'resources/common.ssv'?",
            ),
        ),
    ),
    "a binding without anything": Wrong(
        ((SSD, '<ssd:ParameterBinding source="resources/common.ssv"/>', "<ssd:ParameterBinding/>"),),
        ((SSD, "<ssd:ParameterBinding/>", "parameter binding of the system has neither a source nor values inline"),),
    ),
    "a parameter set of another format": Wrong(
        ((SSD, 'source="resources/common.ssv"', 'type="text/csv" source="resources/common.ssv"'),),
        (
            (
                SSD,
                "text/csv",
                "parameter binding of the system is of type 'text/csv', which is not read; the standard's is application/x-ssp-parameter-set",
            ),
        ),
    ),
    "a mapping of what the set has not": Wrong(
        ((MAPPING, 'source="pd.d"', 'source="d"'),),
        ((MAPPING, 'source="d"', "mapping of 'd': no such parameter in resources/gains.ssv. Known: pd.p, pd.d."),),
    ),
    "a mapping to nothing": Wrong(
        ((MAPPING, 'target="derivative_gain"', 'target="derivativ_gain"'),),
        (
            (
                MAPPING,
                "derivativ_gain",
                "mapping of 'pd.d': controller has nothing called 'derivativ_gain', so the value has no effect. Did you mean 'derivative_gain'?",
            ),
        ),
    ),
    "two parameters mapped to one": Wrong(
        ((MAPPING, 'target="derivative_gain"', 'target="proportional_gain"'),),
        ((MAPPING, 'source="pd.d"', "two parameters are mapped to 'proportional_gain'"),),
    ),
    "no such mapping": Wrong(
        ((SSD, "resources/gains.ssm", "resources/gain.ssm"),),
        (
            (
                SSD,
                "gain.ssm",
                "parameter mapping of controller: 'resources/gain.ssm' is missing in the archive. Did you mean 'resources/gains.ssm'?",
            ),
        ),
    ),
}
