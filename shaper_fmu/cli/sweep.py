"""The commands `shaper-fmu sweep`, `report` and `export`: run studies, and read their stores."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shaper_fmu.cli.arguments import PAGE, STORE, index, input_file, output_file, wrong_usage
from shaper_fmu.cli.ends import end_message
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.cli.paths import shown, wrote
from shaper_fmu.console import err, out, show
from shaper_fmu.progress import progress, runs_progress

if TYPE_CHECKING:
    from shaper_fmu.report.sweep.data import SweepData
    from shaper_fmu.sweep.engines import Engine
    from shaper_fmu.sweep.study import Study

_STORE = "Store of a sweep (.sqlite)."
_MOST_REASONS = 10


def _study_file(path: Path) -> Path:
    """A callback for studies: a file, or the one of a folder."""
    if os.path.isdir(path) and not os.path.isfile(path / "study.toml"):
        raise typer.BadParameter(f"{path}: not a file but a folder: no study.toml in this folder")
    if path.suffix.lower() == ".ssp" and os.path.isfile(path):
        raise typer.BadParameter(f"{path}: a system, not a study of it; shaper-fmu new study {path} writes one to begin with")
    return input_file(".toml")(path / "study.toml" if os.path.isdir(path) else path)


def sweep(
    study: Annotated[Path, typer.Argument(help="Study file (.toml), or a folder with a study.toml.", callback=_study_file)],
    store: Annotated[
        Path | None,
        typer.Option(help="Store of the results. Default: results/<study's folder>.sqlite.", callback=output_file(*STORE)),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Worker processes; 0 runs everything in this process. Default: one per processor.", parser=index),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler, such as tcp://host:8786, or `local` for a new cluster here."),
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Repeat failed runs.")] = False,
) -> None:
    """Do the runs of a study that its store lacks; print the robustness tables.

    Ctrl-C or a crash costs nothing that was finished: the same command continues with the rest. A run that fails is kept
    with its reason, and the others go on.

    Example, a study of how a shaped move leaves a crane swinging when its rope is longer or shorter than thought:

    \b
        name = "rope"
        system = "crane.ssp"             # made by: shaper-fmu build FOLDER
        stop_time = 25.0
        step = 0.01
        [vary."crane.initial_rope_length"]
        low = 6.0
        high = 10.0
        points = 21
        [compare]
        ZV = { "shaper.shaper" = "zv" }
        ZVD = { "shaper.shaper" = "zvd" }
        [metrics.residual_swing]
        kind = "residual"
        output = "crane.swing_angle"
        command = "shaper.shaped_mean"

    \b
        shaper-fmu sweep study.toml --store rope.sqlite --workers 4
        shaper-fmu report rope.sqlite --output rope.html
        shaper-fmu export rope.sqlite --output rope.csv

    Exit codes: 0 all runs are done, 1 some failed, 2 wrong usage, 130 interrupted, 143 ended by SIGTERM.
    """
    from shaper_fmu.master.loop_library import loop
    from shaper_fmu.sweep.engine import engine_for
    from shaper_fmu.sweep.study import read_study

    if workers is not None and dask not in (None, "local"):
        raise typer.BadParameter("a cluster has its own workers; give one of --workers and --dask", param_hint="--workers")
    planned = read_study(study)
    target = output_file()(store or Path("results") / f"{study.resolve().parent.name}.sqlite")
    with wrong_usage("--dask" if dask else "--workers"):
        engine = engine_for(workers, dask)
    if dask in (None, "local"):
        loop()  # where it is missing, no store is begun
    target.parent.mkdir(parents=True, exist_ok=True)
    _build_missing(planned.system_path)
    counts = _run(planned, target, engine, retry_failed)
    failed, total = counts.get("failed", 0), sum(counts.values())
    _print_results(target)
    out.print(f"{counts.get('done', 0)} of {total} runs done, in {shown(target)}")
    if failed:
        raise typer.Exit(1)


def _build_missing(system: Path) -> None:
    """Build the archive of a study whose system is there as a folder only, as `shaper-fmu build` does, for this machine."""
    from shaper_fmu.ssp.archive import pack_ssp
    from shaper_fmu.ssp.names import DESCRIPTION

    folder = system.with_suffix("")
    if system.suffix == ".ssp" and not system.exists() and (folder / DESCRIPTION).is_file():
        wrote(pack_ssp(folder, "fmus", system.resolve(), ["this"], build=True), " for this machine, from its folder", "built")


def _run(planned: Study, target: Path, engine: Engine, retry_failed: bool) -> dict[str, int]:
    """Run the study; if a signal ends it, print what is kept, and exit with the signal's exit code."""
    from shaper_fmu.sweep.engine import run_study

    counts = [0, 0, 0]
    try:
        with runs_progress(f"sweeping {planned.name}", err) as update:

            def show(done: int, failed: int, total: int) -> None:
                counts[:] = done, failed, total
                update(done, failed, total)

            return run_study(planned, target, show, engine=engine, retry_failed=retry_failed)
    except KeyboardInterrupt as error:
        message, code = end_message(error)
        done, failed, total = counts
        if not total:
            err.print(f"{message} before the first run")
        else:
            err.print(
                f"{message}: {done + failed} of {total} runs are finished ({failed} failed) and kept in {shown(target)}; "
                "the same command continues with the rest"
            )
        raise typer.Exit(code) from None


