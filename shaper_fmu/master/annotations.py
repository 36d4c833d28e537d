"""Reads vendor annotations in model descriptions that are meant for masters (see docs/components.md)."""

from __future__ import annotations

from pathlib import Path

from shaper_fmu.xml_files import parse_xml

_NAME = "io.shaper-fmu"
_READABLE = "outputsBetweenSetAndStep"
_PLACES = {1: ("VendorAnnotations/Tool", "name"), 2: ("VendorAnnotations/Tool", "name"), 3: ("Annotations/Annotation", "type")}


def declares_readable_after_set(folder: Path, name: str, version: int) -> bool:
    """Whether the model description of the unpacked FMU `name` allows reading outputs between a set and the step."""
    content = (folder / "modelDescription.xml").read_bytes()
    if _READABLE.encode() not in content:  # descriptions may be large, and few have it
        return False
    path, key = _PLACES[version]
    found = [place for place in parse_xml(content, f"{name}: modelDescription.xml").findall(path) if place.get(key) == _NAME]
    return any(element.get(_READABLE) in ("true", "1") for place in found for element in place.findall("DirectFeedthrough"))
