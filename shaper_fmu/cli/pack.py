"""The command `shaper-fmu pack`."""

from __future__ import annotations

from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shaper_fmu.cli.arguments import input_file, output_file, pairs, time_span, wrong_usage
from shaper_fmu.cli.info_words import size
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.paths import wrote
from shaper_fmu.console import err, out, show
from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.page.blocks import Table

if TYPE_CHECKING:
    from shaper_fmu.container.build import Packed
    from shaper_fmu.master.structure import SystemStructure
    from shaper_fmu.master.system import System


class Fmi(StrEnum):
    two = "2"
    three = "3"


def pack(
    system: Annotated[Path, typer.Argument(help="SSP archive (.ssp).", callback=input_file(".ssp"))],
    output: Annotated[
        Path | None, typer.Option(help="The FMU to write. Default: <system>.fmu.", callback=output_file(".fmu"))
    ] = None,
    fmi: Annotated[Fmi, typer.Option(help="Version of FMI outside; inside it may be 2.0 and 3.0.")] = Fmi.two,
    expose: Annotated[
        list[str] | None,
        typer.Option(help="Show this variable or parameter, too, such as plant.mass, or plant.* for all; may be repeated."),
    ] = None,
    rename: Annotated[
        list[str] | None, typer.Option(help="Another name outside, such as plant.position=x; may be repeated.")
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(help="Longest communication step inside [s]. Default: the system's, or that of the host.", parser=time_span),
    ] = None,
    algorithm: Annotated[Algorithm | None, typer.Option(help="Master algorithm. Default: the system's, or jacobi.")] = None,
    grid: Annotated[bool, typer.Option("--grid", help="End steps inside only at communication points, not at events.")] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="Start value, for example plant.mass=2, or of the system's own inputs; may be repeated."),
    ] = None,
    parameter_sets: Annotated[
        list[str] | None,
        typer.Option("--parameter-set", help="Parameter set: a file (.ssv), or the name of one in the archive; may be repeated."),
    ] = None,
    variant: Annotated[
        str | None, typer.Option(help="Variant to pack: another .ssd file of the archive. Default: SystemStructure.ssd.")
    ] = None,
    platforms: Annotated[
        list[str] | None,
        typer.Option(
            "--platform", help="Platform such as x86_64-windows, or `this`; may be repeated. Default: all that all FMUs have."
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="The model's name. Default: that of the file.")] = "",
    force: Force = False,
) -> None:
    """Pack the system of an SSP archive into one FMU, which any tool that imports FMUs can run.

    The FMUs are inside, coupled as `run` couples them; steps inside end at events, whatever step the host takes. The system's own
    connectors become inputs, outputs and parameters; of a system without any, all free inputs and all outputs do.

    \b
    Examples:
        shaper-fmu pack crane.ssp
        shaper-fmu pack crane.ssp --fmi 3 --expose "crane.*" --rename crane.swing_angle=swing
    """
    from shaper_fmu.export.native.toolchain import platform_named
    from shaper_fmu.ssp.archive import load_ssp
    from shaper_fmu.ssp.packing import connector_variables, connectors_not_shown, pack_ssp_system
    from shaper_fmu.ssp.parameter_sets import apply_parameter_set

    target: Path = output_file(".fmu")(output or Path(f"{system.stem}.fmu"))
    check_kept(target, force, "--output")
    renamed = pairs(rename, "--rename", "plant.position=x")
    check_platforms(platforms)
    loaded = load_ssp(system, variant)
    for note in loaded.notes:
        err.print(f"note: {note}")
    for which in parameter_sets or []:
        apply_parameter_set(loaded, which)
    for name_, value in pairs(settings, "--set", "instance.variable=value", empty=True).items():
        with wrong_usage("--set"):
            loaded.set(name_, value)
    version = int(fmi)
    for text in connectors_not_shown(loaded, version):
        err.print(f"note: not shown: {text}")
    with wrong_usage("--expose or --rename") if expose or renamed else nullcontext():
        connector_variables(loaded, version, expose=expose or (), rename=renamed)
    packed = pack_ssp_system(
        loaded, target, version, expose=expose or (), rename=renamed, name=name or None, step=step, algorithm=algorithm,
        exact=False if grid else None, platforms=platforms or (), progress=lambda what: err.print(f"{what} ..."),
    )  # fmt: skip
    print_packed(packed, loaded.system, version)
    if platform_named("this").name in packed.platforms:
        _try_to_start(loaded.system)


def _try_to_start(system: System) -> None:
    """Initialize the system in a process of its own. Raises Exit if that fails: start values are judged by the FMUs alone."""
    from shaper_fmu.errors import SimulationError

    try:
        system.simulate(0.0, 1e-3, isolate=True, record=[], time_limit=60.0)
    except SimulationError as error:
        out.print(f"not started: the FMU is written, but its system does not start here with these values: {error}")
        raise typer.Exit(1) from None


def check_platforms(names: list[str] | None) -> None:
    """Raise BadParameter for a platform that does not exist."""
    from shaper_fmu.export.native.toolchain import platform_named

    with wrong_usage("--platform"):
        for name in names or []:
            platform_named(name)


def print_packed(packed: Packed, system: SystemStructure, fmi: int) -> None:
    """Print what is inside, for which platforms, and how large the file is."""
    rows = [
        [name, fmu.name, str(fmu.description.fmiVersion), fmu.description.generationTool or ""] for name, fmu in system.fmus.items()
    ]
    show(Table("", ["inside", "FMU", "FMI", "made by"], rows, left_aligned=True))
    for note in packed.notes:
        err.print(f"note: {note}")
    if packed.left_out:
        err.print(f"note: not for {', '.join(packed.left_out)}, for which not every FMU inside has a library")
    out.print(f"platforms: {', '.join(packed.platforms)}")
    wrote(packed.path, f" (FMI {fmi}.0, {size(packed.path.stat().st_size)})")
