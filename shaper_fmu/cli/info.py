"""The command `shaper-fmu info`: what a file is, at a glance, and which commands take it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from shaper_fmu.cli.arguments import STORE, input_system, output_drawing
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.paths import wrote
from shaper_fmu.console import out, show

_FMU, _SYSTEM = (".fmu",), (".ssp", ".ssd")


def _known(path: Path) -> Path:
    """A callback for what is shown: files by their endings, and folders of systems."""
    return input_system(*_FMU, *_SYSTEM, *STORE)(path)


def info(
    context: typer.Context,
    file: Annotated[
        Path,
        typer.Argument(
            help="An FMU (.fmu), an SSP archive (.ssp), a system's folder, one of its descriptions (.ssd), or a store (.sqlite).",
            callback=_known,
        ),
    ],
    variant: Annotated[
        str | None, typer.Option(help="Variant to show: another .ssd file of the archive. Default: SystemStructure.ssd.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Show all variables, elements, connections and values, not only the first 20 of each.")
    ] = False,
    drawing: Annotated[
        Path | None,
        typer.Option(help="Write a drawing: boxes, connectors with units, connections (.svg).", callback=output_drawing),
    ] = None,
    force: Force = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print all facts as JSON, for scripts.")] = False,
) -> None:
    """Show what an FMU or a system is, and which commands take it; nothing of it is loaded or run.

    Of an FMU: tool, version, kinds (co-simulation, model exchange, scheduled execution) with their capabilities, platforms, inputs,
    outputs and parameters with units and start values, numbers of states and event indicators. FMUs of all kinds of FMI 1.0, 2.0
    and 3.0 are shown, also those that cannot be run here. Of a system: the tree of its elements with their FMUs, parameter sets
    and connections. Of a store: the study, what is done of each case, and the ranges of the metrics.

    At the end, what each command would say: `yes`, `no` with the reason, or `in a system`, for what an FMU can do only as
    a component of an SSP archive. `yes` means that the command begins; whether the FMU runs well shows when it runs.

    \b
    Examples:
        shaper-fmu info plant.fmu
        shaper-fmu info crane.ssp --variant Hoisting
        shaper-fmu info crane.ssp --drawing crane.svg
        shaper-fmu info results/rope.sqlite
        shaper-fmu info plant.fmu --json | jq '.inputs[].name'

    Exit codes: 0 the file is shown, also if no command takes it; 1 it cannot be read; 2 wrong usage.
    """
    from shaper_fmu.cli.info_commands import fmu_commands, system_commands
    from shaper_fmu.cli.info_pages import show_fmu, show_system
    from shaper_fmu.drawing import write_drawing
    from shaper_fmu.info import fmu_info, ssp_info
    from shaper_fmu.info.diagram import fmu_diagram, system_diagram

    check_kept(drawing, force, "--drawing")
    if file.suffix.lower() in STORE and not file.is_dir():
        for option, given in (("--variant", variant), ("--drawing", drawing)):
            if given is not None:
                raise typer.BadParameter("a store has none", param_hint=option)
        _show_store(file, as_json)
        return
    is_fmu = file.suffix.lower() in _FMU and not file.is_dir()
    if variant is not None and (is_fmu or file.suffix.lower() == ".ssd"):
        raise typer.BadParameter("only an archive or a folder has variants", param_hint="--variant")
    if is_fmu:
        fmu = fmu_info(file)
        commands = fmu_commands(context, file, fmu)
        diagram = fmu_diagram(fmu)
        _write_json(fmu, commands) if as_json else show_fmu(fmu, commands, everything)
    else:
        system = ssp_info(file, variant)
        commands = system_commands(context, file, variant, system)
        diagram = system_diagram(system)
        _write_json(system, commands) if as_json else show_system(system, commands, everything)
    if drawing is not None:
        written = write_drawing(drawing, diagram)
        if not as_json:
            wrote(written)


def _write_json(found: Any, commands: Any) -> None:
    import msgspec

    content = {**msgspec.to_builtins(found), "commands": msgspec.to_builtins(commands)}
    out.file.write(json.dumps(content, indent=2, allow_nan=False) + "\n")  # megabytes of it, which rich would measure


def _show_store(file: Path, as_json: bool) -> None:
    from shaper_fmu.cli.info_words import plain
    from shaper_fmu.sweep.shown import cases_table, counts_text, study_facts, varied_table
    from shaper_fmu.sweep.store import Store

    with Store(file) as store:
        study, counts = store.study(), store.counts()
        if as_json:
            facts = {"file": file.name, "study": json.loads(study.as_json()), "folder": study.folder, "runs": counts}
            content = {**facts, "remarks": store.remarks(), "provenance": store.provenance()}
            out.file.write(json.dumps(content, indent=2) + "\n")
            return
        out.print(f"{plain(study.name)}: {counts_text(counts)}")
        for name, text in [*study_facts(study).items(), *(("note", text) for text in store.remarks().values())]:
            if text:
                out.print(f"{name:14}{plain(text)}")
        show(varied_table(study))
        show(cases_table(store))
