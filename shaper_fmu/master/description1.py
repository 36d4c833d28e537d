"""Model descriptions of FMI 1.0 in the terms of FMI 2.0: roles of variables, capabilities, dependencies, units, aliases."""

from __future__ import annotations

from collections.abc import Iterator

from fmpy.model_description import (
    BaseUnit,
    Causality,
    CoSimulation,
    Initial,
    ModelDescription,
    ModelVariable,
    Unit,
    Unknown,
    Variability,
)
from lxml import etree

from shaper_fmu.errors import ArchiveError, ComponentError
from shaper_fmu.units import parse_unit

TOOL = "Implementation/CoSimulation_Tool"
_ALIASES = ("noAlias", "alias", "negatedAlias")
_FLAGS = (
    "canHandleVariableCommunicationStepSize", "canInterpolateInputs", "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions", "canRunAsynchronuously",
)  # fmt: skip


class _NegatedAlias(ModelVariable):
    """A variable that has the negative value of what its reference means; of a boolean, the opposite."""

    __slots__ = ()


def is_negated(variable: ModelVariable) -> bool:
    """Whether a variable has the negative value of what its reference means; of a boolean, the opposite."""
    return isinstance(variable, _NegatedAlias)


def own_scaling(variable: ModelVariable) -> tuple[float, float]:
    """Gain and shift from a variable's value to that of its reference, which are those of the way back, too."""
    if not is_negated(variable):
        return 1.0, 0.0
    return -1.0, 1.0 if variable.type == "Boolean" else 0.0


def turned(variable: ModelVariable, value: float | int | bool) -> float | int | bool:
    """From a variable's value to that of its reference, or back."""
    if not is_negated(variable):
        return value
    return not value if variable.type == "Boolean" else -value


def mend1(root: etree._Element, where: str) -> Iterator[str]:
    """Repair what only FMI 1.0 has; yields the findings. Raises ArchiveError for aliases that leave the sign of a value open."""
    for capabilities in root.findall("Implementation/*/Capabilities"):
        for attribute, text in capabilities.attrib.items():
            capabilities.set(attribute, str(text).strip().lower())
    names = {variable.get("name") for variable in root.iterfind("ModelVariables/*")}
    for variable in root.iterfind("ModelVariables/*"):
        what = f"variable {variable.get('name')!r} (line {variable.sourceline})"
        alias, typed = variable.get("alias", "noAlias"), _typed(variable)
        if alias not in _ALIASES:
            raise ArchiveError(f"{where}: {what}: alias is {alias!r}, none of {', '.join(_ALIASES)}")
        if alias == "negatedAlias" and typed.tag not in ("Real", "Integer", "Boolean"):
            raise ArchiveError(f"{where}: {what} is a negated alias of type {typed.tag}, which has no negative value")
        if variable.get("variability") is None and typed.tag != "Real":
            variable.set("variability", "discrete")  # the default, continuous, is for real numbers alone
        for name in variable.findall("DirectDependency/Name"):
            if str(name.text).strip() not in names:
                yield f"{what}: it depends on {name.text!r}, which is no variable; its dependencies count as not declared"
                _remove_all(variable, "DirectDependency")
                break


def _remove_all(element: etree._Element, tag: str) -> None:
    for child in element.findall(tag):
        element.remove(child)


def _typed(variable: etree._Element) -> etree._Element:
    return next(child for child in variable if child.tag in ("Real", "Integer", "Boolean", "String", "Enumeration"))


def _add_units(description: ModelDescription) -> None:
    """Tell what units mean: FMI 1.0 gives them by name alone, which counts where it is written as in SI."""
    used = {unit for v in description.modelVariables for unit in (v.unit, v.declaredType.unit if v.declaredType else None) if unit}
    declared = {unit.name for unit in description.unitDefinitions}
    description.unitDefinitions += [Unit(name=name) for name in sorted(used - declared)]
    for unit in description.unitDefinitions:
        try:
            known = parse_unit(str(unit.name))
        except ComponentError:
            continue
        unit.baseUnit = BaseUnit(**dict(known.exponents), factor=known.factor, offset=known.offset)


def complete1(description: ModelDescription, root: etree._Element) -> None:
    """Add what fmpy leaves out of a description of FMI 1.0."""
    if description.coSimulation is not None:
        _add_capabilities(description.coSimulation, root)
    if description.modelExchange is not None:
        description.modelExchange.needsCompletedIntegratorStep = True
    elements = list(root.iterfind("ModelVariables/*"))
    for variable, element in zip(description.modelVariables, elements, strict=True):
        variable.causality, variable.variability = _role(variable, element)
        variable.initial = _initial(variable, element)
        if element.get("alias") == "negatedAlias":
            variable.__class__ = _NegatedAlias
    _add_units(description)
    known = {str(variable.name): variable for variable in description.modelVariables}
    for variable, element in zip(description.modelVariables, elements, strict=True):
        if variable.causality == "output":
            declared = element.find("DirectDependency")
            names = None if declared is None else [str(name.text).strip() for name in declared.findall("Name")]
            causes = None if names is None else [known[name] for name in names]
            unknown = Unknown(variable=variable, dependencies=causes, sourceline=element.sourceline or 0)
            description.outputs.append(unknown)


def _add_capabilities(interface: CoSimulation, root: etree._Element) -> None:
    interface.needsExecutionTool = root.find(TOOL) is not None
    capabilities = root.find("Implementation/*/Capabilities")
    if capabilities is None:
        return
    for flag in _FLAGS:
        setattr(interface, flag, capabilities.get(flag) in ("true", "1"))
    order = str(capabilities.get("maxOutputDerivativeOrder", "0"))
    interface.maxOutputDerivativeOrder = int(order) if order.isdecimal() else 0


def _role(variable: ModelVariable, element: etree._Element) -> tuple[Causality, Variability]:
    """Causality and variability of FMI 2.0. What has no start value cannot be set in FMI 1.0."""
    causality, given = element.get("causality", "internal"), element.get("variability", "continuous")
    has_start = variable.start is not None
    if given == "parameter":
        if has_start:
            return "parameter", "fixed"
        return ("output", "discrete") if causality == "output" else ("calculatedParameter", "fixed")
    variability: Variability = given if given in ("constant", "discrete") else "continuous"
    if causality == "output" or (causality == "input" and variability != "constant"):
        return causality, variability
    return "local", variability


def _initial(variable: ModelVariable, element: etree._Element) -> Initial:
    if variable.causality in ("input", "parameter"):
        return "exact"
    if variable.start is None:
        return "calculated"
    return "approx" if _typed(element).get("fixed") in ("false", "0") else "exact"
