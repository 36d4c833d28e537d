"""Native FMUs in a C host: against pythonfmu's, against C written by hand, FMI 3.0 against 2.0, and by themselves."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from harness import Row, alone, compared
from host import Hosted, hosted, measure, shared_python, this_platform

from shaper_fmu import components, find_component
from shaper_fmu.component import Component
from shaper_fmu.export.native.backend import build_native_fmu
from shaper_fmu.export.native.kernels import component_files
from shaper_fmu.export.native.libraries import library
from shaper_fmu.export.native.sources import fmu_sources
from shaper_fmu.export.pythonfmu_backend import build_fmu as build_python_fmu

ROUNDS = 201
"""Turns of native FMUs, a pass of some tenths of a millisecond each."""

PYTHON_ROUNDS, PASSES_IN_ROUND = 3, 50
"""Turns with pythonfmu's FMUs, whose one pass takes as long as hundreds of native ones."""

_HANDWRITTEN = Path(__file__).with_name("mass_spring_damper.c")


def _native(component: type[Component], folder: Path, fmi: int = 2) -> Hosted:
    place = folder / f"native_fmi{fmi}"
    place.mkdir(exist_ok=True)
    fmu = build_native_fmu(component, place, fmi, (this_platform().name,))
    return hosted(fmu, place / component.__name__)


def native_vs_pythonfmu(folder: Path) -> Row:
    """The same component, once as machine code and once as Python, called by the same plain C host."""
    return _against_pythonfmu("native_vs_pythonfmu", folder, "MassSpringDamper", keep_state=False)


def native_vs_pythonfmu_input_shaper(folder: Path) -> Row:
    """The same of the input shaper."""
    return _against_pythonfmu("native_vs_pythonfmu_input_shaper", folder, "InputShaper", keep_state=False)


def native_vs_pythonfmu_at_its_best(folder: Path) -> Row:
    """The plant again, by a host that keeps a Python thread state for pythonfmu's sake."""
    return _against_pythonfmu("native_vs_pythonfmu_at_its_best", folder, "MassSpringDamper", keep_state=True)


def _against_pythonfmu(row: str, folder: Path, name: str, keep_state: bool) -> Row:
    native, python = _native(find_component(name), folder), shared_python()
    if python is None:
        return alone(
            row,
            lambda: measure([native], ROUNDS),
            "pythonfmu not measurable: this Python has no shared library for a C host to load",
        )
    place = folder / "pythonfmu"
    place.mkdir(exist_ok=True)
    peer = hosted(build_python_fmu(find_component(name), place), place / name)
    _check_kinds(native, peer)
    if not peer.library.is_file():
        return alone(row, lambda: measure([native], ROUNDS), "pythonfmu not measurable: it has no wrapper for this platform")
    turns = [replace(native, passes=PASSES_IN_ROUND), peer]
    needed = 0.0 if keep_state else 300.0
    return compared(row, lambda: measure(turns, PYTHON_ROUNDS, python, keep_state), tolerance=1e-12, needed=needed)


def native_vs_handwritten_c(folder: Path) -> Row:
    """The plant's kernels as compiled from Python, and as written in C by hand, in the same layer with the same flags."""
    component = find_component("MassSpringDamper")
    _check_record(component)
    native = _native(component, folder)
    own = {**component_files(component), "kernels.c": _HANDWRITTEN.read_text()}
    sources = fmu_sources(component, native.token, 2, own)
    made = library(component.__name__, this_platform(), 2, sources)
    handwritten = replace(native, library=made)
    return compared("native_vs_handwritten_c", lambda: measure([native, handwritten], ROUNDS), tolerance=1e-15, needed=1 / 1.5)


def native_fmi3_vs_fmi2(folder: Path) -> Row:
    """The plant by FMI 3.0, and by FMI 2.0."""
    component = find_component("MassSpringDamper")
    newer, older = _native(component, folder, fmi=3), _native(component, folder, fmi=2)
    return compared("native_fmi3_vs_fmi2", lambda: measure([newer, older], ROUNDS), tolerance=0.0)


def native_set_step_get(folder: Path) -> list[Row]:
    """Each component by FMI 2.0: microseconds for set, step and get."""
    rows = []
    for name, component in components().items():
        fmu = _native(component, folder)
        rows.append(alone(f"native_set_step_get_{_snake(name)}", lambda fmu=fmu: measure([fmu], ROUNDS)))
    return rows


def _check_kinds(native: Hosted, python: Hosted) -> None:
    """Equal results do not tell which is which, so what is in the FMUs has to: pythonfmu's names its Python module."""
    names_module = [(fmu.library.parents[2] / "resources" / "slavemodule.txt").is_file() for fmu in (native, python)]
    if names_module != [False, True]:
        raise SystemExit(
            "native_vs_pythonfmu: ours has to be native and the peer by pythonfmu; carries Python: " + str(names_module)
        )


def _snake(name: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


def _check_record(component: type[Component]) -> None:
    """The struct written by hand has to be the component's record, or nothing that it computes can be right."""
    kinds = {"d": "double", "i": "int"}
    wanted = [(kinds[v.code], v.name, str(v.size or "")) for v in component.variables.values()]
    found = re.findall(r"^    (double|int) (\w+)(?:\[(\d+)\])?;$", _HANDWRITTEN.read_text().split("}")[0], re.MULTILINE)
    if found != wanted:
        raise SystemExit(f"{_HANDWRITTEN}: the struct is not the record of {component.__name__}; it has to be {wanted}")
