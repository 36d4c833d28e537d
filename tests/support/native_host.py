"""Native FMUs for tests, and their libraries called directly, as an importer does: by the types of FMI's own headers.

With SHAPER_FMU_TEST_SANITIZED=1 in the environment the libraries are those of gcc with AddressSanitizer and
UndefinedBehaviorSanitizer, so that every native test can run over them (see test_native_sanitized.py).
"""

from __future__ import annotations

import atexit
import ctypes
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import fmpy

from shaper_fmu.component import Component
from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.description_parts import COMPILED_SOURCES
from shaper_fmu.export.native import backend
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.native.sources import fmu_sources
from shaper_fmu.export.native.toolchain import PLATFORMS, toolchain_version
from shaper_fmu.registry import components

SANITIZED = os.environ.get("SHAPER_FMU_TEST_SANITIZED") == "1"
LAYER = Path(backend.__file__).parent
HOSTS = Path(__file__).parent / "hosts"
HEADERS = Path(fmpy.__file__).parent / "c-code"
ADDRESS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=undefined", "-fno-omit-frame-pointer")
THREAD = ("-fsanitize=thread",)

_scratch = tempfile.TemporaryDirectory(prefix="native_fmus_")
atexit.register(_scratch.cleanup)


@lru_cache
def native_fmu(name: str, fmi: int) -> Path:
    """The component's FMU of this FMI version for this machine alone."""
    folder = Path(_scratch.name) / f"fmi{fmi}"
    path = backend.build_native_fmu(components()[name], folder, fmi, ("x86_64-linux",))
    if not SANITIZED:
        return path
    library = sanitized_library(components()[name], token_of(path), fmi, ADDRESS)
    return with_library(path, library, Path(_scratch.name) / f"sanitized{fmi}" / path.name)


@lru_cache
def complete_fmu(name: str, fmi: int) -> Path:
    """The component's FMU of this FMI version for all platforms, those of 32 bits, too."""
    return backend.build_native_fmu(components()[name], Path(_scratch.name) / f"complete{fmi}", fmi, tuple(PLATFORMS))


def with_library(fmu: Path, library: Path, target: Path) -> Path:
    """A copy of the FMU with another library for this machine."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            new.writestr(name, library.read_bytes() if name.endswith(".so") else old.read(name))
    return target


def token_of(fmu: Path) -> str:
    """The GUID or instantiation token in the model description."""
    with zipfile.ZipFile(fmu) as archive:
        found = re.search(r'(?:guid|instantiationToken)="([^"]+)"', archive.read("modelDescription.xml").decode())
    assert found
    return found[1]


def sanitized_library(component: type[Component], token: str, fmi: int, flags: tuple[str, ...], layer: Path = LAYER) -> Path:
    """The FMI layer and the kernels, compiled with the checks of these sanitizers."""
    sources = fmu_sources(component, token, fmi, component_files(component))
    sources |= {file.name: file.read_text() for file in layer.glob("*.[ch]") if file.name in sources}
    key = digest(*flags, *[part for file in sorted(sources.items()) for part in file], Path(__file__).read_bytes())

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in sources.items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            inputs = [str(Path(folder) / name) for name in COMPILED_SOURCES]
            target = Path(folder) / "library.so"
            options = ["-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", f"-I{folder}", *flags]
            gcc([*options, *inputs, "-lm", "-o", str(target)])
            return target.read_bytes()

    return cached("sanitized", f"{component.__name__}-{key}.so", make)


def gcc(arguments: list[str]) -> None:
    """Compile with gcc."""
    _compile(["gcc", "-std=gnu99", "-g", "-O1", f"-I{HEADERS}", *arguments])


def _compile(command: list[str]) -> None:
    plain = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}  # compilers run without sanitizers
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=plain)
    assert done.returncode == 0, done.stderr


def host_program(source: str, platform: str = "x86_64-linux") -> Path:
    """A program of tests/support/hosts, compiled by ziglang for a platform."""
    known = PLATFORMS[platform]
    flags = ["-O1", "-s", f"-I{HEADERS}", *([] if known.suffix == ".dll" else ["-ldl", "-lm", "-lpthread"])]
    key = digest(known.target, toolchain_version(), (HOSTS / source).read_bytes(), (HOSTS / "library.h").read_bytes())

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as scratch:
            target = Path(scratch) / "host.exe"
            _compile(
                [sys.executable, "-m", "ziglang", "cc", "-target", known.target, str(HOSTS / source), *flags, "-o", str(target)]
            )
            return target.read_bytes()

    path = cached("hosts", f"{Path(source).stem}-{key}.exe", make)
    path.chmod(0o755)
    return path


def binary_of(fmu: Path, platform: str = "x86_64-linux") -> Path:
    """The FMU's library for a platform, unpacked beside it."""
    known = PLATFORMS[platform]
    folder = Path(_scratch.name) / "libraries" / fmu.parent.name / platform
    with zipfile.ZipFile(fmu) as archive:
        names = [
            n
            for n in archive.namelist()
            if n.split("/")[1:2] in ([known.fmi3_folder], [known.fmi2_folder]) and n.endswith(known.suffix)
        ]
        assert len(names) == 1, names
        folder.mkdir(parents=True, exist_ok=True)
        target = folder / Path(names[0]).name
        if not target.exists():
            target.write_bytes(archive.read(names[0]))
    return target


_DIRECT: dict[str, Any] = {
    "fmi2Real": ctypes.c_double, "fmi2Boolean": ctypes.c_int, "fmi2Type": ctypes.c_int, "fmi2StatusKind": ctypes.c_int,
    "fmi2Status": ctypes.c_int, "fmi3Status": ctypes.c_int, "fmi3Float64": ctypes.c_double, "fmi3Boolean": ctypes.c_bool,
    "fmi2String": ctypes.c_char_p, "fmi3String": ctypes.c_char_p, "char*": ctypes.c_char_p, "size_t": ctypes.c_size_t,
    "fmi3ValueReference": ctypes.c_uint32, "void": None,
}  # fmt: skip
"""How the headers' types are passed; arrays and all that is not here are pointers."""


@lru_cache
def signatures(fmi: int) -> dict[str, tuple[Any, list[Any]]]:
    """Every function that the official header declares for export: its result and its arguments as ctypes types."""
    exported = re.findall(rf"^\s*FMI{fmi}_Export\s+(\w+)TYPE\s+\w+;", (HEADERS / f"fmi{fmi}Functions.h").read_text(), re.MULTILINE)
    text = re.sub(r"/\*.*?\*/", "", (HEADERS / f"fmi{fmi}FunctionTypes.h").read_text(), flags=re.DOTALL)
    found = {}
    for name in exported:
        match = re.search(rf"typedef\s+(?:const\s+)?(\w+\s*\*?)\s*{name}TYPE\s*\(([^)]*)\)", text)
        assert match, name
        arguments = [_passed(argument) for argument in match[2].split(",") if argument.strip() != "void"]
        found[name] = (_DIRECT.get(match[1].replace(" ", ""), ctypes.c_void_p), arguments)
    return found


def _passed(declaration: str) -> Any:
    words = declaration.replace("const ", "").split()
    return ctypes.c_void_p if "[" in declaration or "*" in declaration else _DIRECT.get(words[0], ctypes.c_void_p)


def load(fmu: Path, fmi: int, mode: int = ctypes.DEFAULT_MODE) -> ctypes.CDLL:
    """The FMU's library with the argument types of all functions."""
    library = ctypes.CDLL(str(binary_of(fmu)), mode=mode)
    for name, (result, arguments) in signatures(fmi).items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
