"""The command line. Exit codes: 0 done, 1 the work found problems (named), 2 wrong usage."""

from __future__ import annotations

import sys
from typing import Annotated

import typer
from typer import Typer

from shaper_fmu.cli.arguments import wrong_usage
from shaper_fmu.cli.build import build
from shaper_fmu.cli.check import check
from shaper_fmu.cli.design import design
from shaper_fmu.cli.ends import Commands, sigterm_heard
from shaper_fmu.cli.info import info
from shaper_fmu.cli.live import live
from shaper_fmu.cli.new import app as new
from shaper_fmu.cli.pack import pack
from shaper_fmu.cli.paths import begin as paths_begin
from shaper_fmu.cli.reproduce import reproduce
from shaper_fmu.cli.run import run
from shaper_fmu.cli.sweep import export_store, report_store, sweep
from shaper_fmu.cli.tune import tune
from shaper_fmu.cli.wrap import wrap
from shaper_fmu.console import err, out, show
from shaper_fmu.errors import ModelError, ShaperFmuError, UsageError
from shaper_fmu.page.blocks import Table
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
app.command("run")(run)
app.command("live")(live)
app.command("reproduce")(reproduce)
app.command("tune")(tune)
app.command("pack")(pack)
app.command("wrap")(wrap)
app.command("sweep")(sweep)
app.command("report")(report_store)
app.command("export")(export_store)
app.add_typer(new, name="new")


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
