"""The C host (host.c): compiled once, it runs an FMU's library without Python between the calls."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
from fmpy.model_description import ModelDescription
from harness import Measured

from shaper_fmu.export.cache import cached, digest
from shaper_fmu.export.native.toolchain import PLATFORMS, Platform, toolchain_version

STEPS, STEP = 2000, 0.001


def this_platform() -> Platform:
    """The platform that the benchmarks run on. Ends the program where the host cannot run."""
    if fmpy.platform_tuple not in PLATFORMS or os.name != "posix":
        raise SystemExit(f"the benchmarks' C host needs dlopen and a library for {fmpy.platform_tuple}: use Linux or macOS")
    return PLATFORMS[fmpy.platform_tuple]


def compiled(name: str, options: Sequence[str] = ()) -> Path:
    """A C file of this folder compiled for this machine, from the cache or anew. Ends the program with the compiler's words
    if that fails."""
    source = Path(__file__).with_name(name)
    includes = Path(fmpy.__file__).parent / "c-code"
    flags = ["-O2", "-std=c11", "-D_GNU_SOURCE", f"-I{includes}", *options, "-ldl", "-lm"]

    def make() -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / source.stem
            command = [sys.executable, "-m", "ziglang", "cc", str(source), *flags, "-o", str(target)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise SystemExit(f"compiling {source} failed:\n{done.stderr}")
            return target.read_bytes()

    key = digest(source.read_bytes(), *options, toolchain_version(), fmpy.platform_tuple)
    path = cached("bench", f"{source.stem}-{key}", make)
    path.chmod(0o755)
    return path


def shared_python() -> Path | None:
    """The shared library of this Python, or None where Python is linked statically."""
    variables = sysconfig.get_config_vars("LIBDIR", "LIBPL", "INSTSONAME", "LDLIBRARY", "MULTIARCH")
    library_folder, static_folder, *names, multiarch = [str(value or "") for value in variables]
    folders = [library_folder, str(Path(library_folder) / multiarch), static_folder, f"{sys.base_prefix}/lib"]
    candidates = [Path(folder) / name for folder in folders for name in names if ".so" in name or ".dylib" in name]
    return next((path for path in candidates if path.is_file()), None)


@dataclass(frozen=True)
class Hosted:
    """An FMU's library as the host runs it.

    Attributes:
        version: 2 or 3, of FMI.
        resources: as the version wants it, a URI or a path.
        inlet: value reference of the input that is set, -1 for none.
        outlet: value reference of the output that is read.
        passes: timed runs of STEPS steps each, in a round.
    """

    version: int
    library: Path
    token: str
    resources: str
    inlet: int
    outlet: int
    passes: int = 1


def measure(fmus: Sequence[Hosted], rounds: int, python: Path | None = None, keep_state: bool = False) -> list[Measured]:
    """Run the host once: the FMUs take turns in one process, so that what disturbs one disturbs the other.

    `python` is a library to be made global before, for pythonfmu's wrapper; with `keep_state` the host keeps a Python thread
    state, which no plain C host does, and which spares the wrapper to make one in every call. Ends the program with the
    host's words if it fails.
    """
    words: list[object] = [compiled("host.c"), STEP, STEPS, rounds, python or "-"]
    for fmu in fmus:
        words += [fmu.version, fmu.library, fmu.token, fmu.resources, fmu.inlet, fmu.outlet, fmu.passes]
    command = [str(word) for word in words]
    paths = {"PYTHONHOME": sys.base_prefix, "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}
    if keep_state:
        paths["KEEP_THREAD_STATE"] = "1"
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **paths}, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\nended with status {done.returncode}: {done.stderr.strip()}")
    lines = [line.split() for line in done.stdout.splitlines()]
    return [Measured(float(seconds) * 1e6, (float.fromhex(last), float.fromhex(total))) for seconds, last, total in lines]


def hosted(fmu: Path, folder: Path) -> Hosted:
    """Unpack an FMU into `folder`, ready for the host: its first real input is set and its first real output read."""
    description: ModelDescription = fmpy.read_model_description(fmu, validate=False)
    version = 3 if (description.fmiVersion or "").startswith("3") else 2
    token = description.guid if version == 2 else description.instantiationToken
    if not (description.coSimulation and token):
        raise SystemExit(f"{fmu}: its description has no co-simulation or no GUID")
    fmpy.extract(fmu, folder)
    name = description.coSimulation.modelIdentifier
    platform = this_platform()
    binaries = platform.fmi2_folder if version == 2 else platform.name
    real = [v for v in description.modelVariables if v.type in ("Real", "Float64")]
    inputs = [v.valueReference for v in real if v.causality == "input"]
    outlet = next(v.valueReference for v in real if v.causality == "output")
    resources = folder / "resources"
    return Hosted(
        version,
        folder / "binaries" / binaries / f"{name}{platform.suffix}",
        token,
        resources.as_uri() if version == 2 else f"{resources}{os.sep}",
        inputs[0] if inputs else -1,
        outlet,
    )
