"""Reads the model descriptions of FMUs with fmpy, after harmless faults have been repaired.

A fault that makes no run wrong is a finding; one that would is refused: see `mending.py`.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import io
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path

import fmpy
from fmpy import read_model_description
from fmpy.model_description import DisplayUnit, ModelDescription
from fmpy.validation import validate_model_description
from lxml import etree

from shaper_fmu.errors import ArchiveError
from shaper_fmu.master.description1 import complete1
from shaper_fmu.master.mending import mended, whole
from shaper_fmu.master.variable_names import wrong_names
from shaper_fmu.master.variables import items_of
from shaper_fmu.xml_files import parse_xml

_FILE = "modelDescription.xml"
_ENCODINGS = (("utf-8", "strict"), ("cp1252", "replace"))
"""Encodings that are tried if a file is not in its declared one."""
_PRERELEASE = re.compile(r"3\.\d.*-(alpha|beta)")


@contextlib.contextmanager
def without_collector() -> Iterator[None]:
    """Without the search for circular garbage, which goes through all of hundreds of thousands of variables again and again."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@without_collector()
def read_description(content: bytes, name: str) -> tuple[ModelDescription, list[str]]:
    """The description in the bytes of modelDescription.xml of an FMU called `name`, and every finding.

    Raises ArchiveError for what cannot be read, or would make a run wrong or unsafe.
    """
    where, findings = f"{name}: {_FILE}", []
    root = _parsed(content, where, findings)
    version = _version(root, where, findings)
    findings += _schema_findings(root, version)
    findings += mended(root, int(version[0]), where)
    try:
        description = read_model_description(_as_archive(root), validate=False)  # pyright: ignore[reportArgumentType]
    except Exception as error:  # fmpy raises many kinds
        raise ArchiveError(f"{where} is not valid: {error}") from error
    _tell_lines(description, root)
    _tell_inverse(description, root)
    if version[0] == "1":
        complete1(description, root)
    findings += _model_findings(description)
    return description, list(dict.fromkeys(findings))


def declared_interfaces(content: bytes, name: str) -> dict[str, dict[str, str]]:
    """What modelDescription.xml declares of each kind, in small letters: attribute -> text, as in the file. Raises ArchiveError.

    fmpy leaves out FMI 1.0's capabilities of co-simulation, and some of FMI 3.0.
    """
    root = _parsed(content, f"{name}: {_FILE}", [])
    kinds = ("CoSimulation", "ModelExchange", "ScheduledExecution")
    found = {kind.lower(): dict(one.attrib) for kind in kinds for one in root.findall(kind)}
    for one in root.findall("Implementation/*/Capabilities"):
        found["cosimulation"] = dict(one.attrib)
    if root.find("Implementation/CoSimulation_Tool") is not None:  # which FMI 2.0 calls so
        found.setdefault("cosimulation", {})["needsExecutionTool"] = "true"
    return {kind: {str(key): str(text) for key, text in declared.items()} for kind, declared in found.items()}


def declared_root(content: bytes, name: str) -> etree._Element:
    """The root element of modelDescription.xml, as in the file, for what fmpy leaves out. Raises ArchiveError."""
    return _parsed(content, f"{name}: {_FILE}", [])


def _parsed(content: bytes, where: str, findings: list[str]) -> etree._Element:
    """The root element. White space before the beginning, and a wrong declared encoding, are tolerated."""
    begin = content.lstrip(b" \t\r\n")
    if begin != content:
        findings.append("white space before the XML declaration")
    try:
        root = parse_xml(begin, where, prefixes={}, findings=findings)
    except ArchiveError as first:
        for encoding, undefined in _ENCODINGS:
            try:
                root = parse_xml(begin.decode(encoding, undefined).encode("utf-8"), where, "utf-8")
            except (ArchiveError, UnicodeDecodeError):
                continue
            findings.append(f"it is not in its declared encoding; read as {encoding}")
            break
        else:
            raise first
    if root.tag != "fmiModelDescription":
        raise ArchiveError(f"{where}: its root element is {root.tag!r}, not 'fmiModelDescription'")
    return root


