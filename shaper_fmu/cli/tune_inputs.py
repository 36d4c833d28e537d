"""What the command `tune` does with several inputs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from shaper_fmu.cli.arguments import wrong_usage
from shaper_fmu.cli.ends import end_message
from shaper_fmu.cli.paths import shown, wrote
from shaper_fmu.cli.tune_results import print_result, print_sentences, write_results
from shaper_fmu.cli.tune_sources import checked_plant, say, source_of, told_by_progress
from shaper_fmu.console import err, out

if TYPE_CHECKING:
    from shaper_fmu.tune.tuning_inputs import InputsTuning


def check_several(names: list[str], *, is_table: bool, moves: bool, machines: bool) -> None:
    """Raise BadParameter for what is for one input alone."""
    alone = {
        "a measured response has one excitation; give the recordings of each axis to a tuning of its own": is_table,
        "a move (--move) is for one input: tune each alone": moves,
        "a machine (--for) gets the shaper of one input: tune each alone": machines,
    }
    for why, given in alone.items():
        if given:
            raise typer.BadParameter(f"{', '.join(names)}: {why}", param_hint="--input")


def of_inputs(
    path: Path,
    inputs: list[str],
    outputs: list[str] | None,
    requirements: Any,
    spread: dict[str, float],
    start_values: dict[str, str],
    beginning: dict[str, str],
    **options: Any,
) -> InputsTuning:
    """The tuning of a plant's inputs, with what is wrong told by the option."""
    from shaper_fmu.errors import ArgumentError
    from shaper_fmu.tune.tuning_inputs import check_inputs, tune_inputs

    source, left = source_of(path, start_values)
    with wrong_usage("--input"):
        check_inputs(inputs, spread)
    for name in inputs:
        checked_plant(source, left, name, outputs, spread, beginning)
    with told_by_progress([]) as hear:
        try:
            return tune_inputs(
                source, inputs, outputs, requirements=requirements, spread=spread, start_values=left, start=beginning,
                say=say, hear=hear, **options,
            )  # fmt: skip
        except ArgumentError as error:
            raise typer.BadParameter(str(error), param_hint="--resume" if options["resume"] else "--input") from None


def several_inputs(found: InputsTuning, target: Path, report: bool) -> None:
    """Print and write the result; exits with 1 if it is not good, and with 130 after a Ctrl-C."""
    from shaper_fmu.report.tune.inputs import write_inputs
    from shaper_fmu.report.tune.outputs import folder_for
    from shaper_fmu.tune.tuning_inputs import folder_name

    wanted, target = target, folder_for(found, target)
    if target != wanted:
        err.print(
            f"note: {shown(wanted)} keeps its tuning: it is another plant's, or other inputs', or good, which this one is not"
        )
    for name, one in found.tunings.items():
        out.print(f"input {name}:")
        print_result(one)
        write_results(one, target / folder_name(name), report, say)
    print_sentences(f"all inputs: {found.verdict.replace('_', ' ')}: {found.together_words}")
    for path in write_inputs(found, target, report=report, say=say):
        if path.suffix != ".png":
            wrote(path, f" ({found.verdict.replace('_', ' ')})" if not found.good and path.suffix == ".ssp" else "")
    if found.stopped is not None:
        message, code = end_message(found.stopped)
        err.print(f"{message}: what was known is kept in {shown(target)}; --resume goes on")
        raise typer.Exit(code)
    if not found.good:
        raise typer.Exit(1)
