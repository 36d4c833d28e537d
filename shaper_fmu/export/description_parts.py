"""The parts that the model descriptions of FMI 2.0 and 3.0 share."""

from __future__ import annotations

import enum
import inspect
import os
from datetime import UTC, datetime
from typing import Any

from lxml import etree

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import BuildError
from shaper_fmu.export.docstrings import item_descriptions
from shaper_fmu.export.model_structure import visible_variables
from shaper_fmu.units import conversion, parse_unit
from shaper_fmu.version import __version__


def summary(component: type[Component]) -> str:
    """The first sentence-paragraph of the component's docstring, on one line."""
    return " ".join((inspect.getdoc(component) or component.__name__).split("\n\n")[0].split())


def text(value: Any) -> str:
    """A number as XML shows it; real numbers as short as they can be without loss."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(int(value)) if isinstance(value, int) else repr(float(value))


def new_document(component: type[Component], version: str, token: dict[str, str], generator: str) -> etree._Element:
    """The root element; `token` is the attribute that ties the description to the library, and empty in a draft."""
    about = {"description": summary(component), **_authorship(component)}
    return new_root(version, component.__name__, token, about, generator)


def new_root(
    version: str, name: str, token: dict[str, str], about: dict[str, str], generator: str, convention: str = "structured"
) -> etree._Element:
    """The root element of a model of this name; `about` are description, author and the like."""
    date = _date() if all(token.values()) else {}
    return etree.Element("fmiModelDescription", {
        "fmiVersion": version, "modelName": name, **token, **about, "generationTool": generator, **date,
        "variableNamingConvention": convention,
    })  # fmt: skip


_OURS = {
    "author": "shaper-fmu", "version": __version__, "license": "BSD-2-Clause",
    "copyright": "Copyright (c) 2026, the shaper-fmu developers",
}  # fmt: skip


def _authorship(component: type[Component]) -> dict[str, str]:
    """Author, version, copyright and license: what the component says about itself; ours are known."""
    ours = any(base.__module__.startswith(("shaper_fmu.commands.", "shaper_fmu.plants.")) for base in component.__mro__)
    return {**(_OURS if ours else {}), **component.about}


def _date() -> dict[str, str]:
    """When the FMU was made, if SOURCE_DATE_EPOCH tells; without it equal sources give equal FMUs, whenever they are built."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH", "")
    if not seconds:
        return {}
    try:
        made = datetime.fromtimestamp(int(seconds), UTC)
    except (ValueError, OverflowError, OSError):
        raise BuildError(f"SOURCE_DATE_EPOCH is {seconds!r}; it must be a number of seconds since 1970") from None
    return {"generationDateAndTime": made.strftime("%Y-%m-%dT%H:%M:%SZ")}


def as_bytes(root: etree._Element) -> bytes:
    """The finished document."""
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def add_units(root: etree._Element, component: type[Component], *more: str) -> None:
    """The units of the real variables, and `more`, by their SI base units, with the display units."""
    shown: dict[str, set[str]] = {unit: set() for unit in more}
    for variable in visible_variables(component):
        if variable.unit and variable.kind is float:
            shown.setdefault(variable.unit, set()).update({variable.display_unit} - {""})
    if not shown:
        return
    definitions = etree.SubElement(root, "UnitDefinitions")
    for name, displays in sorted(shown.items()):
        unit = parse_unit(name)
        element = etree.SubElement(definitions, "Unit", name=name)
        base = {symbol: str(exponent) for symbol, exponent in unit.exponents}
        etree.SubElement(element, "BaseUnit", base if unit.factor == 1.0 else {**base, "factor": text(unit.factor)})
        for display in sorted(displays):
            etree.SubElement(element, "DisplayUnit", name=display, factor=text(conversion(unit, parse_unit(display))[0]))


def enumerations(component: type[Component]) -> dict[str, type[enum.IntEnum]]:
    """The enumerations of the visible variables by name, in the order of their first use."""
    return {v.kind.__name__: v.kind for v in visible_variables(component) if issubclass(v.kind, enum.IntEnum)}


