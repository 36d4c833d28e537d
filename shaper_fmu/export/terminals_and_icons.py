"""The icon of an FMU and the terminals by which it is connected: model.png in FMI 2.0, the folder terminalsAndIcons in FMI 3.0."""

from __future__ import annotations

from lxml import etree

from shaper_fmu.component import Component
from shaper_fmu.export.description_parts import as_bytes
from shaper_fmu.export.picture import behaviour_icon

_FOLDER = "terminalsAndIcons"
_EXTENT = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}  # FMI's own default


def icon_and_terminals(component: type[Component], fmi: int) -> dict[str, bytes]:
    """The files by their path in an FMU of this version; none where there is nothing to tell or draw."""
    icon = behaviour_icon(component)
    if fmi == 2:
        return {"model.png": icon["png"]} if icon else {}
    files = {f"{_FOLDER}/icon.{kind}": content for kind, content in icon.items()}
    if icon or component.terminals:
        files[f"{_FOLDER}/{_FOLDER}.xml"] = _description(component, bool(icon))
    return files


def _description(component: type[Component], with_icon: bool) -> bytes:
    """terminalsAndIcons.xml. Members match by their names; what one side does not have is left unconnected (rule `bus`)."""
    root = etree.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    if with_icon:
        graphical = etree.SubElement(root, "GraphicalRepresentation")
        etree.SubElement(graphical, "CoordinateSystem", {**_EXTENT, "suggestedScalingFactorTo_mm": "0.1"})
        etree.SubElement(graphical, "Icon", _EXTENT)
    if component.terminals:
        terminals = etree.SubElement(root, "Terminals")
        for name, members in component.terminals.items():
            terminal = etree.SubElement(terminals, "Terminal", name=name, matchingRule="bus")
            for member, variable in members.items():
                attributes = {"variableName": variable, "memberName": member, "variableKind": "signal"}
                etree.SubElement(terminal, "TerminalMemberVariable", attributes)
    return as_bytes(root)
