"""Repairs harmless faults in foreign model descriptions, and refuses the others.

Repaired in the parsed tree, so that fmpy can read it, and reported: what no run needs, or where the cautious reading is
clear (an impossible dependency counts as undeclared, a unit whose definition cannot be read is a name alone). Refused: what
leaves open which value a call of the FMU moves, or which file is loaded as its library.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator

from lxml import etree

from shaper_fmu.errors import ArchiveError
from shaper_fmu.master.array_sizes import check_dimensions
from shaper_fmu.master.description1 import mend1
from shaper_fmu.master.mended_structure import mend_structure
from shaper_fmu.units import BASE

_TYPES = {
    1: ("Real", "Integer", "Boolean", "String", "Enumeration"),
    2: ("Real", "Integer", "Boolean", "String", "Enumeration"),
    3: (
        "Float32", "Float64", "Boolean", "String", "Binary", "Enumeration", "Clock",
        *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)),
    ),
}  # fmt: skip
_INITIAL = {"parameter": "exact", "structuralParameter": "exact", "input": "exact", "independent": None}
_CAUSALITIES = (*_INITIAL, "calculatedParameter", "output", "local", "internal", "none")  # the last two of FMI 1.0
_LEGAL = {  # (variability, causality) that have a default of `initial`; fmpy knows it
    *((variability, causality) for variability in ("fixed", "tunable") for causality in ("structuralParameter", "parameter")),
    *((variability, causality) for variability in ("fixed", "tunable") for causality in ("calculatedParameter", "local")),
    *((variability, causality) for variability in ("discrete", "continuous") for causality in ("input", "output", "local")),
    ("constant", "output"), ("constant", "local"), ("continuous", "independent"),
}  # fmt: skip
_VARIABILITIES = ("constant", "fixed", "tunable", "discrete", "continuous", "parameter")
_KNOWN = {"causality": _CAUSALITIES, "variability": _VARIABILITIES, "initial": ("exact", "approx", "calculated")}
_TYPE_ATTRIBUTES = {
    "name",
    "description",
    "quantity",
    "unit",
    "displayUnit",
    "relativeQuantity",
    "min",
    "max",
    "nominal",
    "unbounded",
}
_LONGEST_IDENTIFIER = 200
_MOST_REFERENCE = 2**32
_INTEGER = re.compile(r"\s*[+-]?\d{1,30}\s*")


def mended(root: etree._Element, version: int, where: str) -> list[str]:
    """Repair the description of an FMU of this major version of FMI; returns the findings.

    Raises ArchiveError, which begins with `where`.
    """
    findings: list[str] = []
    etree.strip_tags(root, etree.ProcessingInstruction)
    if root.find("ModelVariables") is None:
        etree.SubElement(root, "ModelVariables")
    for step in (_mend_root, _mend_interfaces, _mend_units, _mend_types, _mend_variables):
        findings += step(root, version, where)
    if version == 1:
        findings += mend1(root, where)
    else:
        findings += check_dimensions(root, where)
        findings += mend_structure(root, version, where)
    return findings


def whole(text: str | None) -> int | None:
    """The integer in a text; None if it is not one."""
    return int(text) if text is not None and _INTEGER.fullmatch(text) else None


def _number(text: str) -> float | None:
    """The finite number in a text; None if it is not one."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _forget(element: etree._Element, attribute: str, why: str) -> str:
    """Remove an attribute; returns the message."""
    return f"{element.tag} (line {element.sourceline}): {attribute} = {str(element.attrib.pop(attribute))!r} {why}"


def _numbers(element: etree._Element, attributes: tuple[str, ...], of: Callable[[str], object], kind: str) -> Iterator[str]:
    """Forget attributes that are no numbers."""
    for attribute in attributes:
        text = element.get(attribute)
        if text is not None and of(text) is None:
            yield _forget(element, attribute, f"is not {kind}; taken as not given")


