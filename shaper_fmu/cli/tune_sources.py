"""What the command `tune` does with a plant and with a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from shaper_fmu.cli.arguments import wrong_usage
from shaper_fmu.cli.ends import end_message
from shaper_fmu.console import err
from shaper_fmu.progress import parts_progress

if TYPE_CHECKING:
    from shaper_fmu.master.fmu import Fmu
    from shaper_fmu.master.system import System
    from shaper_fmu.tune.plant import Plant
    from shaper_fmu.tune.tuning import Tuning

TABLES = (".csv", ".parquet", ".tsv", ".txt")


def say(what: str) -> None:
    """Tell the next step of the work, or a note."""
    err.print(what if what.startswith("note: ") else f"{what} ...")


def of_table(
    path: Path, input_: str, outputs: list[str] | None, requirements: Any, of_plants: list[str], **options: Any
) -> dict[str, Tuning]:
    from shaper_fmu.tune.identify.measured_table import read_table
    from shaper_fmu.tune.tuning_measured import tune_axes

    if of_plants:
        raise typer.BadParameter(f"a measured response has no parameter {of_plants[0]!r}", param_hint="--vary, --set or --start")
    table = read_table(path)
    given = options.get("command")
    columns = ("--input", [input_] if input_ else []), ("--command", [given] if given else []), ("--output", outputs or [])
    for option, names in columns:
        with wrong_usage(option):
            for name in names:
                table[name]
    return tune_axes(path, outputs, requirements=requirements, input=input_ or None, **options)


def of_plant(
    path: Path,
    inputs: list[str],
    outputs: list[str] | None,
    requirements: Any,
    spread: dict[str, float],
    start_values: dict[str, str],
    beginning: dict[str, str],
    **options: Any,
) -> Tuning:
    """The tuning of a plant, with what is wrong told by the option."""
    from shaper_fmu.tune.kept_runs import KeptRuns
    from shaper_fmu.tune.tuning_plant import check_budget, tune_plant

    if not inputs:
        raise typer.BadParameter("name the input that gets the commands", param_hint="--input")
    plant = checked_plant(*source_of(path, start_values), inputs[0], outputs, spread, beginning)
    if options["resume"]:
        with wrong_usage("--resume"):
            KeptRuns(options["keep"], plant.facts(spread), resume=True).close()
    with wrong_usage("--steps or --budget"):
        check_budget(plant, spread, options["budget"], requirements.move is not None)
    with told_by_progress([plant]) as hear:
        return tune_plant(plant, requirements=requirements, spread=spread, say=say, hear=hear, **options)


@contextmanager
def told_by_progress(plants: list[Plant]) -> Iterator[Callable[[str, int, int], None]]:
    """Show the progress; exit where an interrupted tuning has no mode."""
    from shaper_fmu.tune.meter import BudgetError

    try:
        with parts_progress(err) as update:
            yield lambda part, steps, expected: update(f"{part}, steps of the plant", steps, expected)
    except BudgetError as error:
        stopped = next((one.meter.stopped for one in plants if one.meter.stopped is not None), None)
        if stopped is None:
            raise
        err.print(f"{error}; no mode was identified; what was measured is kept, and --resume goes on")
        raise typer.Exit(end_message(stopped)[1]) from None


def source_of(path: Path, start_values: dict[str, str]) -> tuple[Fmu | System, dict[str, str]]:
    """The FMU, or the system with its start values set, and the start values that are left to be given."""
    from shaper_fmu.master.alone import alone_system
    from shaper_fmu.master.fmu import load_fmu
    from shaper_fmu.ssp.archive import load_ssp

    if path.suffix.lower() != ".ssp":
        fmu = load_fmu(path)
        alone_system(fmu, {})
        with wrong_usage("--set"):
            alone_system(fmu, start_values)
        return fmu, start_values
    loaded = load_ssp(path)
    for note in loaded.notes:
        err.print(f"note: {note}")
    for name, value in start_values.items():
        with wrong_usage("--set"):
            loaded.set(name, value)
    return loaded.system, {}


def checked_plant(
    source: Fmu | System,
    start_values: dict[str, str],
    input_: str,
    outputs: list[str] | None,
    spread: dict[str, float],
    beginning: dict[str, str],
) -> Plant:
    """The plant, with what is wrong told by the option."""
    from shaper_fmu.tune.plant import Plant

    with wrong_usage("--input or --output"):
        plant = Plant(source, input_, outputs, start_values)
    with wrong_usage("--start"):
        plant = plant.beginning(beginning)
    with wrong_usage("--vary"):
        plant.nominal_values(spread)
    return plant