def add_items(element: etree._Element, kind: type[enum.IntEnum], component: type[Component]) -> None:
    """The items of an enumeration, with what its docstring or the component's says about them."""
    described = item_descriptions(kind, component)
    for item in kind:
        attributes = {"name": item.name, "value": str(item.value)}
        if item.name in described:
            attributes["description"] = described[item.name]
        etree.SubElement(element, "Item", attributes)


def add_log_categories(root: etree._Element, prefix: str, events: bool) -> None:
    """The categories of messages; `prefix` is that of the version's C names."""
    categories = etree.SubElement(root, "LogCategories")
    if events:
        etree.SubElement(categories, "Category", name="logEvents", description="Events, and when they are handled.")
    for status in ("Warning", "Discard", "Error", "Fatal"):
        etree.SubElement(
            categories, "Category", name=f"logStatus{status}", description=f"Messages with the status {prefix}{status}."
        )


def add_default_experiment(root: etree._Element, component: type[Component]) -> None:
    """Start, stop, step size and solver tolerance that make sense for the component."""
    etree.SubElement(root, "DefaultExperiment", {
        "startTime": "0.0", "stopTime": text(component.default_stop_time),
        "tolerance": text(component.default_tolerance), "stepSize": text(component.default_step_size),
    })  # fmt: skip


COMPILED_SOURCES = ("fmu.c", "kernels.c")
"""The files of an FMU's folder sources/ that are compiled; they include the others."""
ANNOTATION = "io.shaper-fmu"
"""Name of our annotations in a model description: of the tool in FMI 2.0, of the type in FMI 3.0."""


def add_annotation(root: etree._Element, parent: str, element: str, naming: str) -> None:
    """Declare that outputs may be read between setting inputs and the step; the standards forbid it otherwise."""
    annotation = etree.SubElement(etree.SubElement(root, parent), element, {naming: ANNOTATION})
    etree.SubElement(annotation, "DirectFeedthrough", outputsBetweenSetAndStep="true")


def _description(variable: Variable[Any]) -> str:
    """The declared one, with the bounds that do not belong to the domain: FMI's min and max do."""
    sides = (("min", "greater than", variable.min), ("max", "less than", variable.max))
    excluded = [f"{words} {bound:g}" for side, words, bound in sides if bound is not None and variable.exclusive in (True, side)]
    return "; ".join(part for part in (variable.description, " and ".join(excluded)) if part)


def common_attributes(variable: Variable[Any], name: str, reference: int) -> dict[str, str]:
    """Name, value reference, description, causality, variability and, for all but inputs, `initial`.

    Real inputs, outputs and locals are continuous even where they jump at events: a discrete variable would have to stay
    constant between events, as the announced event does.
    """
    if variable.causality in ("parameter", "calculatedParameter"):
        variability = "tunable" if variable.tunable else "fixed"
    else:
        variability = "continuous" if variable.kind is float and variable.name != "next_event_time" else "discrete"
    attributes = {
        "name": name, "valueReference": str(reference), "description": _description(variable),
        "causality": variable.causality, "variability": variability,
    }  # fmt: skip
    if variable.causality != "input":
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    return attributes


def typed_attributes(variable: Variable[Any]) -> dict[str, str]:
    """Declared type of an enumeration; unit and bounds of a number."""
    if issubclass(variable.kind, enum.IntEnum):
        return {"declaredType": variable.kind.__name__}
    attributes = {}
    if variable.kind is float and variable.unit:
        attributes["unit"] = variable.unit
        if variable.display_unit:
            attributes["displayUnit"] = variable.display_unit
    if variable.kind in (float, int):
        attributes.update({side: text(bound) for side, bound in variable.published_bounds.items()})
    return attributes


def has_start(variable: Variable[Any]) -> bool:
    """Whether a start value is required; for all that is calculated it is forbidden."""
    return variable.causality in ("input", "parameter")
