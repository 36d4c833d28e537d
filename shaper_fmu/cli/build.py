"""The command `shaper-fmu build`."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.cli.arguments import input_file, output_file, output_folder, wrong_usage
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.made import known_call
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.cli.paths import absolute, wrote
from shaper_fmu.component import Component
from shaper_fmu.console import err
from shaper_fmu.progress import progress

Say = Callable[[str], None]


class _Backend(StrEnum):
    native = "native"
    python = "python"


class _Fmi(StrEnum):
    two = "2"
    three = "3"


def build(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="Components, Python files with components, or folders of SSP systems. Default: all components."),
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder for the FMUs.", callback=output_folder)] = Path("fmus"),
    backend: Annotated[
        _Backend, typer.Option(help="native: machine code without Python; python: the source, run by the host's Python.")
    ] = _Backend.native,
    fmi: Annotated[_Fmi, typer.Option(help="Version of FMI.")] = _Fmi.two,
    platforms: Annotated[
        list[str] | None,
        typer.Option("--platform", help="Platform such as x86_64-windows, or `this`; may be repeated. Default: five of 64 bits."),
    ] = None,
    starts: Annotated[
        list[str] | None,
        typer.Option("--start", help="Another start value for a component, such as profile=s_curve; may be repeated."),
    ] = None,
    without: Annotated[
        list[str] | None,
        typer.Option("--without", help="Output to leave out of the FMU, such as a Boolean; may be repeated."),
    ] = None,
    c: Annotated[
        Path | None,
        typer.Option("--c", help="Folder for the kernels alone, as C for controllers, instead of FMUs.", callback=output_folder),
    ] = None,
    wasm: Annotated[
        Path | None,
        typer.Option(
            "--wasm", help="Folder for the kernels alone, as WebAssembly for pages, instead of FMUs.", callback=output_folder
        ),
    ] = None,
    name: Annotated[
        str, typer.Option(help="With --start or --without: the FMU's name. Default: a name such as MotionProfile_s_curve.")
    ] = "",
    force: Force = False,
) -> None:
    """Build FMUs from components, and SSP archives from system folders (with FMUs that exist already).

    Compiled code is kept in a cache, so that the next build takes seconds.
    """
    from shaper_fmu.export.build import build_fmu
    from shaper_fmu.export.native.toolchain import USUAL_PLATFORMS, has_toolchain
    from shaper_fmu.ssp.archive import archive_of, pack_ssp

    folders = [name for name in names or [] if os.path.isdir(name)]
    input_file()([Path(name) for name in names or [] if name.endswith(".py") and name not in folders])
    _check(folders, platforms or [], backend, fmi)
    components = _components(names, folders)
    if starts or without or name:
        components = [_changed(components, starts or [], without or [], name)]
    _check_files(components)
    if c is not None or wasm is not None:
        _write_kernels(components, folders, c, wasm, force)
        return
    archives = {absolute(Path(folder)): absolute(archive_of(folder)) for folder in folders}
    output_file()([*(output / f"{component.__name__}.fmu" for component in components), *archives.values()])

    chosen_calls = {component: _call(component, backend, fmi, starts, without) for component in components}
    for component, call in chosen_calls.items():
        fmu = output / f"{component.__name__}.fmu"
        if known_call(fmu) is not None or not _is_ours(fmu):
            check_kept(fmu, force, "--output", call)
    for archive in archives.values():
        check_kept(archive, force, "NAMES", ["build", str(archive)])

    tell_missing(fmus=bool(components) and (has_toolchain() or backend is _Backend.python))  # shipped FMUs have theirs

    def make(component: type[Component], say: Say) -> Path:
        chosen = platforms or []
        return build_fmu(component, output, backend=backend.value, fmi=int(fmi), platforms=chosen, progress=say)

    parts = 1 if backend is _Backend.python else 2 + len(platforms or USUAL_PLATFORMS)
    for path, call in zip(_built(components, make, parts), chosen_calls.values(), strict=True):
        wrote(path, verb="built", call=call)
    for folder, archive in archives.items():
        wrote(pack_ssp(folder, output, archive, platforms or []), verb="built", call=["build", str(archive)])


def _write_kernels(components: list[type[Component]], folders: list[str], c: Path | None, wasm: Path | None, force: bool) -> None:
    from shaper_fmu.export.plain_c import write_c
    from shaper_fmu.export.wasm import write_wasm

    for target, option, write in ((c, "--c", write_c), (wasm, "--wasm", write_wasm)):
        if target is None:
            continue
        if folders:
            raise typer.BadParameter(f"{folders[0]}: a system has no kernel of its own; name components", param_hint=option)
        for component in components:
            kernel = target / f"{component.__name__}{option.replace('--', '.')}"
            call = ["build", option, component.__module__, component.__name__]
            check_kept(kernel, force, option, call)
            for path in write(component, target):
                wrote(path, call=call)


def _call(
    component: type[Component], backend: _Backend, fmi: _Fmi, starts: list[str] | None, without: list[str] | None
) -> list[str]:
    """By what an FMU is known: what makes it another one, not who else is built in the same call."""
    return ["build", component.__module__, component.__name__, backend, fmi, *sorted(starts or []), *sorted(without or [])]


def _is_ours(fmu: Path) -> bool:
    """Whether a file is an FMU that a shaper-fmu has made, which may be built anew."""
    from shaper_fmu.errors import ShaperFmuError
    from shaper_fmu.info import fmu_info

    try:
        return fmu.is_file() and fmu_info(fmu).tool.startswith("shaper-fmu")
    except ShaperFmuError:
        return False


def _components(names: list[str] | None, folders: list[str]) -> list[type[Component]]:
    from shaper_fmu.registry import components, load_components

    if not names:
        return list(components().values())
    found = []
    for name in names:
        if name not in folders:
            found += load_components(Path(name)) if name.endswith(".py") else [_component(name)]
    return found


def _component(name: str) -> type[Component]:
    from shaper_fmu.registry import find_component

    with wrong_usage("NAMES"):
        return find_component(name)


def _check(folders: list[str], platforms: list[str], backend: _Backend, fmi: _Fmi) -> None:
    """Raise BadParameter if the FMUs cannot be built, whatever the files contain."""
    from shaper_fmu.export.native.toolchain import platform_named
    from shaper_fmu.ssp.names import DESCRIPTION

    for folder in folders:
        if not (Path(folder) / DESCRIPTION).is_file():
            raise typer.BadParameter(f"{folder}: no {DESCRIPTION} in this folder", param_hint="NAMES")
    with wrong_usage("--platform"):
        for name in platforms:
            platform_named(name, 0 if folders else int(fmi))
    if backend is _Backend.python and fmi is not _Fmi.two:
        raise typer.BadParameter("the python backend builds FMI 2.0 only; FMI 3.0 needs --backend native", param_hint="--fmi")


def _check_files(components: list[type[Component]]) -> None:
    """Raise BadParameter for components whose FMUs would be one file, as names that differ in case are on some systems."""
    known: dict[str, type[Component]] = {}
    for component in components:
        other = known.setdefault(component.__name__.lower(), component)
        if other is not component:
            names = f"{other.__name__} of {other.__module__} and {component.__name__} of {component.__module__}"
            raise typer.BadParameter(f"{names} would be written into one file; build them into two folders", param_hint="NAMES")


def _changed(components: list[type[Component]], starts: list[str], without: list[str], name: str) -> type[Component]:
    from shaper_fmu.export.start_values import with_start_values

    if len(components) != 1 or not (starts or without):
        hint = "--start" if starts or not without else "--without"
        raise typer.BadParameter("start values and outputs to leave out are for one component that is named", param_hint=hint)
    for start in starts:
        if "=" not in start:
            raise typer.BadParameter(f"{start!r} is not of the form variable=value", param_hint="--start")
    with wrong_usage("--start" if starts or not without else "--without"):
        return with_start_values(components[0], dict(start.split("=", 1) for start in starts), name, without)


def _built(components: list[type[Component]], make: Callable[[type[Component], Say], Path], parts: int) -> list[Path]:
    """Build side by side, since the compilers are processes of their own; the first fault ends it. `parts` are those of one FMU."""
    with progress("building", err) as update, ThreadPoolExecutor(os.cpu_count()) as pool:
        done = itertools.count(1)

        def say(_what: str) -> None:
            update(next(done), parts * len(components))

        waiting = [pool.submit(make, component, say) for component in components]
        try:
            paths = []
            for future in waiting:
                paths.append(future.result())
                say("written")
            return paths
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
