"""The mass on a spring for FMI 1.0 (see fmus/spring1.c): its model descriptions, and its motion by the formula."""

from __future__ import annotations

import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
import numpy as np
from faulty_fmus import library
from scipy.linalg import expm

MASS, STIFFNESS, DAMPING = 2.0, 50.0, 1.0
PERIOD = 0.35
FAULTS = {"none": 0, "step": 1, "discard": 2, "pending": 3, "warning": 4, "reset": 6, "initialization": 7, "end": 8}
CAPABILITIES = 'canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true"'
_UNITS = """<UnitDefinitions><BaseUnit unit="N"><DisplayUnitDefinition displayUnit="kN" gain="0.001"/></BaseUnit><BaseUnit unit="m"/>
<BaseUnit unit="m/s"/></UnitDefinitions>"""


def _scalar(name: str, reference: int, roles: str, typed: str, inside: str = "") -> str:
    return f'<ScalarVariable name="{name}" valueReference="{reference}" {roles}><{typed}/>{inside}</ScalarVariable>'


_NONE = "<DirectDependency/>"
_VARIABLES = "".join([
    _scalar("force", 0, 'causality="input"', 'Real unit="N" start="0" fixed="false"'),
    _scalar("position", 1, 'causality="output"', 'Real unit="m"', _NONE),
    _scalar("speed", 2, 'causality="output"', 'Real unit="m/s"', _NONE),
    _scalar("sum", 8, 'causality="output"', "Real", "<DirectDependency><Name>force</Name></DirectDependency>"),
    _scalar("drop", 1, 'causality="output" alias="negatedAlias"', 'Real unit="m"', _NONE),
    _scalar("same", 1, 'causality="internal" alias="alias"', "Real"),
    _scalar("mass", 3, 'variability="parameter"', 'Real start="2" fixed="true"'),
    _scalar("stiffness", 4, 'variability="parameter" causality="internal"', 'Real start="50"'),
    _scalar("damping", 5, 'variability="parameter"', 'Real start="1"'),
    _scalar("excitation", 5, 'variability="parameter" alias="negatedAlias"', 'Real start="-1"'),
    _scalar("pull", 0, 'causality="input" alias="negatedAlias"', 'Real unit="N" start="0"'),
    _scalar("seen", 7, 'causality="output"', "Real", _NONE),
    _scalar("fault", 0, 'variability="parameter"', 'Integer start="0"'),
    _scalar("fault_time", 6, 'variability="parameter"', 'Real start="0"'),
    _scalar("stiction", 9, 'variability="parameter"', 'Real start="0"'),
    _scalar("count_in", 1, 'causality="input" variability="discrete"', 'Integer start="0"'),
    _scalar("count_out", 2, 'causality="output" variability="discrete"', "Integer"),
    _scalar("steps", 3, 'causality="output" variability="discrete"', "Integer", _NONE),
    _scalar("minus_steps", 3, 'causality="output" variability="discrete" alias="negatedAlias"', "Integer", _NONE),
    _scalar("updates", 4, 'variability="discrete"', "Integer"),
    _scalar("held", 0, 'causality="input" variability="discrete"', 'Boolean start="false"'),
    _scalar("moving", 1, 'causality="output" variability="discrete"', "Boolean", _NONE),
    _scalar("resting", 1, 'causality="output" variability="discrete" alias="negatedAlias"', "Boolean", _NONE),
])  # fmt: skip


def description(implementation: str) -> str:
    """The model description; of a slave, or of a model without an `implementation`."""
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="1.0" modelName="spring" modelIdentifier="spring" '
        f'guid="spring" numberOfContinuousStates="2" numberOfEventIndicators="1">{_UNITS}'
        f"<ModelVariables>{_VARIABLES}</ModelVariables>{implementation}</fmiModelDescription>"
    )


def slave(capabilities: str = CAPABILITIES) -> str:
    """The Implementation of a slave with these capabilities."""
    return f"<Implementation><CoSimulation_StandAlone><Capabilities {capabilities}/></CoSimulation_StandAlone></Implementation>"


@lru_cache
def spring_fmu(implementation: str = slave(), changes: tuple[tuple[str, str], ...] = ()) -> Path:
    """The FMU, with `changes` (old text, new text) of its description."""
    made = library("spring1")
    text = description(implementation)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = made.with_name(f"spring_{len(text)}_{abs(hash(text))}.fmu")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{fmpy.platform}/spring{fmpy.sharedLibraryExtension}")
    return path


def model() -> Path:
    """The same as a model."""
    return spring_fmu("")


def moved(forces: np.ndarray, step: float, damping: float = DAMPING) -> np.ndarray:
    """Positions by the matrix exponential, where forces[k] is held over step k; shape (len(forces) + 1,)."""
    rates = np.array([[0.0, 1.0, 0.0], [-STIFFNESS / MASS, -damping / MASS, 1.0 / MASS], [0.0, 0.0, 0.0]])
    over, state, found = expm(rates * step), np.zeros(3), [0.0]
    for force in forces:
        state[2] = force
        state = over @ state
        found.append(state[0])
    return np.array(found)
