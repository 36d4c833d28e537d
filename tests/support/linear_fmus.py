"""An FMU of two modes with directional derivatives and state (see fmus/linear.h): its model descriptions, and its matrices."""

from __future__ import annotations

import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from faulty_fmus import library

_NAMES = """
    none directional_fails directional_nan derivatives_fail derivatives_nan endless terminates states_refused other_output other_count
    huge_state forgetful save_fails euler own_steps tolerant counting unreadable
"""
FAULTS = {name: number for number, name in enumerate(_NAMES.split())}  # as in linear.h
PARAMETERS: dict[str, float] = {
    "w1": 3.0, "z1": 0.05, "w2": 20.0, "z2": 0.02, "b1": 1.0, "b2": 40.0, "c1": 1.0, "c2": 1.0, "d": 0.0, "cubic": 0.0, "fault": 0.0
}  # fmt: skip
STATES = ("x[1]", "x[2]", "x[3]", "x[4]")
_FIRST_PARAMETER = 10


def matrices(q1: float = 0.0, **given: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A, B, C, D by hand, where the first mode is deflected by q1."""
    p = {**PARAMETERS, **given}
    a = np.zeros((4, 4))
    a[0, 1] = a[2, 3] = 1.0
    a[1, :2] = -(p["w1"] ** 2) - 3.0 * p["cubic"] * q1 * q1, -2.0 * p["z1"] * p["w1"]
    a[3, 2:] = -(p["w2"] ** 2), -2.0 * p["z2"] * p["w2"]
    b = np.array([[0.0], [p["b1"]], [0.0], [p["b2"]]])
    return a, b, np.array([[p["c1"], 0.0, p["c2"], 0.0]]), np.array([[p["d"]]])


def _interfaces(version: int, directional: str, exchange: bool, states: bool) -> str:
    flag = f'providesDirectionalDerivative{"s" if version == 3 else ""}="true"'
    saves = f'canGetAndSetFMU{"S" if version == 3 else "s"}tate="{str(states).lower()}"'
    steps = 'canHandleVariableCommunicationStepSize="true"'
    return "".join(
        f'<{part} modelIdentifier="linear" {saves} {flag if part in directional else ""} {steps if part == "CoSimulation" else ""}/>'
        for part in (["ModelExchange"] if exchange else []) + ["CoSimulation"]
    )


def _follows(input_: bool) -> str:
    return "" if input_ else ' dependencies=""'


def _description2(interfaces: str, rates: bool, input_: str, follows: bool) -> str:
    def scalar(reference: int, name: str, causality: str, variability: str, rest: str) -> str:
        return (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}">'
            f"<Real {rest}/></ScalarVariable>"
        )

    variables = scalar(0, "u", "input", input_, 'start="0"') + scalar(1, "y", "output", "continuous", "")
    variables += "".join(scalar(2 + i, name, "local", "continuous", "") for i, name in enumerate(STATES))
    variables += "".join(
        scalar(6 + i, f"der({name})", "local", "continuous", f'derivative="{3 + i}"' if rates else "")
        for i, name in enumerate(STATES)
    )
    variables += "".join(
        scalar(_FIRST_PARAMETER + i, name, "parameter", "fixed", f'start="{value}"')
        for i, (name, value) in enumerate(PARAMETERS.items())
    )
    unknowns = "".join(f'<Unknown index="{7 + i}"/>' for i in range(4))
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="linear" guid="linear">'
        f"{interfaces}<ModelVariables>{variables}</ModelVariables><ModelStructure><Outputs>"
        f'<Unknown index="2"{_follows(follows)}/></Outputs><Derivatives>{unknowns}</Derivatives><InitialUnknowns><Unknown index="2"/>{unknowns}'
        "</InitialUnknowns></ModelStructure></fmiModelDescription>"
    )


def _description3(interfaces: str, rates: bool, input_: str, follows: bool) -> str:
    def real(reference: int, name: str, causality: str, variability: str, rest: str = "", inside: str = "") -> str:
        return (
            f'<Float64 name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}" {rest}>'
            f"{inside}</Float64>"
        )

    four = '<Dimension start="4"/>'
    variables = real(0, "u", "input", input_, 'start="0"') + real(1, "y", "output", "continuous")
    variables += real(99, "time", "independent", "continuous")
    variables += real(2, "x", "local", "continuous", inside=four)
    variables += real(6, "der(x)", "local", "continuous", 'derivative="2"' if rates else "", four)
    variables += "".join(
        real(_FIRST_PARAMETER + i, name, "parameter", "fixed", f'start="{value}"')
        for i, (name, value) in enumerate(PARAMETERS.items())
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="linear" instantiationToken="linear">'
        f'{interfaces}<ModelVariables>{variables}</ModelVariables><ModelStructure><Output valueReference="1"{_follows(follows)}/>'
        '<ContinuousStateDerivative valueReference="6"/><InitialUnknown valueReference="1"/><InitialUnknown valueReference="6"/>'
        "</ModelStructure></fmiModelDescription>"
    )


@lru_cache
def linear_fmu(
    version: int,
    directional: str = "",
    *,
    exchange: bool = True,
    states: bool = True,
    rates: bool = True,
    input_: str = "continuous",
    follows: bool = True,
    own_step: float = 0.0,
    default_tolerance: str = "",
) -> Path:
    """The FMU for a version of FMI, with directional derivatives in the interfaces named ("CoSimulation", "ModelExchange").

    Without Model Exchange, state, names of what the derivatives belong to, or with another variability of the input, an output that
    does not follow the input at once, or a step of its own [s], if so told.
    """
    made = library(f"linear{version}")
    key = (version, directional, exchange, states, rates, input_, follows, own_step, default_tolerance)
    path = made.with_name("_".join(map(str, ("linear", *key))).replace(" ", "") + ".fmu")
    interfaces = _interfaces(version, directional, exchange, states)
    told = {"stepSize": own_step, "tolerance": default_tolerance}
    experiment = " ".join(f'{name}="{value}"' for name, value in told.items() if value)
    interfaces += f"<DefaultExperiment {experiment}/>" if experiment else ""
    text = (_description3 if version == 3 else _description2)(interfaces, rates, input_, follows)
    folder = fmpy.platform_tuple if version == 3 else fmpy.platform
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{folder}/linear{fmpy.sharedLibraryExtension}")
    return path


def faulty(name: str, **given: Any) -> dict[str, Any]:
    """Start values with which the FMU goes wrong."""
    return {**given, "fault": float(FAULTS[name])}
