"""The command line. Exit codes: 0 done, 1 the work found problems (named), 2 wrong usage."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from shaper_fmu import __version__
from shaper_fmu.cli_build import build
from shaper_fmu.cli_design import design
from shaper_fmu.console import err, out, show
from shaper_fmu.errors import ModelError, ShaperFmuError
from shaper_fmu.master.algorithms import Algorithm
from shaper_fmu.progress import progress

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Command shaping for flexible machines: build FMUs, run and sweep systems of FMUs, report.",
    epilog="Exit codes: 0 done, 1 the work found problems, 2 wrong usage.",
)


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    if version:
        out.print(__version__)
        raise typer.Exit


@app.command("list")
def list_components(
    names: Annotated[list[str] | None, typer.Argument(help="Components to show with their variables.")] = None,
) -> None:
    """List the components; with names, their variables."""
    from shaper_fmu.export.documentation import domain_text, start_text, type_text
    from shaper_fmu.export.model_description import summary, visible_variables
    from shaper_fmu.registry import components, find_component

    if not names:
        table = Table("component", "what it is")
        for name, component in components().items():
            table.add_row(name, summary(component))
        out.print(table)
    for name in names or []:
        component = find_component(name)
        table = Table(
            "variable", "causality", "type", "unit", "start", "domain", "description", title=f"{name}: {summary(component)}"
        )
        for v in visible_variables(component):
            start = start_text(v) if v.causality in ("input", "parameter") else ""
            table.add_row(v.name, v.causality, type_text(v), v.unit, start, domain_text(v), v.description)
        out.print(table)


app.command("build")(build)
app.command("design")(design)


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="FMUs (.fmu) and SSP archives (.ssp).")]) -> None:
    """Check FMUs and SSP archives; print every problem, one a line."""
    found = False
    for file in files:
        for problem in _problems(file):
            found = True
            out.print(f"{file}: {problem}")
    if found:
        raise typer.Exit(1)


def _problems(file: Path) -> list[str]:
    from shaper_fmu.master.fmu import fmu_problems
    from shaper_fmu.ssp.archive import load_ssp

    try:
        if file.suffix == ".ssp":
            return load_ssp(file).system.check()
        return fmu_problems(file)
    except ModelError as error:
        return error.problems
    except ShaperFmuError as error:
        return [str(error)]


@app.command()
def run(
    system: Annotated[Path, typer.Argument(help="SSP archive (.ssp).")],
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Start value, for example plant.mass=2; may be repeated.")
    ] = None,
    stop_time: Annotated[float | None, typer.Option(help="Stop time [s]. Default: the system's.")] = None,
    step: Annotated[float | None, typer.Option(help="Communication step [s]. Default: the system's.")] = None,
    algorithm: Annotated[Algorithm, typer.Option(help="Master algorithm.")] = "jacobi",
    grid: Annotated[
        bool, typer.Option("--grid", help="Keep to the communication step, instead of ending steps at events.")
    ] = False,
    everywhere: Annotated[bool, typer.Option("--events", help="Results at events, too, on both sides of jumps.")] = False,
    output: Annotated[Path | None, typer.Option(help="Write all outputs to this CSV file.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a page with the time responses, and a picture of each.")] = None,
) -> None:
    """Run the system of an SSP archive and print the outputs' last values."""
    from shaper_fmu.report.page import write_report
    from shaper_fmu.report.run_report import run_blocks
    from shaper_fmu.ssp.archive import load_ssp

    loaded = load_ssp(system)
    for setting in settings or []:
        name, equals, value = setting.partition("=")
        if not equals:
            raise typer.BadParameter(f"{setting!r} is not of the form instance.variable=value", param_hint="--set")
        loaded.system.set(name, value)
    stop_time = stop_time if stop_time is not None else loaded.structure.stop_time
    step = step if step is not None else loaded.structure.step_size
    if stop_time is None or step is None:
        raise typer.BadParameter("the system tells no stop time or step size; give --stop-time and --step")
    start_time, begin = loaded.structure.start_time or 0.0, time.perf_counter()
    with progress(f"running {loaded.system.name}, simulated time [s]", err) as update:
        results = loaded.system.simulate(
            stop_time,
            step,
            start_time=start_time,
            algorithm=algorithm,
            exact=False if grid else None,
            everywhere=everywhere,
            progress=lambda t: update(t, stop_time),
        )
    taken = time.perf_counter() - begin
    for note in results.notes:
        err.print(f"note: {note}", markup=False)
    err.print(f"{stop_time - start_time:g} s simulated in {taken:.3g} s, {(stop_time - start_time) / taken:.3g} times real time")
    table = Table("variable", "at the end", "unit")
    for name in results.values:
        column, unit = results.display(name)
        table.add_row(name, f"{column[-1]:.6g}", unit)
    out.print(table)
    if output:
        results.to_csv(output)
        out.print(f"wrote {output}")
    if report:
        for path in write_report(report, f"Run of {loaded.system.name}", run_blocks(results)):
            out.print(f"wrote {path}")


