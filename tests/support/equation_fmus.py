"""FMUs of model exchange alone, with events and faults (see fmus/equations.h): their model descriptions, and systems with them."""

from __future__ import annotations

import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
from faulty_fmus import library

from shaper_fmu.master.system import System

MODELS = {
    name: number
    for number, name in enumerate(
        [
            "decay",
            "ball",
            "singular",
            "exploding",
            "relay",
            "clocked",
            "completing",
            "refusing",
            "failing",
            "ending",
            "two_sided",
            "endless",
            "timer",
            "switching",
            "switched",
            "following",
            "secret",
            "late",
            "soon",
            "cubic",
            "unreadable",
            "wide",
        ]
    )
}  # as in equations.h
_VARIABLES = [  # in the order of the value references
    ("u", "input", "continuous", 'start="0"'), ("y", "output", "continuous", ""), ("x1", "local", "continuous", ""),
    ("x2", "local", "continuous", ""), ("der1", "local", "continuous", "3"), ("der2", "local", "continuous", "4"),
    ("model", "parameter", "fixed", 'start="0"'), ("p", "parameter", "fixed", 'start="1"'),
    ("q", "parameter", "tunable", 'start="0"'), ("count", "output", "discrete", ""), ("events", "output", "discrete", ""),
    ("completed", "local", "discrete", ""), ("d", "input", "discrete", 'start="0"'),
]  # fmt: skip


def _description2(states: int) -> str:
    def real(reference: int, name: str, causality: str, variability: str, more: str) -> str:
        inner = f'derivative="{more}"' if more.isdigit() else more
        return (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}">'
            f"<Real {inner}/></ScalarVariable>"
        )

    variables = "".join(real(i, *declared) for i, declared in enumerate(_VARIABLES))
    outputs = "".join(f'<Unknown index="{i + 1}"/>' for i, declared in enumerate(_VARIABLES) if declared[1] == "output")
    rates = "".join(f'<Unknown index="{i}"/>' for i in (5, 6)[:states])
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="equations" guid="equations" '
        f'numberOfEventIndicators="2"><ModelExchange modelIdentifier="equations" canGetAndSetFMUstate="true"/><ModelVariables>{variables}</ModelVariables>'
        f"<ModelStructure><Outputs>{outputs}</Outputs>{f'<Derivatives>{rates}</Derivatives>' if states else ''}"
        f"<InitialUnknowns>{outputs}{rates}</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )


def _description3(states: int) -> str:
    def real(reference: int, name: str, causality: str, variability: str, more: str) -> str:
        inner = f'derivative="{int(more) - 1}"' if more.isdigit() else more
        return f'<Float64 name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}" {inner}/>'

    variables = "".join(real(i, *declared) for i, declared in enumerate(_VARIABLES))
    variables += real(99, "time", "independent", "continuous", "")
    variables += "".join(real(reference, f"z{reference - 99}", "local", "continuous", "") for reference in (100, 101))

    def unknowns(kind: str, *references: int) -> str:
        return "".join(f'<{kind} valueReference="{reference}"/>' for reference in references)

    outputs = [i for i, declared in enumerate(_VARIABLES) if declared[1] == "output"]
    structure = unknowns("Output", *outputs) + unknowns("ContinuousStateDerivative", *(4, 5)[:states])
    structure += unknowns("InitialUnknown", *outputs, *(4, 5)[:states]) + unknowns("EventIndicator", 100, 101)
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="equations" '
        'instantiationToken="equations"><ModelExchange modelIdentifier="equations" needsCompletedIntegratorStep="true" canGetAndSetFMUState="true"/>'
        f"<ModelVariables>{variables}</ModelVariables><ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


@lru_cache
def equations_fmu(version: int, states: int = 2) -> Path:
    """The FMU for a version of FMI."""
    made = library(f"equations{version}")
    path = made.with_name(f"equations_{version}_{states}.fmu")
    folder = fmpy.platform_tuple if version == 3 else fmpy.platform
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", (_description3 if version == 3 else _description2)(states))
        archive.write(made, f"binaries/{folder}/equations{fmpy.sharedLibraryExtension}")
    return path


def equations(version: int, model: str, name: str = "x", **values: float) -> System:
    """A system of one such FMU."""
    system = System()
    system.add(name, equations_fmu(version, 0 if model == "timer" else 2), {"model": float(MODELS[model]), **values})
    return system
