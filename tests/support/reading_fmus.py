"""A lag whose solver is disturbed by reading between set and step (see fmus/reading.h): its model descriptions, its systems."""

from __future__ import annotations

import math
import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
import numpy as np
from faulty_fmus import library

TIME_CONSTANT, LOWEST, HIGHEST = 0.5, -1.0, 5.0  # as in reading.h
READABLE = '<DirectFeedthrough outputsBetweenSetAndStep="true"/>'
VARIABLES = [  # in the order of the value references
    ("u", "Real", "input", ""), ("x", "Real", "output", ""), ("through", "Real", "output", "u"), ("load", "Real", "local", ""),
    ("count_in", "Integer", "input", ""), ("count_out", "Integer", "output", "count_in"), ("strict", "Integer", "parameter", ""),
]  # fmt: skip


def _description2(declared: bool, annotation: str) -> str:
    variables = "".join(
        f'<ScalarVariable name="{name}" valueReference="{i}" causality="{causality}" variability="{_variability(kind, causality)}">'
        f"<{kind}{_start(causality)}/></ScalarVariable>"
        for i, (name, kind, causality, _) in enumerate(VARIABLES)
    )
    numbers = {name: i + 1 for i, (name, *_) in enumerate(VARIABLES)}
    outputs = "".join(
        f'<Unknown index="{numbers[name]}"' + (f' dependencies="{numbers.get(follows, "")}"' if declared else "") + "/>"
        for name, _, causality, follows in VARIABLES
        if causality == "output"
    )
    said = f'<VendorAnnotations><Tool name="{annotation}">{READABLE}</Tool></VendorAnnotations>' if annotation else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="lag" guid="lag">'
        '<CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"/>'
        f"{said}<ModelVariables>{variables}</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs>"
        f"<InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )


def _description3(declared: bool, annotation: str, event_mode: bool) -> str:
    kinds = {"Real": "Float64", "Integer": "Int32"}
    variables = "".join(
        f'<{kinds[kind]} name="{name}" valueReference="{i}" causality="{causality}" variability="{_variability(kind, causality)}"'
        f"{_start(causality)}/>"
        for i, (name, kind, causality, _) in enumerate(VARIABLES)
    )
    numbers = {name: i for i, (name, *_) in enumerate(VARIABLES)}
    outputs = "".join(
        f'<{tag} valueReference="{numbers[name]}"' + (f' dependencies="{numbers.get(follows, "")}"' if declared else "") + "/>"
        for tag in ("Output", "InitialUnknown")
        for name, _, causality, follows in VARIABLES
        if causality == "output"
    )
    said = f'<Annotations><Annotation type="{annotation}">{READABLE}</Annotation></Annotations>' if annotation else ""
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="lag" instantiationToken="lag">'
        '<CoSimulation modelIdentifier="lag" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true" '
        f'hasEventMode="{str(event_mode).lower()}"/><ModelVariables>{variables}'
        f'<Float64 name="time" valueReference="{len(VARIABLES)}" causality="independent" variability="continuous"/>'
        f"</ModelVariables><ModelStructure>{outputs}</ModelStructure>{said}</fmiModelDescription>"
    )


def _variability(kind: str, causality: str) -> str:
    return "fixed" if causality == "parameter" else "continuous" if kind == "Real" else "discrete"


def _start(causality: str) -> str:
    return ' start="0"' if causality in ("input", "parameter") else ""


@lru_cache
def lag_fmu(
    version: int,
    *,
    declared: bool = True,
    annotation: str = "",
    event_mode: bool = False,
    bounded: bool = False,
    rigid: bool = False,
) -> Path:
    """The FMU; with its dependencies `declared` or not, with an `annotation` of this name that it may be read, with event mode, with
    bounds of u, for steps of one length alone."""
    made = library(f"reading{version}")
    path = made.with_name(f"lag_{version}_{declared}_{annotation}_{event_mode}_{bounded}_{rigid}.fmu")
    text = _description3(declared, annotation, event_mode) if version == 3 else _description2(declared, annotation)
    if bounded:  # u is the first that has a start value
        text = text.replace(' start="0"', f' min="{LOWEST}" max="{HIGHEST}" start="0"', 1)
    if rigid:
        text = text.replace('canHandleVariableCommunicationStepSize="true"', 'canHandleVariableCommunicationStepSize="false"')
    folder = fmpy.platform_tuple if version == 3 else fmpy.platform
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{folder}/lag{fmpy.sharedLibraryExtension}")
    return path


def lagged(inputs: np.ndarray, step: float, x: float = 0.0) -> np.ndarray:
    """x at all communication points by the formula, where inputs[k] is held over step k; shape (len(inputs) + 1,)."""
    found = [x]
    for u in inputs:
        found.append(u + (found[-1] - u) * math.exp(-step / TIME_CONSTANT))
    return np.array(found)
