"""FMUs that fail in each call in turn (see fmus/faulty.h): their model descriptions, and systems with them."""

from __future__ import annotations

import atexit
import shutil
import tempfile
import zipfile
from functools import lru_cache
from pathlib import Path

import fmpy

from shaper_fmu.export.native.toolchain import build_library, platform_named
from shaper_fmu.master.system import System

SOURCES = Path(__file__).with_name("fmus")
ERROR = 3
_NAMES = """
    none setup enter_initialization exit_initialization set_real set_integer set_boolean get_real get_integer get_boolean step reset
    enter_event enter_step update endless terminate_in_update terminate_in_step early not_a_number infinite huge_value percent
    silent slow
"""
FAULTS = {name: number for number, name in enumerate(_NAMES.split())}  # as in faulty.h

VARIABLES = [  # in the order of the value references in faulty.h
    ("input", "Real", "input"), ("output", "Real", "output"), ("fault_time", "Real", "parameter"),
    ("count_in", "Integer", "input"), ("count_out", "Integer", "output"), ("fault", "Integer", "parameter"),
    ("status", "Integer", "parameter"), ("flag_in", "Boolean", "input"), ("flag_out", "Boolean", "output"),
]  # fmt: skip
MORE = [("spare", "Real", ""), ("small", "UInt8", "input"), ("single", "Float32", "input"), ("time", "Float64", "independent")]
TEXTS = (("text_in", "input"), ("text_out", "output"))  # no master can move these: the FMU refuses every call for them
TYPES3 = {"Real": "Float64", "Integer": "Int32"}


def description2(token: str) -> str:
    def variable(reference: int, name: str, kind: str, causality: str) -> str:
        start = "" if causality == "output" else f' start="{"false" if kind == "Boolean" else 0}"'
        variability = {"parameter": "fixed"}.get(causality, "continuous" if kind == "Real" else "discrete")
        return (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}">'
            f"<{kind}{start}/></ScalarVariable>"
        )

    variables = "".join(variable(i, *declared) for i, declared in enumerate(VARIABLES))
    start_of = {"input": ' start="as it was"', "output": ""}
    variables += "".join(
        f'<ScalarVariable name="{name}" valueReference="{i}" causality="{causality}" variability="discrete">'
        f"<String{start_of[causality]}/></ScalarVariable>"
        for i, (name, causality) in enumerate(TEXTS)
    )
    outputs = "".join(f'<Unknown index="{i + 1}" dependencies=""/>' for i, v in enumerate(VARIABLES) if v[2] == "output")
    outputs += f'<Unknown index="{len(VARIABLES) + len(TEXTS)}" dependencies=""/>'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="faulty" guid="{token}">'
        '<CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true"/>'
        f"<ModelVariables>{variables}</ModelVariables>"
        f"<ModelStructure><Outputs>{outputs}</Outputs><InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure>"
        "</fmiModelDescription>"
    )


def description3(token: str) -> str:
    def variable(reference: int, name: str, kind: str, causality: str) -> str:
        start = f' start="{"false" if kind == "Boolean" else 0}"' if causality in ("input", "parameter") else ""
        real = kind in ("Real", "Float64", "Float32")
        variability = {"parameter": "fixed"}.get(causality, "continuous" if real else "discrete")
        return (
            f'<{TYPES3.get(kind, kind)} name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{variability}"{start}/>'
        )

    variables = "".join(variable(i, *declared) for i, declared in enumerate([*VARIABLES, *MORE]) if declared[2])
    for i, (name, causality) in enumerate(TEXTS, 100):
        start = '<Start value="as it was"/>' if causality == "input" else ""
        variables += f'<String name="{name}" valueReference="{i}" causality="{causality}">{start}</String>'
    references = [*[i for i, v in enumerate(VARIABLES) if v[2] == "output"], 101]
    outputs = "".join(f'<{tag} valueReference="{i}" dependencies=""/>' for tag in ("Output", "InitialUnknown") for i in references)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<fmiModelDescription fmiVersion="3.0" modelName="faulty" instantiationToken="{token}">'
        '<CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true" hasEventMode="true" '
        'mightReturnEarlyFromDoStep="true"/>'
        f"<ModelVariables>{variables}</ModelVariables><ModelStructure>{outputs}</ModelStructure></fmiModelDescription>"
    )


def library_path(version: int, platform: str = "") -> str:
    return f"binaries/{platform or (fmpy.platform_tuple if version == 3 else fmpy.platform)}/faulty{fmpy.sharedLibraryExtension}"


def packed(path: Path, version: int, library: Path | None, token: str = "{faulty}", platform: str = "") -> Path:
    """An FMU file with this library."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description3(token) if version == 3 else description2(token))
        if library is not None:
            archive.write(library, library_path(version, platform))
    return path


@lru_cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="faulty_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@lru_cache
def library(name: str) -> Path:
    """The library of a source file in fmus/, for this machine."""
    path = _folder() / (name + fmpy.sharedLibraryExtension)
    build_library([SOURCES / f"{name}.c"], path, platform_named("this"), [Path(str(fmpy.__file__)).parent / "c-code"])
    return path


@lru_cache
def faulty_fmu(version: int) -> Path:
    """The faulty FMU of this version of FMI."""
    return packed(_folder() / f"faulty{version}.fmu", version, library(f"faulty{version}"))


def alone(version: int, fault: str = "none", status: int = ERROR, fault_time: float = 0.0, name: str = "x") -> System:
    """The faulty FMU alone, with start values for all inputs."""
    system = System()
    inputs = {variable: 0 for variable, _, causality in [*VARIABLES, *(MORE if version == 3 else [])] if causality == "input"}
    system.add(name, faulty_fmu(version), {**inputs, "fault_time": fault_time, "fault": FAULTS[fault], "status": status})
    return system


def chain(path: Path, fault: str = "none", status: int = ERROR, fault_time: float = 0.0) -> System:
    """first -> x -> last, of one FMU; x fails."""
    system = System()
    system.add("first", path, input=0.0, count_in=0, flag_in=False)
    system.add("x", path, {"fault_time": fault_time, "fault": FAULTS[fault], "status": status})
    system.add("last", path)
    for source, target in (("first", "x"), ("x", "last")):
        system.connect(f"{source}.output", f"{target}.input")
        system.connect(f"{source}.count_out", f"{target}.count_in")
        system.connect(f"{source}.flag_out", f"{target}.flag_in")
    if system.fmus["x"].version == 3:
        system.set("last.small", 0)
        system.set("last.single", 0.0)
        for name in ("first", "x"):
            system.set(f"{name}.small", 0)
            system.set(f"{name}.single", 0.0)
    return system
