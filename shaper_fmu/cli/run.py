"""The command `shaper-fmu run`: a system, or one FMU."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shaper_fmu.cli import excitation, over
from shaper_fmu.cli.arguments import PAGE, input_system, instant, output_file, pairs, positive, time_span, wrong_usage
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.cli.paths import wrote
from shaper_fmu.console import err, show
from shaper_fmu.master.algorithms import Algorithm, Coupling, SolverMethod
from shaper_fmu.master.fmu import Interface
from shaper_fmu.master.time_figures import number_text
from shaper_fmu.page.blocks import Table
from shaper_fmu.progress import progress

if TYPE_CHECKING:
    from shaper_fmu.master.alone import Span
    from shaper_fmu.master.results import Results
    from shaper_fmu.master.system import System


@dataclass(frozen=True)
class _Asked:
    """What is to be set, and the times, as given."""

    settings: dict[str, str]
    inputs: dict[str, str]
    stop_time: float | None
    step: float | None


def run(
    system: Annotated[
        Path,
        typer.Argument(help="SSP archive (.ssp), a system's folder, or one FMU (.fmu).", callback=input_system(".ssp", ".fmu")),
    ],
    variant: Annotated[
        str | None, typer.Option(help="Variant to run: another .ssd file of the archive. Default: SystemStructure.ssd.")
    ] = None,
    parameter_sets: Annotated[
        list[str] | None,
        typer.Option("--parameter-set", help="Parameter set: a file (.ssv), or the name of one in the archive; may be repeated."),
    ] = None,
    inputs: Annotated[list[str] | None, typer.Option("--input", metavar="F=WHAT", help=excitation.HELP)] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Start value, for example plant.mass=2, or of the system's own inputs; of one FMU mass=2; may be repeated.",
        ),
    ] = None,
    stop_time: Annotated[
        float | None, typer.Option("--stop-time", "--until", help="Stop time [s]. Default: the system's.", parser=instant)
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(help="Communication step [s]. Default: the system's; of one FMU its own.", parser=time_span),
    ] = None,
    interface: Annotated[
        Interface | None, typer.Option(help="Of one FMU that offers both. Default: co_simulation.", show_default=False)
    ] = None,
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
    earlier: Annotated[list[str] | None, typer.Option(over.OPTION, metavar="FILE", help=over.HELP)] = None,
    report: Annotated[
        Path | None,
        typer.Option(help="Write a page (.html) with the time responses, and a picture of each.", callback=output_file(*PAGE)),
    ] = None,
    force: Force = False,
) -> None:
    """Run a system, from an SSP archive or its folder, or one FMU, and print the last values of the outputs.

    \b
    Examples:
        shaper-fmu run crane.ssp --set crane.initial_rope_length=8 --report crane.html
        shaper-fmu run plant.fmu --until 10
        shaper-fmu run plant.fmu --input force=step:1@0.5 --until 10 --step 0.01 --output plant.csv
        shaper-fmu run plant.fmu --input force=sine:0.2@1.5Hz --set mass=2 --until 10 --report plant.html
        shaper-fmu run plant.fmu --input force=measured.csv:F --until 10
        shaper-fmu run crane.ssp --parameter-set unshaped --output unshaped.csv
        shaper-fmu run crane.ssp --over unshaped.csv --report both.html
    """
    from shaper_fmu.page.blocks import write_report
    from shaper_fmu.report.run import run_blocks

    asked = _Asked(
        pairs(settings, "--set", "instance.variable=value", empty=True),
        pairs(inputs, "--input", excitation.EXAMPLES),
        stop_time,
        step,
    )
    options = {
        "exact": False if grid else None, "everywhere": everywhere, "solver": solver, "coupling": coupling,
        "solver_tolerance": solver_tolerance,
    }  # fmt: skip
    check_kept(output, force, "--output")
    check_kept(report, force, "--report")
    tell_missing(pages=report is not None)
    tables = over.read_earlier(earlier or [])
    if system.suffix.lower() == ".fmu" and not system.is_dir():
        for option, value in (("--variant", variant), ("--parameter-set", parameter_sets), ("--algorithm", algorithm)):
            if value:
                raise typer.BadParameter("this is for systems, not for one FMU", param_hint=option)
        name, results, wired = _run_fmu(system, asked, interface, options)
    else:
        if interface is not None:
            raise typer.BadParameter("this is for one FMU; a system tells its components' interfaces", param_hint="--interface")
        name, results, wired = _run_system(system, variant, parameter_sets or [], asked, algorithm, options)
    runs = over.laid_over(results, tables)
    show(_last_values(results, runs))
    if output:
        write = results.to_parquet if output.suffix.lower() == ".parquet" else results.to_csv
        write(output)
        wrote(output)
    if report:
        for path in write_report(report, f"Run of {name}", run_blocks(runs if tables else results, wired)):
            wrote(path)


def _last_values(results: Results, runs: Mapping[str, Results]) -> Table:
    """The last value of each variable, in this run and in those that it is laid over."""
    rows = []
    for name in results.values:
        ends = [number_text(float(run.display(name)[0][-1])) if name in run.values else "" for run in runs.values()]
        rows.append([name, *ends, results.display(name)[1]])
    others = [f"in {name}" for name in list(runs)[1:]]
    return Table("", ["variable", "at the end", *others, "unit"], rows, left_aligned=True)


def _run_fmu(path: Path, asked: _Asked, interface: Interface | None, options: dict[str, Any]) -> tuple[str, Results, System]:
    """The name, the results and the system of one FMU; its variables have their own names."""
    from shaper_fmu.master.alone import alone_system, instance_name, plain_results, recorded, span_of
    from shaper_fmu.master.fmu import load_fmu
    from shaper_fmu.master.run_options import number_of_steps

    with wrong_usage("--interface") if interface else nullcontext():
        fmu = load_fmu(path).with_interface(interface)
    name = instance_name(fmu)
    with wrong_usage("--set") if asked.settings else nullcontext():
        system = alone_system(fmu, asked.settings, name)
    with wrong_usage("--until"):
        span = span_of(fmu, None, asked.stop_time, asked.step)
    with wrong_usage("--until or --step"):
        number_of_steps(system, span.start, span.stop, span.step)
    excitation.drive_inputs(system, asked.inputs, f"{name}.", span.stop, span.step)
    if span.note:
        err.print(f"note: {span.note}")

    def simulate(update: Any) -> Results:
        return system.simulate(
            span.stop, span.step, start_time=span.start, record=recorded(system), progress=lambda t: update(t, span.stop), **options
        )

    return path.stem, plain_results(_timed(path.stem, span, simulate), name), system


def _run_system(
    path: Path,
    variant: str | None,
    parameter_sets: list[str],
    asked: _Asked,
    algorithm: Algorithm | None,
    options: dict[str, Any],
) -> tuple[str, Results, System]:
    """The name, the results and the system of an archive or a folder."""
    from shaper_fmu.master.alone import Span
    from shaper_fmu.master.run_options import number_of_steps
    from shaper_fmu.ssp.archive import load_ssp
    from shaper_fmu.ssp.parameter_sets import apply_parameter_set

    loaded = load_ssp(path, variant)
    for note in loaded.notes:
        err.print(f"note: {note}")
    for which in parameter_sets:
        apply_parameter_set(loaded, which)
    for name, value in asked.settings.items():
        with wrong_usage("--set"):
            loaded.set(name, value)
    if algorithm is None and loaded.structure.settings:
        setting = loaded.structure.settings[0]
        algorithm = setting.algorithm
        if algorithm != "jacobi":
            err.print(f"note: algorithm {algorithm}, as the annotation of {setting.tool} says")
    stop_time = asked.stop_time if asked.stop_time is not None else loaded.structure.stop_time
    step = asked.step if asked.step is not None else loaded.structure.step_size
    if stop_time is None or step is None:
        raise typer.BadParameter("the system declares no stop time or step size; give --stop-time and --step")
    span = Span(loaded.structure.start_time or 0.0, stop_time, step, "")
    given = asked.stop_time is not None or asked.step is not None
    with wrong_usage("--stop-time or --step") if given else nullcontext():
        number_of_steps(loaded.system, span.start, stop_time, step)
    excitation.drive_inputs(loaded.system, asked.inputs, "", stop_time, step)

    def simulate(update: Any) -> Results:
        return loaded.simulate(
            stop_time,
            step,
            start_time=span.start,
            algorithm=algorithm or "jacobi",
            progress=lambda t: update(t, stop_time),
            **options,
        )

    return loaded.system.name, _timed(loaded.system.name, span, simulate), loaded.system


def _timed(name: str, span: Span, simulate: Any) -> Results:
    """Run with progress; print the notes and how long it took."""
    begin = time.perf_counter()
    with progress(f"running {name}, simulated time [s]", err) as update:
        results: Results = simulate(update)
    taken = time.perf_counter() - begin
    for note in results.notes:
        err.print(f"note: {note}")
    stepping, simulated = max(results.stepping_time, 1e-9), span.stop - span.start
    err.print(f"{simulated:g} s simulated in {stepping:.3g} s, {simulated / stepping:.3g} times real time", end="")
    err.print(f" (loading and initializing took {taken - results.stepping_time:.3g} s besides)")
    return results
