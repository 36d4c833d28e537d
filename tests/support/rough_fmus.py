"""An FMU of plants as users have them (see fmus/rough2.c): its model description."""

from __future__ import annotations

import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
from faulty_fmus import library

_STARTS = {"mass": 1.0, "w": 10.0, "w2": 30.0, "lag": 1.0, "slip": 1e-3, "c1": 1.0}
_PARAMETERS = """
    mass w z w2 z2 b2 e1 e2 lag series cubic pendulum friction slip velocity c1 c2 cl ci cj d drift noise seed euler inner q0 s0 l0 count dead
"""
_VARIABLES = [
    ("u", "input", 0.0), ("u2", "input", 0.0), ("load", "input", 1.0), ("y", "output", None), ("y2", "output", None),
    *((name, "parameter", _STARTS.get(name, 0.0)) for name in _PARAMETERS.split()),
]  # fmt: skip
"""In the order of the value references in rough2.c."""
EULER, INNER_STEPS = 1.0, 2.0
"""Values of `euler`: steps of the communication, or of `inner` at most."""


def _variable(reference: int, name: str, causality: str, start: float | None) -> str:
    variability = "fixed" if causality == "parameter" else "continuous"
    given = "" if start is None else f' start="{start:g}"'
    return (
        f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}">'
        f"<Real{given}/></ScalarVariable>"
    )


@lru_cache
def rough_fmu(stop_time: float = 10.0, step: float | None = None) -> Path:
    """The FMU with this default experiment [s]; its outputs may follow `u` at once."""
    made = library("rough2")
    variables = "".join(_variable(i, *declared) for i, declared in enumerate(_VARIABLES))
    outputs = [i for i, declared in enumerate(_VARIABLES) if declared[1] == "output"]
    unknowns = "".join(f'<Unknown index="{i + 1}" dependencies="1"/>' for i in outputs)
    size = "" if step is None else f' stepSize="{step:g}"'
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="rough" guid="rough">'
        '<CoSimulation modelIdentifier="rough" canHandleVariableCommunicationStepSize="true"/>'
        f'<DefaultExperiment startTime="0" stopTime="{stop_time:g}"{size}/><ModelVariables>{variables}</ModelVariables>'
        f"<ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>"
        "</fmiModelDescription>"
    )
    path = made.with_name(f"rough_{stop_time:g}_{step}.fmu")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{fmpy.platform}/rough{fmpy.sharedLibraryExtension}")
    return path