def _mend_root(root: etree._Element, version: int, where: str) -> Iterator[str]:
    token = "instantiationToken" if version == 3 else "guid"
    if root.get(token) is None:
        root.set(token, "")
        yield f"there is no {token}; taken as empty"
    yield from _numbers(root, ("numberOfEventIndicators",), whole, "an integer")
    if version == 1 and whole(root.get("numberOfContinuousStates")) is None:
        root.set("numberOfContinuousStates", "0")
    for experiment in root.findall("DefaultExperiment"):
        yield from _numbers(experiment, ("startTime", "stopTime", "tolerance", "stepSize"), _number, "a finite number")


def _mend_interfaces(root: etree._Element, version: int, where: str) -> Iterator[str]:
    interfaces = [root] if version == 1 else [e for kind in ("ModelExchange", "CoSimulation") for e in root.findall(kind)]
    for interface in interfaces:
        identifier = interface.get("modelIdentifier")
        problem = _wrong_identifier(identifier)
        if problem:
            raise ArchiveError(f"{where}: modelIdentifier of {interface.tag} {problem}")
        for attribute, text in interface.attrib.items():
            if str(text).strip() != text or (str(text).lower() in ("true", "false") and text not in ("true", "false")):
                interface.set(attribute, str(text).strip().lower() if str(text).strip().lower() in ("true", "false") else str(text))
        yield from _numbers(interface, ("maxOutputDerivativeOrder", "recommendedIntermediateInputSmoothness"), whole, "an integer")
        yield from _numbers(interface, ("fixedInternalStepSize",), _number, "a finite number")
    for kind in ("ModelExchange", "CoSimulation"):
        if version > 1 and len(root.findall(kind)) > 1:
            yield f"there are {len(root.findall(kind))} elements {kind}; the last one counts"


def _wrong_identifier(identifier: str | None) -> str | None:
    """Why a model identifier is not a name of a file in the folder of libraries."""
    if not identifier or not identifier.strip():
        return "is missing: it is the name of the library"
    if len(identifier.encode()) > _LONGEST_IDENTIFIER:
        return f"has {len(identifier.encode())} bytes, more than the {_LONGEST_IDENTIFIER} that are accepted"
    if identifier in (".", "..") or any(letter in "/\\:" or not letter.isprintable() for letter in identifier):
        return f"is {identifier!r}: not the name of a library but a path; a name without / \\ : is needed"
    return None


def _mend_units(root: etree._Element, version: int, where: str) -> Iterator[str]:
    if version == 1:
        return
    seen: dict[str, etree._Element] = {}
    for unit in root.findall("UnitDefinitions/Unit"):
        name, bases = str(unit.get("name")), unit.findall("BaseUnit")
        first = seen.setdefault(name, unit)
        if first is not unit and _meaning(first) != _meaning(unit):
            yield f"unit {name!r} (line {unit.sourceline}) is defined twice, differently; its definitions do not count"
            for base in [*first.findall("BaseUnit"), *bases]:
                base.getparent().remove(base)  # pyright: ignore[reportOptionalMemberAccess]
            bases = []
        for base in bases:
            wrong = [a for a in BASE if base.get(a) is not None and whole(base.get(a)) is None]
            wrong += [a for a in ("factor", "offset") if base.get(a) is not None and _number(str(base.get(a))) is None]
            if wrong or _number(str(base.get("factor", "1"))) == 0.0:
                cause = wrong[0] if wrong else "factor"
                yield f"unit {name!r} (line {base.sourceline}): {cause} cannot be; its definition does not count"
                unit.remove(base)
        for display in unit.findall("DisplayUnit"):
            yield from _numbers(display, ("factor", "offset"), _number, "a finite number")


def _meaning(unit: etree._Element) -> list[dict[str, float | None]]:
    found = []
    for base in unit.findall("BaseUnit"):
        values = {str(key): _number(str(value)) for key, value in base.attrib.items()}
        found.append({key: value for key, value in values.items() if value != (1.0 if key == "factor" else 0.0)})
    return found