def _print_results(target: Path) -> None:
    from shaper_fmu.report.sweep.report import read_store, summary_tables

    data = read_store(target)
    for table in summary_tables(data):
        show(table)
    for message in data.remarks.values():
        err.print(f"note: {message}")
    for line in _failure_lines(data):
        err.print(line)


def _failure_lines(data: SweepData) -> list[str]:
    """Why runs failed, a line for each kind of reason (the same but for numbers), the most frequent first."""
    kinds, lines = data.failures.kinds.most_common(_MOST_REASONS), []
    for kind, count in kinds:
        run = data.failures.first[kind]
        values = ", ".join(
            f"{name} = {value:g}" if isinstance(value, float) else f"{name} = {value}" for name, value in run.varied.items()
        )
        which = f"run {run.id}" if count == 1 else f"{count} runs failed, the first of them run {run.id}"
        lines.append(f"{which} ({run.compared}; {values}){' failed' if count == 1 else ''}: {run.reason}")
    rest = data.failures.total - sum(count for _, count in kinds)
    if rest:
        lines.append(f"{rest} more runs failed for other reasons; 'shaper-fmu export' writes all")
    return lines


def report_store(
    store: Annotated[Path, typer.Argument(help=_STORE, callback=input_file())],
    output: Annotated[
        Path, typer.Option(help="Page to write (.html); the pictures are written beside it.", callback=output_file(*PAGE))
    ] = Path("report.html"),
    force: Force = False,
) -> None:
    """Write the report of a sweep: one self-contained page, and a picture of each figure.

    \b
    Example:
        shaper-fmu report rope.sqlite --output rope.html
    """
    from shaper_fmu.report.sweep.report import write_sweep_report

    check_kept(output, force, "--output")
    tell_missing(pages=True)
    with progress("writing the report", err) as update:
        written = write_sweep_report(store, output, update)
    for path in written:
        wrote(path)


def export_store(
    store: Annotated[Path, typer.Argument(help=_STORE, callback=input_file())],
    output: Annotated[
        Path,
        typer.Option(
            help="Table to write: .csv, or .parquet (needs the package pyarrow); with --run a parameter set (.ssv).",
            callback=output_file(".csv", ".parquet", ".ssv"),
        ),
    ],
    run: Annotated[
        int | None, typer.Option(help="Number of one run, whose start values are written as a parameter set.", parser=index)
    ] = None,
    force: Force = False,
) -> None:
    """Write the runs of a sweep as a table, one row a run: case, start values, metrics, status, reason, seconds, attempts.

    Numbers have all their digits. A sweep that is under way can be exported, too. With --run, one point of the sweep becomes a
    parameter set (.ssv) for its system, which `shaper-fmu run` and other tools take.

    \b
    Examples:
        shaper-fmu export rope.sqlite --output rope.csv
        shaper-fmu export rope.sqlite --output rope.parquet
        shaper-fmu export rope.sqlite --run 17 --output point.ssv
        shaper-fmu run crane.ssp --parameter-set point.ssv
    """
    if (run is None) != (output.suffix.lower() != ".ssv"):
        raise typer.BadParameter("a parameter set (.ssv) is of one run: give --run, too, or a table's name", param_hint="--output")
    check_kept(output, force, "--output")
    if run is not None:
        from shaper_fmu.sweep.points import write_point

        values = write_point(store, run, output)
        wrote(output, f": {', '.join(f'{name} = {value}' for name, value in values.items())}")
        return
    from shaper_fmu.sweep.export import WRITERS
    from shaper_fmu.sweep.store import Store

    write = WRITERS[output.suffix.lower()]
    with Store(store) as opened, progress(f"writing {output.name}", err) as update:
        count = write(opened, output, update)
    wrote(output, f": {count} runs")
