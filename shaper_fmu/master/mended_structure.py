"""Repairs references to variables in a model description: the model's structure, derivatives and clocks."""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from shaper_fmu.errors import ArchiveError

_UNKNOWNS = {
    2: tuple(f"{kind}/Unknown" for kind in ("Outputs", "Derivatives", "InitialUnknowns")),
    3: ("Output", "ContinuousStateDerivative", "ClockedState", "InitialUnknown", "EventIndicator"),
}


def mend_structure(root: etree._Element, version: int, where: str) -> list[str]:
    """Repair references to variables; returns the findings. Raises ArchiveError for an entry of a variable that does not exist."""
    variables = root.findall("ModelVariables/*")
    if version == 2:
        known, key = {str(i + 1) for i in range(len(variables))}, "index"
    else:
        known, key = {_plain(variable.get("valueReference")) for variable in variables}, "valueReference"
    shared = _shared(variables) if version == 3 else set()
    unknowns = [unknown for path in _UNKNOWNS[version] for unknown in root.iterfind(f"ModelStructure/{path}")]
    for unknown in unknowns:
        reference = _plain(unknown.get(key))
        if reference not in known:
            message = f"ModelStructure (line {unknown.sourceline}): {key} = {unknown.get(key)!r} is not a variable"
            hint = f"; they are counted from 1 to {len(variables)}" if version == 2 else ""
            raise ArchiveError(f"{where}: {message}{hint}")
        unknown.set(key, reference)
    findings = list(_mend_dependencies(unknowns, known, shared, key))
    findings += _mend_derivatives(root, version, known)
    if version == 3:
        _check_clocks(variables, known, where)
    return findings


def _plain(text: str | None) -> str:
    """A reference without what means nothing ("+07 " is "7")."""
    stripped = (text or "").strip().removeprefix("+")
    return str(int(stripped)) if stripped.isascii() and stripped.isdigit() and len(stripped) < 20 else stripped


def _shared(variables: list[etree._Element]) -> set[str]:
    """Value references that several variables have."""
    seen: set[str] = set()
    references = [_plain(variable.get("valueReference")) for variable in variables]
    return {reference for reference in references if reference in seen or seen.add(reference)}


def _mend_dependencies(unknowns: list[etree._Element], known: set[str], shared: set[str], key: str) -> Iterator[str]:
    """If dependencies refer to no variable, the numbering is unclear: then none are declared, and all may exist."""
    doubtful = False
    for unknown in unknowns:
        if unknown.get("dependencies") is not None:
            names = [_plain(name) for name in str(unknown.get("dependencies")).split()]
            wrong = [name for name in names if name not in known or name in shared]
            unknown.set("dependencies", " ".join(names))
            kinds = unknown.get("dependenciesKind")
            if kinds is not None:
                unknown.set("dependenciesKind", " ".join(kinds.split()))
            if wrong and not doubtful:
                why = "several variables have" if wrong[0] in shared else "is not a variable's"
                message = f"ModelStructure (line {unknown.sourceline}): dependencies name the {key} {wrong[0]}, which {why}"
                yield f"{message}; taken as without dependencies"
                doubtful = True
    for unknown in unknowns if doubtful else []:
        for attribute in ("dependencies", "dependenciesKind"):
            unknown.attrib.pop(attribute, None)


def _mend_derivatives(root: etree._Element, version: int, known: set[str]) -> Iterator[str]:
    for element in root.iterfind("ModelVariables/*/Real" if version == 2 else "ModelVariables/*"):
        given = element.get("derivative")
        if given is not None:
            element.set("derivative", _plain(given))
            if _plain(given) not in known:
                del element.attrib["derivative"]
                yield f"derivative (line {element.sourceline}): {given!r} is not a variable; taken as not given"


def _check_clocks(variables: list[etree._Element], known: set[str], where: str) -> None:
    for variable in variables:
        clocks = variable.get("clocks")
        if clocks is not None:
            names = [_plain(name) for name in clocks.split()]
            wrong = next((name for name in names if name not in known), None)
            if wrong is not None or not names:
                message = f"variable {variable.get('name')!r} (line {variable.sourceline}): clocks = {clocks!r}"
                raise ArchiveError(
                    f"{where}: {message} {'names no clock' if wrong is None else f'names {wrong}, which is not a variable'}"
                )
            variable.set("clocks", " ".join(names))
