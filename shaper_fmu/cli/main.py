"""The command line. Exit codes: 0 done, 1 the work found problems (named), 2 wrong usage."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer
from typer import Typer

from shaper_fmu.cli.arguments import PAGE, finite, input_system, output_file, pairs, positive, wrong_usage
from shaper_fmu.cli.build import build
from shaper_fmu.cli.check import check
from shaper_fmu.cli.design import design
from shaper_fmu.cli.ends import Commands, sigterm_heard
from shaper_fmu.cli.info import info
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.live import live
from shaper_fmu.cli.new import app as new
from shaper_fmu.cli.pack import pack
from shaper_fmu.cli.paths import begin as paths_begin
from shaper_fmu.cli.paths import wrote
from shaper_fmu.cli.reproduce import reproduce
from shaper_fmu.cli.sweep import export_store, report_store, sweep
from shaper_fmu.cli.tune import tune
from shaper_fmu.cli.wrap import wrap
from shaper_fmu.console import err, out, show
from shaper_fmu.errors import ModelError, ShaperFmuError, UsageError
from shaper_fmu.master.algorithms import Algorithm, Coupling, SolverMethod
from shaper_fmu.page.blocks import Table
from shaper_fmu.progress import progress
from shaper_fmu.version import __version__

app: Typer = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Command shaping for flexible machines: build FMUs, run and sweep systems of FMUs, report.",
    epilog="Exit codes: 0 done, 1 the work found problems, 2 wrong usage.",
)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    paths_begin()
    if version:
        out.print(__version__)
        raise typer.Exit


@app.command("list")
def list_components(
    names: Annotated[list[str] | None, typer.Argument(help="Components to show with their variables.")] = None,
) -> None:
    """List the components; with names, their variables."""
    from shaper_fmu.export.documentation import start_text, type_text
    from shaper_fmu.export.model_description import summary, visible_variables
    from shaper_fmu.registry import components, find_component

    if not names:
        rows = [[name, summary(component)] for name, component in components().items()]
        show(Table("", ["component", "what it is"], rows, left_aligned=True))
    with wrong_usage("NAMES"):
        found = {name: find_component(name) for name in names or []}
    for name, component in found.items():
        rows = []
        for v in visible_variables(component):
            start = start_text(v) if v.causality in ("input", "parameter") else ""
            rows.append([v.name, v.causality, type_text(v), v.unit, start, v.domain, v.description])
        head = ["variable", "causality", "type", "unit", "start", "domain", "description"]
        show(Table(f"{name}: {summary(component)}", head, rows, left_aligned=True))


app.command("build")(build)
app.command("check")(check)
app.command("info")(info)
app.command("design")(design)
app.command("live")(live)
app.command("reproduce")(reproduce)
app.command("tune")(tune)
app.command("pack")(pack)
app.command("wrap")(wrap)
app.command("sweep")(sweep)
app.command("report")(report_store)
app.command("export")(export_store)
app.add_typer(new, name="new")


@app.command()
def run(
    system: Annotated[Path, typer.Argument(help="SSP archive (.ssp), or a system's folder.", callback=input_system(".ssp"))],
    variant: Annotated[
        str | None, typer.Option(help="Variant to run: another .ssd file of the archive. Default: SystemStructure.ssd.")
    ] = None,
    parameter_sets: Annotated[
        list[str] | None,
        typer.Option("--parameter-set", help="Parameter set: a file (.ssv), or the name of one in the archive; may be repeated."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="Start value, for example plant.mass=2, or of the system's own inputs; may be repeated."),
    ] = None,
    stop_time: Annotated[float | None, typer.Option(help="Stop time [s]. Default: the system's.", parser=finite)] = None,
    step: Annotated[float | None, typer.Option(help="Communication step [s]. Default: the system's.", parser=positive)] = None,
    algorithm: Annotated[Algorithm | None, typer.Option(help="Master algorithm. Default: the system's, or jacobi.")] = None,
    solver: Annotated[
        SolverMethod,
        typer.Option(help="Formulas that solve FMUs of model exchange: bdf for stiff ones, adams for others, or auto."),
    ] = "auto",
    coupling: Annotated[
        Coupling,
        typer.Option(help="How FMUs of model exchange act on each other: as one system of equations, or at communication steps."),
    ] = "monolithic",
    solver_tolerance: Annotated[
        float | None,
        typer.Option(help="Relative tolerance of solvers, the master's and those in FMUs. Default: the FMUs'.", parser=positive),
    ] = None,
    grid: Annotated[bool, typer.Option("--grid", help="End steps only at communication points, not at events.")] = False,
    everywhere: Annotated[bool, typer.Option("--events", help="Record results at events, too, on both sides of jumps.")] = False,
    output: Annotated[
        Path | None,
        typer.Option(help="Write all outputs to this table: .csv or .parquet.", callback=output_file(".csv", ".parquet")),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Write a page (.html) with the time responses, and a picture of each.", callback=output_file(*PAGE)),
    ] = None,
    force: Force = False,
) -> None:
    """Run the system of an SSP archive, or of a folder of one, and print the outputs' last values."""
    from shaper_fmu.master.run_options import number_of_steps
    from shaper_fmu.page.blocks import write_report
    from shaper_fmu.report.run import run_blocks
    from shaper_fmu.ssp.archive import load_ssp
    from shaper_fmu.ssp.parameter_sets import apply_parameter_set

    loaded = load_ssp(system, variant)
    title = f"Run of {loaded.system.name}"
    if report:
        check_kept(report, title, force, "--report")
    for note in loaded.notes:
        err.print(f"note: {note}")
    for which in parameter_sets or []:
        apply_parameter_set(loaded, which)
    for name, value in pairs(settings, "--set", "instance.variable=value", empty=True).items():
        with wrong_usage("--set"):
            loaded.set(name, value)
    if algorithm is None and loaded.structure.settings:
        setting = loaded.structure.settings[0]
        algorithm = setting.algorithm
        if algorithm != "jacobi":
            err.print(f"note: algorithm {algorithm}, as the annotation of {setting.tool} says")
    given = stop_time is not None or step is not None
    stop_time = stop_time if stop_time is not None else loaded.structure.stop_time
    step = step if step is not None else loaded.structure.step_size
    if stop_time is None or step is None:
        raise typer.BadParameter("the system declares no stop time or step size; give --stop-time and --step")
    start_time = loaded.structure.start_time or 0.0
    with wrong_usage("--stop-time or --step") if given else nullcontext():
        number_of_steps(loaded.system, start_time, stop_time, step)
    begin = time.perf_counter()
    with progress(f"running {loaded.system.name}, simulated time [s]", err) as update:
        results = loaded.simulate(
            stop_time,
            step,
            start_time=start_time,
            algorithm=algorithm or "jacobi",
            exact=False if grid else None,
            everywhere=everywhere,
            solver=solver,
            coupling=coupling,
            solver_tolerance=solver_tolerance,
            progress=lambda t: update(t, stop_time),
        )
    taken = time.perf_counter() - begin
    for note in results.notes:
        err.print(f"note: {note}")
    stepping, simulated = max(results.stepping_time, 1e-9), stop_time - start_time
    err.print(f"{simulated:g} s simulated in {stepping:.3g} s, {simulated / stepping:.3g} times real time", end="")
    err.print(f" (loading and initializing took {taken - results.stepping_time:.3g} s besides)")
    last = [(name, *results.display(name)) for name in results.values]
    rows = [[name, f"{column[-1]:.6g}", unit] for name, column, unit in last]
    show(Table("", ["variable", "at the end", "unit"], rows, left_aligned=True))
    if output:
        write = results.to_parquet if output.suffix.lower() == ".parquet" else results.to_csv
        write(output)
        wrote(output)
    if report:
        for path in write_report(report, title, run_blocks(results)):
            wrote(path)


def main() -> None:
    """The command `shaper-fmu`."""
    try:
        with sigterm_heard():
            app()
    except ShaperFmuError as error:
        for problem in error.problems if isinstance(error, ModelError) else [error]:
            err.print(f"error: {problem}")
        sys.exit(2 if isinstance(error, UsageError) else 1)
    except OSError as error:
        err.print(f"error: {error.filename or 'output'}: {error.strerror or error}")
        sys.exit(1)
