"""The units and types of a container's description: those of the FMUs inside, of which equal ones are one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fmpy.model_description import BaseUnit, ModelVariable, SimpleType, Unit
from lxml import etree

from shaper_fmu.container.declared import declared_of
from shaper_fmu.container.inner import INTEGER_OF_2
from shaper_fmu.container.outside import OuterVariable
from shaper_fmu.export.description_parts import text
from shaper_fmu.master.description import InverseDisplayUnit
from shaper_fmu.master.fmu import Fmu
from shaper_fmu.units import BASE

REALS = ("Real", "Float64", "Float32")
SECOND: Unit = Unit(name="s", baseUnit=BaseUnit(s=1))
TEXTS = ("String", "Binary", "Boolean")
_TO_3 = {"Real": "Float64", "Integer": "Int32"}
_TO_2 = {"Float64": "Real", "Float32": "Real"}
_NUMBERS = ("min", "max", "nominal")
Attributes = dict[str, str]
Display = tuple[str, Attributes]


class Definitions:
    """Units and types by the names that they have outside. A name that means something else already gets "_2", "_3", ..."""

    def __init__(self, fmi: int, taken: Iterable[str]):
        self._fmi = fmi
        self._taken = set(taken)  # types may not be called like variables
        self._units: dict[str, tuple[Attributes | None, dict[str, Attributes]]] = {}
        self._types: dict[str, tuple[str, Attributes, list[Attributes]]] = {}
        self._names: dict[tuple[Any, ...], str] = {}

    def unit(self, fmu: Fmu | None, name: str, definition: Unit | None = None) -> str:
        """The outer name of a unit: of an FMU, or with its own definition."""
        key = (id(fmu), name, id(definition))
        if key not in self._names:
            definition = definition or (fmu.unit_definition(name) if fmu is not None else None)
            base = _base_attributes(definition.baseUnit) if definition is not None and definition.baseUnit is not None else None
            self._names[key] = self._add_unit(name, base, self._displays(definition))
        return self._names[key]

    def display(self, fmu: Fmu, unit: str | None, display: str | None) -> Attributes:
        """The attribute for a display unit; none if its unit does not define it, or FMI 2.0 cannot."""
        known = self._displays(fmu.unit_definition(unit)) if unit else {}
        return {"displayUnit": display} if display in known else {}

    def attributes(self, variable: OuterVariable) -> Attributes:
        """The attributes of a variable's type, with its units and its declared type."""
        shown, fmu, type_ = variable.shown, variable.fmu, variable.type
        same = _outer_kind(str(shown.type), self._fmi) == type_
        found: Attributes = {}
        if shown.declaredType is not None and same:
            found["declaredType"] = self.type(fmu, shown.declaredType, type_)
        raw = declared_of(fmu).variable(str(shown.name)).attributes if shown.name else {}
        if type_ == "Binary":
            return found | {name: raw[name] for name in ("mimeType", "maxSize") if name in raw}
        if type_ in TEXTS:
            return found
        own = {name: raw.get(name) for name in ("quantity", "min", "max")} if str(shown.type).startswith("UInt") else {}
        found |= _typed(shown if not own else None, own, type_, same)
        if type_ in REALS:
            found |= self._real(variable, raw)
        return found

    def type(self, fmu: Fmu, declared: SimpleType, type_: str) -> str:
        """The outer name of an FMU's type, for variables of a type outside."""
        key = (id(fmu), id(declared), type_)
        if key not in self._names:
            attributes = _typed(declared, {}, type_, True) if type_ not in TEXTS else {}
            if type_ in REALS:
                attributes |= _flags(declared)
                if declared.unit:
                    attributes["unit"] = self.unit(fmu, declared.unit)
                    attributes |= self.display(fmu, declared.unit, declared.displayUnit)
            if type_ == "Enumeration" and self._fmi == 2:
                attributes = {name: value for name, value in attributes.items() if name == "quantity"}
            if declared.description:
                attributes["description"] = declared.description
            items = [_item(item) for item in declared.items] if type_ == "Enumeration" else []
            self._names[key] = self._add_type(str(declared.name), (type_, attributes, items))
        return self._names[key]

    def add(self, root: etree._Element) -> None:
        """Write all units and types."""
        if self._units:
            definitions = etree.SubElement(root, "UnitDefinitions")
            for name, (base, displays) in self._units.items():
                unit = etree.SubElement(definitions, "Unit", name=name)
                if base is not None:
                    etree.SubElement(unit, "BaseUnit", base)
                for display, attributes in displays.items():
                    etree.SubElement(unit, "DisplayUnit", {"name": display, **attributes})
        if self._types:
            definitions = etree.SubElement(root, "TypeDefinitions")
            for name, (type_, attributes, items) in self._types.items():
                element = self._new_type(definitions, name, type_, attributes)
                for item in items:
                    etree.SubElement(element, "Item", item)

    def _new_type(self, parent: etree._Element, name: str, type_: str, attributes: Attributes) -> etree._Element:
        if self._fmi == 3:
            return etree.SubElement(parent, f"{type_}Type", {"name": name, **attributes})
        described = {key: value for key, value in attributes.items() if key == "description"}
        typed = {key: value for key, value in attributes.items() if key != "description"}
        return etree.SubElement(etree.SubElement(parent, "SimpleType", {"name": name, **described}), type_, typed)

    def _real(self, variable: OuterVariable, raw: Attributes) -> Attributes:
        shown, fmu = variable.shown, variable.fmu
        found = _flags(shown)
        if raw.get("relativeQuantity") in ("true", "1"):
            found["relativeQuantity"] = "true"
        if variable.unit is not None:
            return {**found, "unit": self.unit(None, str(variable.unit.name), variable.unit)}
        own = shown.unit or (shown.declaredType.unit if shown.declaredType is not None else None)
        if shown.unit:
            found["unit"] = self.unit(fmu, shown.unit)
        return found | self.display(fmu, own, shown.displayUnit)

    def _displays(self, definition: Unit | None) -> dict[str, Attributes]:
        found: dict[str, Attributes] = {}
        for display in definition.displayUnits if definition is not None else []:
            inverse = isinstance(display, InverseDisplayUnit)
            if not inverse or self._fmi == 3:
                attributes = _differing({"factor": display.factor, "offset": display.offset}, {"factor": 1.0, "offset": 0.0})
                found[str(display.name)] = {**attributes, **({"inverse": "true"} if inverse else {})}
        return found

    def _add_unit(self, name: str, base: Attributes | None, displays: dict[str, Attributes]) -> str:
        """A unit without base units is any of its name; display units are collected."""
        for outer in _candidates(name):
            known, shown = self._units.get(outer, (None, {}))
            same = known is None or base is None or known == base
            if same and all(shown.get(display, attributes) == attributes for display, attributes in displays.items()):
                self._units[outer] = (known if base is None else base, {**shown, **displays})
                return outer
        raise AssertionError

    def _add_type(self, name: str, definition: tuple[str, Attributes, list[Attributes]]) -> str:
        for outer in _candidates(name):
            if outer not in self._taken and self._types.setdefault(outer, definition) == definition:
                return outer
        raise AssertionError


