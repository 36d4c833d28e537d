"""The command `shaper-fmu check`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.cli.arguments import input_file
from shaper_fmu.console import out


def check(
    files: Annotated[list[Path], typer.Argument(help="FMUs (.fmu) and SSP archives (.ssp).", callback=input_file())],
    portable: Annotated[
        bool, typer.Option("--portable", help="Also report what other tools ignore, refuse or treat differently in an SSP archive.")
    ] = False,
    pack: Annotated[
        bool, typer.Option("--pack", help="Also report why `pack` could not make one FMU of an archive, or have an FMU inside one.")
    ] = False,
) -> None:
    """Check FMUs and SSP archives; print all findings, one per line, with file and line.

    Archives are checked by the standard's schemas, and for names, types, units, sources, parameters and loops, which the schemas
    do not cover. A finding that begins with "note:" does not prevent a run.
    """
    found = False
    for file in files:
        for problem in file_problems(file, portable, pack):
            found = True
            out.print(f"{file}: {problem}")
    if found:
        raise typer.Exit(1)


def file_problems(file: Path, portable: bool = False, pack: bool = False) -> list[str]:
    """What the command prints of a file."""
    from shaper_fmu.errors import ModelError, ShaperFmuError
    from shaper_fmu.info.trials import fmu_in_a_container, system_pack
    from shaper_fmu.master.fmu import fmu_problems
    from shaper_fmu.ssp.check import ssp_findings
    from shaper_fmu.ssp.portable import portable_problems

    try:
        if file.suffix.lower() != ".ssp":
            findings = fmu_problems(file)
            return findings + (_new(fmu_in_a_container(file), findings) if pack else [])
        findings = [f"{'' if finding.stops else 'note: '}{finding}" for finding in ssp_findings(file)]
        findings += portable_problems(file) if portable else []
        return findings + (_new(system_pack(file, None), findings) if pack else [])
    except ModelError as error:
        return error.problems
    except ShaperFmuError as error:
        return [str(error)]


def _new(problems: list[str], findings: list[str]) -> list[str]:
    """Problems of packing that the findings do not tell already."""
    return [f"pack: {problem}" for problem in problems if not any(problem in finding for finding in findings)]
