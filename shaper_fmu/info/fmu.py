"""Reads the facts about an FMU of any version and kind from its archive; nothing of it is unpacked to a folder, loaded or run."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable, Unknown

from shaper_fmu.archives import read_archive, read_file
from shaper_fmu.info.facts import Experiment, FmuInfo, Interface, PlatformInfo
from shaper_fmu.info.variables import shape_of, variable_info
from shaper_fmu.master.description import declared_interfaces
from shaper_fmu.master.fmu import description_of, examined

KINDS = {"coSimulation": "co-simulation", "modelExchange": "model exchange", "scheduledExecution": "scheduled execution"}
"""The kinds of FMUs, by their names in fmpy's descriptions."""
_NAMES = ("modelIdentifier", "id")


def fmu_info(path: Path | str) -> FmuInfo:
    """What the FMU in a file is. Raises ArchiveError for what `check` cannot read either."""
    path = Path(path)
    return fmu_facts(path.name, read_file(path))


def fmu_facts(name: str, content: bytes) -> FmuInfo:
    """What the FMU with this file name and content is. Raises ArchiveError."""
    files = read_archive(content, name)
    described, findings = examined(name, content)
    declared = declared_interfaces(description_of(name, files.get("modelDescription.xml")), name)
    of = {"input": [], "output": [], "parameter": []}
    others: list[str] = []
    for variable in described.modelVariables:
        role = _role(variable)
        of[role].append(variable_info(variable)) if role in of else others.append(role)
    states, indicators = _states(described)
    return FmuInfo(
        file=name,
        size=len(content),
        name=described.modelName or "",
        description=described.description or "",
        version=described.version or "",
        author=described.author or "",
        licence=described.license or described.copyright or "",
        tool=described.generationTool or "",
        generated=described.generationDateAndTime or "",
        fmi_version=str(described.fmiVersion),
        interfaces=_interfaces(described, declared),
        libraries=_libraries(files, described.fmiMajorVersion),
        sources=sum(1 for file in files if file.startswith("sources/")),
        experiment=_experiment(described),
        inputs=of["input"],
        outputs=of["output"],
        parameters=of["parameter"],
        others=dict(Counter(others)),
        continuous_states=states,
        event_indicators=indicators,
        findings=findings,
    )


def _role(variable: ModelVariable) -> str:
    """Input, output, parameter, or another causality. FMI 1.0 has parameters by variability, among the internal variables."""
    causality = str(variable.causality or "local")
    if causality == "structuralParameter" or (causality in ("internal", "local") and variable.variability == "parameter"):
        return "parameter"
    return {"internal": "local", "none": "local"}.get(causality, causality)


def _interfaces(described: ModelDescription, declared: dict[str, dict[str, str]]) -> list[Interface]:
    found = [(kind, getattr(described, attribute)) for attribute, kind in KINDS.items()]
    return [
        Interface(kind, str(one.modelIdentifier), dict(_capabilities(declared.get(kind.replace(" ", "").replace("-", ""), {}))))
        for kind, one in found
        if one is not None
    ]


def _capabilities(declared: dict[str, str]) -> Iterable[tuple[str, bool | float | str]]:
    """What is declared, but for names, what is false and numbers that are 0."""
    for name, text in declared.items():
        word = text.strip().lower()
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if name in _NAMES or word == "false" or number == 0.0:
            continue
        boolean = word == "true" or (number == 1.0 and not _counts(name))
        yield name, True if boolean else number if math.isfinite(number) else text


def _counts(name: str) -> bool:
    """Whether a capability is a number, so that 1 is not "true"."""
    return name.startswith(("max", "fixed", "recommended"))


def _libraries(files: dict[str, bytes], version: int) -> list[PlatformInfo]:
    this = fmpy.platform_tuple if version == 3 else fmpy.platform
    sizes: Counter[str] = Counter()
    for file, content in files.items():
        parts = PurePosixPath(file).parts
        if len(parts) > 2 and parts[0] == "binaries":
            sizes[parts[1]] += len(content)
    return [PlatformInfo(name, sizes[name], name == this) for name in sorted(sizes)]


def _experiment(described: ModelDescription) -> Experiment:
    declared = described.defaultExperiment
    if declared is None:
        return Experiment()
    texts = (declared.startTime, declared.stopTime, declared.stepSize, declared.tolerance)
    start, stop, step, tolerance = (float(text) if text else None for text in texts)
    return Experiment(start, stop, step, tolerance)


def _states(described: ModelDescription) -> tuple[int, int]:
    """The numbers of continuous states and of event indicators; FMI 3.0 has arrays of both."""
    if described.fmiMajorVersion < 3:
        return int(described.numberOfContinuousStates), int(described.numberOfEventIndicators)
    return _elements(described.derivatives), _elements(described.eventIndicators)


def _elements(unknowns: Iterable[Unknown]) -> int:
    return sum(math.prod(shape_of(one.variable)) for one in unknowns if one.variable is not None)
