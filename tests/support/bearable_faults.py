"""Faults of model descriptions that do not matter for a run, each as a change of the faulty FMU's description (see faulty_fmus.py)."""

from __future__ import annotations

from collections.abc import Callable

Change = Callable[[str], str]


def changed(old: str, new: str) -> Change:
    """Write `new` in the place of `old`, which must be there."""

    def change(text: str) -> str:
        assert old in text, old
        return text.replace(old, new, 1)

    return change


def before(mark: str, new: str) -> Change:
    return changed(mark, new + mark)


REAL = 'causality="parameter" variability="fixed"><Real start="0"/>'
FIRST_OUTPUT = '<Unknown index="2" dependencies=""/>'
TYPES = '<TypeDefinitions><SimpleType name="T">{}</SimpleType></TypeDefinitions>'
UNITS = "<UnitDefinitions>{}</UnitDefinitions>"
LOCAL = '<ScalarVariable name="{}" valueReference="{}" causality="local" variability="{}"><Real{}/></ScalarVariable>'
SPARE = LOCAL.format("spare", 2, "continuous", "{}")
END = "</ModelVariables>"

# name: (change, words of the finding)
FAULTS2: dict[str, tuple[Change, str]] = {
    "start beside calculated": (changed('variability="continuous"><Real/>', 'variability="continuous" initial="calculated"><Real start="1"/>'), 'initial="calculated" but provides a start value'),
    "no derivatives": (changed("</Outputs>", "</Outputs><Derivatives/>"), "Derivatives.*Missing child element"),
    "constant parameter": (changed(REAL, REAL.replace("fixed", "constant")), 'causality="parameter" and variability="constant".*is not allowed'),
    "continuous parameter": (changed(REAL, REAL.replace("fixed", "continuous")), 'causality="parameter" and variability="continuous"'),
    "parameter without variability": (changed(REAL, REAL.replace(' variability="fixed"', "")), 'causality="parameter" and variability="continuous"'),
    "tunable and calculated": (changed(REAL, REAL.replace('"fixed"', '"tunable" initial="calculated"')), 'variability="tunable"'),
    "unknown causality": (before(END, SPARE.format("").replace('"local"', '"Local"')), "causality = 'Local' is none"),
    "causality of FMI 1.0": (before(END, SPARE.format("").replace('"local"', '"internal"')), "'internal'.*taken as local"),
    "unknown variability": (before(END, LOCAL.format("spare", 2, "static", "")), "variability = 'static' is none"),
    "attribute that is none": (changed("<Real/>", '<Real colour="red"/>'), "'colour' is not allowed"),
    "attribute of a type that is none": (before("<ModelVariables>", TYPES.format('<Real colour="red"/>')), "'colour' is not allowed"),
    "type without a type": (before("<ModelVariables>", TYPES.format("")), "SimpleType 'T' .* has no type"),
    "item without a value": (before("<ModelVariables>", TYPES.format('<Enumeration><Item name="a"/></Enumeration>')), "Item 'a' .* no integer value"),
    "type that is not defined": (changed("<Real/>", '<Real declaredType="nothing"/>'), "declaredType = 'nothing' is not defined"),
    "unit that is not defined": (changed("<Real/>", '<Real unit="furlong"/>'), 'unit "furlong" .*not defined'),
    "display unit of no unit": (changed("<Real/>", '<Real displayUnit="deg"/>'), 'display unit "deg" .* has no unit'),
    "display unit of an unknown unit": (changed("<Real/>", '<Real unit="x" displayUnit="deg"/>'), 'display unit "deg" .* has no unit'),
    "unit twice": (before("<ModelVariables>", UNITS.format('<Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m"><BaseUnit s="1"/></Unit>')), "'m' .* is defined twice, differently"),
    "half an exponent": (before("<ModelVariables>", UNITS.format('<Unit name="m"><BaseUnit m="0.5"/></Unit>')), "m cannot be; its definition does not count"),
    "factor with a comma": (before("<ModelVariables>", UNITS.format('<Unit name="m"><BaseUnit m="1" factor="1,5"/></Unit>')), "factor cannot be"),
    "bound that is none": (changed("<Real/>", '<Real min="low"/>'), "min = 'low' is not a number"),
    "derivative of nothing": (changed("<Real/>", '<Real derivative="99"/>'), "derivative .*'99' is not a variable"),
    "order of elements": (lambda text: text.replace("<ModelStructure>", "<!---->").replace("<ModelVariables>", "<ModelStructure/><ModelVariables>").replace("<!---->", "<ModelStructure>"), "ModelStructure.*not expected"),
    "no structure": (lambda text: text[: text.index("<ModelStructure>")] + "</fmiModelDescription>", "Missing child element"),
    "no outputs in the structure": (lambda text: text.replace("<Outputs>", "<!--").replace("</Outputs>", "-->"), "Outputs must have exactly one entry"),
    "dependency of nothing": (changed(FIRST_OUTPUT, FIRST_OUTPUT.replace('""', '"1 99"')), "index 99, which is not a variable's"),
    "dependencies counted from zero": (changed(FIRST_OUTPUT, FIRST_OUTPUT.replace('""', '"0"')), "index 0, which is not a variable's"),
    "kinds for other dependencies": (changed(FIRST_OUTPUT, FIRST_OUTPUT.replace('/>', ' dependenciesKind="fixed dependent"/>')), "number of elements in the dependencies"),
    "name twice": (before(END, LOCAL.format("spare", 2, "continuous", "") + LOCAL.format("spare", 0, "continuous", "")), '"spare".*is not unique'),
    "name that is none": (lambda text: before(END, LOCAL.format("a b", 2, "continuous", ""))(text).replace('guid="', 'variableNamingConvention="structured" guid="'), '"a b" .*not a legal variable name'),
    "input without a start": (changed('variability="continuous"><Real start="0"/>', 'variability="continuous"><Real/>'), '"input".*has no start value'),
    "flags in capitals": (changed('StepSize="true"', 'StepSize="True"'), "not a valid value of the atomic type"),
    "number that is none": (changed('guid="', 'numberOfEventIndicators="none" guid="'), "numberOfEventIndicators = 'none' is not an integer"),
    "end that is none": (before("<ModelVariables>", '<DefaultExperiment stopTime="soon"/>'), "stopTime = 'soon' is not a finite number"),
    "version with a third number": (changed('fmiVersion="2.0"', 'fmiVersion="2.0.4"'), "'2.0.4' is read as '2.0'"),
    "white space before": (lambda text: "\n " + text, "white space before the XML declaration"),
    "another encoding": (changed("UTF-8", "UTF-16"), "not in its declared encoding"),
    "element that is none": (before("<ModelVariables>", "<Nothing><Real/></Nothing>"), "'?Nothing'?: This element is not expected"),
}  # fmt: skip