@app.command()
def sweep(
    study: Annotated[Path, typer.Argument(help="Study file (.toml).")],
    store: Annotated[Path | None, typer.Option(help="Store of the results. Default: results/<study's folder>.sqlite.")] = None,
) -> None:
    """Run what a study plans and its store does not hold yet; print the robustness table."""
    from shaper_fmu.sweep.engine import run_study
    from shaper_fmu.sweep.study import read_study

    planned = read_study(study)
    target = store or Path("results") / f"{study.resolve().parent.name}.sqlite"
    target.parent.mkdir(parents=True, exist_ok=True)
    with progress(f"sweeping {planned.name}", err) as update:
        runs = run_study(planned, target, update)
    _print_tables(target)
    failed = [run for run in runs if run.status == "failed"]
    out.print(f"{len(runs) - len(failed)} of {len(runs)} runs done, in {target}")
    for run in failed[:10]:
        err.print(f"run {run.id} ({run.compared}, {run.varied}) failed: {run.reason}")
    if failed:
        raise typer.Exit(1)


def _print_tables(store: Path) -> None:
    from shaper_fmu.report.sweep_report import robustness_table
    from shaper_fmu.sweep.engine import load_stored_system
    from shaper_fmu.sweep.store import Store

    with Store(store) as opened:
        study, runs = opened.study(), opened.runs()
        system = load_stored_system(opened).system
    for varied in study.vary:
        for metric in study.metrics:
            show(robustness_table(study, runs, system, metric, varied))


@app.command("report")
def report_store(
    store: Annotated[Path, typer.Argument(help="Store of a sweep (.sqlite).")],
    output: Annotated[Path, typer.Option(help="Page to write; pictures are put beside it.")] = Path("report.html"),
) -> None:
    """Write the report of a sweep: one self-contained page, and a picture of each figure."""
    from shaper_fmu.report.page import write_report
    from shaper_fmu.report.sweep_report import sweep_blocks
    from shaper_fmu.sweep.engine import load_stored_system
    from shaper_fmu.sweep.store import Store

    with Store(store) as opened:
        study, runs, provenance = opened.study(), opened.runs(), opened.provenance()
        system = load_stored_system(opened).system
    blocks = sweep_blocks(study, runs, system, provenance)
    for path in write_report(output, study.name, blocks):
        out.print(f"wrote {path}")


def main() -> None:
    """The command `shaper-fmu`."""
    try:
        app()
    except ModelError as error:
        for problem in error.problems:
            err.print(f"error: {problem}", markup=False)
        sys.exit(1)
    except ShaperFmuError as error:
        err.print(f"error: {error}", markup=False)
        sys.exit(1)
    except OSError as error:
        err.print(f"error: {error.filename or 'output'}: {error.strerror or error}")
        sys.exit(1)
    except KeyboardInterrupt:
        err.print("interrupted; what was finished is kept")
        sys.exit(130)
