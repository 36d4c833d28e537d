"""The command `shaper-fmu info`: what a file is, at a glance, and which commands take it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from shaper_fmu.cli.arguments import input_file
from shaper_fmu.console import out

_FMU, _SYSTEM = (".fmu",), (".ssp", ".ssd")


def _known(path: Path) -> Path:
    """A callback for what is shown: files by their endings, and folders of systems."""
    if os.path.isdir(path) and path.suffix.lower() not in _FMU + _SYSTEM:
        from shaper_fmu.ssp.names import DESCRIPTION

        if not os.path.isfile(path / DESCRIPTION):
            raise typer.BadParameter(f"{path}: no {DESCRIPTION} in this folder")
        return path
    return input_file(*_FMU, *_SYSTEM)(path)


def info(
    context: typer.Context,
    file: Annotated[
        Path,
        typer.Argument(
            help="An FMU (.fmu), an SSP archive (.ssp), a system's folder, or one of its descriptions (.ssd).", callback=_known
        ),
    ],
    variant: Annotated[
        str | None, typer.Option(help="Variant to show: another .ssd file of the archive. Default: SystemStructure.ssd.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Show all variables, elements, connections and values, not only the first 20 of each.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print all facts as JSON, for scripts.")] = False,
) -> None:
    """Show what an FMU or a system is, and which commands take it; nothing of it is loaded or run.

    Of an FMU: tool, version, kinds (co-simulation, model exchange, scheduled execution) with their capabilities, platforms, inputs,
    outputs and parameters with units and start values, numbers of states and event indicators. FMUs of all kinds of FMI 1.0, 2.0
    and 3.0 are shown, also those that cannot be run here. Of a system: the tree of its elements with their FMUs, parameter sets
    and connections.

    At the end, what each command would say: `yes`, `no` with the reason, or `in a system`, for what an FMU can do only as
    a component of an SSP archive. `yes` means that the command begins; whether the FMU runs well shows when it runs.

    \b
    Examples:
        shaper-fmu info plant.fmu
        shaper-fmu info crane.ssp --variant Hoisting
        shaper-fmu info plant.fmu --json | jq '.inputs[].name'

    Exit codes: 0 the file is shown, also if no command takes it; 1 it cannot be read; 2 wrong usage.
    """
    from shaper_fmu.cli.info_commands import fmu_commands, system_commands
    from shaper_fmu.cli.info_pages import show_fmu, show_system
    from shaper_fmu.info import fmu_info, ssp_info

    is_fmu = file.suffix.lower() in _FMU and not file.is_dir()
    if variant is not None and (is_fmu or file.suffix.lower() == ".ssd"):
        raise typer.BadParameter("only an archive or a folder has variants", param_hint="--variant")
    if is_fmu:
        fmu = fmu_info(file)
        commands = fmu_commands(context, file, fmu)
        _write_json(fmu, commands) if as_json else show_fmu(fmu, commands, everything)
    else:
        system = ssp_info(file, variant)
        commands = system_commands(context, file, variant, system)
        _write_json(system, commands) if as_json else show_system(system, commands, everything)


def _write_json(found: Any, commands: Any) -> None:
    import msgspec

    content = {**msgspec.to_builtins(found), "commands": msgspec.to_builtins(commands)}
    out.file.write(json.dumps(content, indent=2, allow_nan=False) + "\n")  # megabytes of it, which rich would measure