FLOAT = '<Float64 name="output" valueReference="1" causality="output" variability="continuous"/>'
FAULTS3: dict[str, tuple[Change, str]] = {
    "annotations in an order": (changed("</ModelStructure>", '</ModelStructure><Annotations><Annotation type="a.b" order="1"/></Annotations>'), "'order' is not allowed"),
    "start beside calculated": (changed(FLOAT, FLOAT.replace("/>", ' initial="calculated" start="1"/>')), "provides a start value"),
    "constant parameter": (changed('causality="parameter" variability="fixed"', 'causality="parameter" variability="constant"'), 'variability="constant"'),
    "continuous parameter": (changed('causality="parameter" variability="fixed"', 'causality="parameter" variability="continuous"'), 'variability="continuous"'),
    "alias without a name": (changed(FLOAT, FLOAT.replace("/>", "><Alias/></Float64>")), "an alias without a name"),
    "value reference twice": (before("</ModelVariables>", '<Boolean name="spare2" valueReference="0" causality="local"/>'), "same value reference"),
    "no independent variable": (lambda text: text.replace('"independent"', '"local"'), "Exactly one independent variable"),
    "kinds for other dependencies": (changed('<Output valueReference="1" dependencies=""/>', '<Output valueReference="1" dependencies="" dependenciesKind="fixed"/>'), "number of elements"),
    "dependency of nothing": (changed('<Output valueReference="1" dependencies=""/>', '<Output valueReference="1" dependencies="77"/>'), "valueReference 77, which is not a variable's"),
    "derivative of nothing": (changed(FLOAT, FLOAT.replace("/>", ' derivative="99"/>')), "derivative .*'99' is not a variable"),
    "flags in capitals": (changed('hasEventMode="true"', 'hasEventMode="True"'), "not a valid value of the atomic type"),
    "attribute that is none": (changed(FLOAT, FLOAT.replace("/>", ' colour="red"/>')), "'colour' is not allowed"),
}  # fmt: skip
