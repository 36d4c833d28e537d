"""An FMU of model exchange whose input, states and outputs are arrays (see fmus/arrays3.c)."""

from __future__ import annotations

import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy
from faulty_fmus import library


@lru_cache
def arrays_fmu() -> Path:
    """The FMU, of FMI 3.0."""

    def real(reference: int, name: str, more: str, count: int) -> str:
        return (
            f'<Float64 name="{name}" valueReference="{reference}" variability="continuous" {more}>'
            f'<Dimension start="{count}"/></Float64>'
        )

    variables = real(0, "u", 'causality="input" start="0 0 0.7"', 3) + real(1, "x", 'causality="local"', 2)
    variables += real(2, "der(x)", 'causality="local" derivative="1"', 2) + real(3, "y", 'causality="output"', 2)
    variables += '<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>'
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="3.0" modelName="arrays" instantiationToken="arrays">'
        f'<ModelExchange modelIdentifier="arrays"/><ModelVariables>{variables}</ModelVariables><ModelStructure>'
        '<Output valueReference="3"/><ContinuousStateDerivative valueReference="2"/><InitialUnknown valueReference="2"/>'
        '<InitialUnknown valueReference="3"/></ModelStructure></fmiModelDescription>'
    )
    made = library("arrays3")
    path = made.with_name("arrays.fmu")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.write(made, f"binaries/{fmpy.platform_tuple}/arrays{fmpy.sharedLibraryExtension}")
    return path