def _version(root: etree._Element, where: str, findings: list[str]) -> str:
    """The version of FMI. Raises ArchiveError for an unknown version, or for a draft whose functions differ."""
    version_text = str(root.get("fmiVersion", "")).strip()
    if _PRERELEASE.match(version_text):
        raise ArchiveError(
            f"{where}: fmiVersion {version_text!r} is a draft; its functions are not those of FMI 3.0, so it is not read"
        )
    version = version_text if version_text[:2] == "3." else version_text[:3]
    if not re.match(r"1\.0|2\.0|3\.\d", version):
        raise ArchiveError(f"{where}: fmiVersion is {version_text!r}; FMI 1.0, 2.0 and 3.0 are read")
    if version != root.get("fmiVersion"):
        findings.append(f"fmiVersion {version_text!r} is read as {version!r}")
        root.set("fmiVersion", version)
    return version


@functools.cache
def _schema(version: str) -> etree.XMLSchema:
    folder = Path(str(fmpy.__file__)).parent / "schema" / f"fmi{version[0]}"
    return etree.XMLSchema(file=str(next(folder.glob("fmi*ModelDescription.xsd"))))


def _schema_findings(root: etree._Element, version: str) -> list[str]:
    schema = _schema(version[0])
    if schema.validate(root):
        return []
    return [f"{e.level_name} (line {e.line}, column {e.column}): {' '.join(e.message.split())}" for e in schema.error_log]


def _as_archive(root: etree._Element) -> io.BytesIO:
    """The repaired description in the form that fmpy reads: alone in an archive."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(_FILE, etree.tostring(root, encoding="utf-8", xml_declaration=True))
    stream.seek(0)
    return stream


def _tell_lines(description: ModelDescription, root: etree._Element) -> None:
    """Give variables and unknowns their lines in the file as it was."""
    variables = root.find("ModelVariables")
    assert variables is not None  # mended
    for variable, element in zip(description.modelVariables, variables, strict=False):  # aliases come after
        variable.sourceline = element.sourceline
    for variable in description.modelVariables:
        if variable.alias is not None:
            variable.sourceline = variable.alias.sourceline
    kinds = {
        "outputs": ("Outputs/Unknown", "Output"),
        "derivatives": ("Derivatives/Unknown", "ContinuousStateDerivative"),
        "clockedStates": ("ClockedState",),
        "initialUnknowns": ("InitialUnknowns/Unknown", "InitialUnknown"),
        "eventIndicators": ("EventIndicator",),
    }
    for kind, paths in kinds.items():
        elements = [element for path in paths for element in root.findall(f"ModelStructure/{path}")]
        for unknown, element in zip(getattr(description, kind), elements, strict=False):
            unknown.sourceline = element.sourceline or 0


class InverseDisplayUnit(DisplayUnit):
    """FMI 3.0's display unit of a reciprocal, such as a period's for a frequency, which fmpy reads as any other."""


def _tell_inverse(description: ModelDescription, root: etree._Element) -> None:
    """Give display units of reciprocals their own class."""
    for unit, element in zip(description.unitDefinitions, root.findall("UnitDefinitions/Unit"), strict=False):
        declared = [display.get("inverse") in ("true", "1") for display in element.findall("DisplayUnit")]
        unit.displayUnits = [
            InverseDisplayUnit(one.name, one.factor, one.offset) if inverse else one
            for one, inverse in zip(unit.displayUnits, declared, strict=True)
        ]


def _model_findings(description: ModelDescription) -> list[str]:
    """Findings that the schema does not cover, from fmpy; structured names are left out, since its parser takes milliseconds for
    each.
    """
    flat = description.variableNamingConvention == "flat"
    findings = _without_display_units(description)
    findings += validate_model_description(description, validate_variable_names=flat, validate_model_structure=True)
    return findings + _start_findings(description) + wrong_names(description)


def _start_findings(description: ModelDescription) -> list[str]:
    """Start values of enumerations that are no item."""
    findings = []
    for variable in description.modelVariables:
        items = set(items_of(variable).values())
        wrong = [text for text in str(variable.start or "").split() if items and whole(text) not in items]
        if wrong:
            message = (
                f"the start value {wrong[0]} of {variable.name!r} (line {variable.sourceline}) is not an item of its enumeration"
            )
            findings.append(message)
    return findings


def _without_display_units(description: ModelDescription) -> list[str]:
    """Forget display units of no unit, on which fmpy's validation stops."""
    units, findings = {unit.name for unit in description.unitDefinitions}, []
    for variable in description.modelVariables:
        unit = variable.unit or (variable.declaredType.unit if variable.declaredType is not None else None)
        if unit not in units:
            for shown in (variable, *variable.aliases):
                if shown.displayUnit is not None:
                    message = f'The display unit "{shown.displayUnit}" of "{shown.name}" (line {variable.sourceline}) has no unit.'
                    findings.append(message)
                    shown.displayUnit = None
    return findings