def _mend_types(root: etree._Element, version: int, where: str) -> Iterator[str]:
    definitions = root.find("TypeDefinitions")
    for definition in list(definitions) if definitions is not None else []:
        if version < 3 and not len(definition):
            yield f"{definition.tag} {definition.get('name')!r} (line {definition.sourceline}) has no type; it does not count"
            definition.getparent().remove(definition)  # pyright: ignore[reportOptionalMemberAccess]
            continue
        typed = definition if version == 3 else definition[0]
        for attribute in set(typed.attrib) - (_TYPE_ATTRIBUTES if version == 3 else _TYPE_ATTRIBUTES - {"name"}):
            del typed.attrib[attribute]  # the schema reports it
        for item in typed.findall("Item"):
            if not item.get("name") or (version > 1 and whole(item.get("value")) is None):
                yield f"Item {item.get('name')!r} (line {item.sourceline}) has no name or no integer value; it does not count"
                typed.remove(item)
            for attribute in set(item.attrib) - {"name", "value", "description"}:
                del item.attrib[attribute]


def _mend_variables(root: etree._Element, version: int, where: str) -> Iterator[str]:
    path = {1: "TypeDefinitions/Type", 2: "TypeDefinitions/SimpleType"}.get(version, "TypeDefinitions/*")
    types = {definition.get("name") for definition in root.findall(path)}
    for variable in root.iterfind("ModelVariables/*"):
        name, line = variable.get("name"), variable.sourceline
        if not name:
            raise ArchiveError(f"{where}: a variable (line {line}) has no name")
        what = f"variable {name!r} (line {line})"
        reference = whole(variable.get("valueReference"))
        if reference is None or not 0 <= reference < _MOST_REFERENCE:
            given = variable.get("valueReference")
            raise ArchiveError(f"{where}: {what}: valueReference is {given!r}, not an integer from 0 to {_MOST_REFERENCE - 1}")
        typed = variable if version == 3 else next((child for child in variable if child.tag in _TYPES[version]), None)
        if typed is None or typed.tag not in _TYPES[version]:
            raise ArchiveError(f"{where}: {what} has no type that FMI {version} knows")
        if typed.get("declaredType") is not None and typed.get("declaredType") not in types:
            yield f"{what}: " + _forget(typed, "declaredType", "is not defined; taken as not given")
        for alias in variable.findall("Alias"):
            if not alias.get("name"):
                yield f"{what} has an alias without a name; it does not count"
                variable.remove(alias)
        yield from _mend_roles(variable, typed, what, version)


def _mend_roles(variable: etree._Element, typed: etree._Element, what: str, version: int) -> Iterator[str]:
    """Causality, variability and initial, so that fmpy finds a meaning for each variable."""
    for attribute, known in _KNOWN.items():
        if variable.get(attribute) is not None and variable.get(attribute) not in known:
            yield f"{what}: " + _forget(variable, attribute, "is none; taken as not given")
    if version > 1 and variable.get("causality") in ("internal", "none"):
        yield f"{what}: " + _forget(variable, "causality", f"is none of FMI {version}; taken as local")
    causality, variability = variable.get("causality", "local"), variable.get("variability")
    if version > 1 and variable.get("initial") is None and variability is not None and (variability, causality) not in _LEGAL:
        initial = _INITIAL.get(causality, "calculated")
        if initial is None:
            yield f"{what}: " + _forget(variable, "variability", "is none of the independent variable")
            variable.set("variability", "continuous")
        else:
            variable.set("initial", initial)  # fmpy's validation reports that the combination is not allowed
    elif version == 2 and variability is None and variable.get("initial") is None and ("continuous", causality) not in _LEGAL:
        variable.set("initial", _INITIAL.get(causality, "calculated"))
    of = whole if "Int" in str(typed.tag) or typed.tag == "Enumeration" else _bound
    yield from (f"{what}: {problem}" for problem in _numbers(typed, ("min", "max"), of, "a number of its type"))


def _bound(text: str) -> float | None:
    """A bound of real numbers, which may be infinite."""
    return math.inf if text.strip().lstrip("+-").upper() == "INF" else _number(text)
