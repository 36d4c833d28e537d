"""An FMU that may be instantiated once per process, since its instances share globals (see fmus/global2.c)."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
from faulty_fmus import SOURCES

from shaper_fmu.export.native.toolchain import build_library, platform_named

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="global" guid="{guid}">
  <CoSimulation modelIdentifier="global" canHandleVariableCommunicationStepSize="true" canBeInstantiatedOnlyOncePerProcess="true"/>
  <ModelVariables>
    <ScalarVariable name="rate" valueReference="0" causality="input" variability="continuous"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="sum" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable>
    <ScalarVariable name="fatal" valueReference="0" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="forgetful" valueReference="1" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs>
    <InitialUnknowns><Unknown index="2" dependencies=""/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def build_global(folder: Path, name: str = "global", stays: bool = False) -> Path:
    """Write `folder`/<name>.fmu; its library `stays` loaded for ever, or not."""
    library, source = folder / f"global{fmpy.sharedLibraryExtension}", folder / "source.c"
    source.write_text(f"#define STAYS {int(stays)}\n" + (SOURCES / "global2.c").read_text())
    build_library([source], library, platform_named("this"), [Path(str(fmpy.__file__)).parent / "c-code"])
    with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.replace("guid}", f"{folder}}}"))  # another FMU in each folder
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return folder / f"{name}.fmu"