def _candidates(name: str) -> Iterable[str]:
    yield name
    number = 2
    while True:
        yield f"{name}_{number}"
        number += 1


def _outer_kind(type_: str, fmi: int) -> str:
    """The type outside of what is of a type inside."""
    if fmi == 3:
        return _TO_3.get(type_, type_)
    return "Integer" if "Int" in type_ else _TO_2.get(type_, type_)


def _base_attributes(base: BaseUnit) -> Attributes:
    values = {symbol: int(getattr(base, symbol) or 0) for symbol in BASE}
    exponents = {symbol: str(value) for symbol, value in values.items() if value}
    return exponents | _differing({"factor": base.factor, "offset": base.offset}, {"factor": 1.0, "offset": 0.0})


def _differing(values: dict[str, Any], usual: dict[str, float]) -> Attributes:
    return {name: text(float(value)) for name, value in values.items() if value is not None and float(value) != usual[name]}


def _flags(shown: ModelVariable | SimpleType) -> Attributes:
    found = {}
    if getattr(shown, "relativeQuantity", None):
        found["relativeQuantity"] = "true"
    if shown.unbounded in (True, "true", "1"):
        found["unbounded"] = "true"
    return found


def _typed(shown: ModelVariable | SimpleType | None, own: dict[str, str | None], type_: str, same: bool) -> Attributes:
    """Quantity, bounds and nominal value in the type outside; of `own` where fmpy leaves them out. Numbers that it cannot have are
    left out."""
    found: Attributes = {}
    for name in ("quantity", *_NUMBERS):
        value = own.get(name) if shown is None else getattr(shown, name, None)
        if value is None or (name == "nominal" and type_ not in REALS):
            continue
        number = str(value) if name == "quantity" else _number(str(value), type_)
        if number is not None and (same or name == "quantity" or type_ in REALS):
            found[name] = number
    return found


def _number(value: str, type_: str) -> str | None:
    """A number as XML shows it; None if the type outside does not have it."""
    try:
        if type_ in REALS:
            return real_text(float(value))
        number = int(value)
    except ValueError:
        return None
    return str(number) if type_ != "Integer" or number in INTEGER_OF_2 else None


def real_text(value: float) -> str:
    """A real number as XML shows it."""
    if value != value:
        return "NaN"
    return {float("inf"): "INF", float("-inf"): "-INF"}.get(value) or repr(value)


def _item(item: Any) -> Attributes:
    attributes = {"name": str(item.name), "value": str(int(str(item.value)))}
    return {**attributes, "description": item.description} if item.description else attributes
