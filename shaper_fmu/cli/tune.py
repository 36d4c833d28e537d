"""The command `shaper-fmu tune`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from shaper_fmu.cli.amounts import duration_of, share
from shaper_fmu.cli.arguments import (
    input_file,
    instant,
    longest_time,
    number,
    output_folder,
    pairs,
    positive,
    time_or_none,
    time_span,
    wrong_usage,
)
from shaper_fmu.cli.ends import end_message
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.cli.paths import shown
from shaper_fmu.cli.tune_inputs import check_several, of_inputs, several_inputs
from shaper_fmu.cli.tune_results import print_result, write_for, write_results
from shaper_fmu.cli.tune_sources import TABLES, of_plant, of_table, say
from shaper_fmu.console import err, out
from shaper_fmu.machines.names import Machine
from shaper_fmu.profiles.limits import NO_LIMIT
from shaper_fmu.tune.choice.requirements import Move


def tune(
    plant: Annotated[
        Path,
        typer.Argument(
            help="The plant (.fmu), a system with a free input (.ssp), or a measured response (.csv, .parquet).",
            callback=input_file(".fmu", ".ssp", *TABLES),
        ),
    ],
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            help="The plant's input that gets the commands; repeatable: a shaper before each. For a measured response the column "
            "of the excitation.",
        ),
    ] = None,
    common: Annotated[bool, typer.Option("--common", help="With several inputs: the same shaper before each.")] = False,
    outputs: Annotated[
        list[str] | None,
        typer.Option("--output", help="An output that must not vibrate; repeatable. Default: all outputs that vibrate."),
    ] = None,
    tolerance: Annotated[str, typer.Option(help="Tolerated residual vibration, as a share of the unshaped vibration.")] = "5%",
    nominal: Annotated[str, typer.Option(help="The same for the nominal plant; never more than --tolerance.")] = "1%",
    max_delay: Annotated[
        float,
        typer.Option(
            help="How much later than the unshaped command the shaped one may end [s].",
            show_default="any",
            parser=longest_time,
        ),
    ] = math.inf,
    vary: Annotated[
        list[str] | None,
        typer.Option(help="A parameter of the plant, or an input held at values, that varies, such as mass=10%; repeatable."),
    ] = None,
    margin: Annotated[
        str | None, typer.Option(help="Added to each natural frequency's range at both ends. Default: 10%, with --vary 0%.")
    ] = None,
    damping_margin: Annotated[str, typer.Option(help="Added to each damping ratio's range at both ends.")] = "0%",
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="A start value of the plant, such as mass=2; repeatable.")
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option("--start", help="A value of one of the plant's variables at the start, such as angle=0; repeatable."),
    ] = None,
    settle: Annotated[
        float,
        typer.Option(
            help="Time that the plant needs until it rests, before the experiments and the commands [s].", parser=time_or_none
        ),
    ] = 0.0,
    amplitude: Annotated[
        float | None,
        typer.Option(
            help="Size of the plant's commands, in the input's unit. Default: from the model description.",
            parser=number("a finite number but 0", lambda x: math.isfinite(x) and x != 0.0),
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            help="Estimate of some periods of the slowest mode [s]. Default: the FMU's default experiment.", parser=time_span
        ),
    ] = None,
    move: Annotated[
        float | None,
        typer.Option(
            help="Distance of a move, in the input's unit of length or angle: profiles are compared, too.",
            parser=number("a finite number but 0", lambda x: math.isfinite(x) and x != 0.0),
        ),
    ] = None,
    max_velocity: Annotated[float, typer.Option(help="With --move: its largest speed.", parser=positive)] = NO_LIMIT,
    max_acceleration: Annotated[float, typer.Option(help="With --move: its largest acceleration.", parser=positive)] = NO_LIMIT,
    budget: Annotated[
        float | None,
        typer.Option(help="Time that the experiments on the plant may take, such as 2min. Default: any.", parser=duration_of),
    ] = None,
    steps: Annotated[
        int | None,
        typer.Option(help="Steps that the plant may take. Default: any.", parser=number("at least 1", lambda n: n >= 1, int)),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on with a tuning that was interrupted: runs kept in its folder are not made again.",
        ),
    ] = False,
    workers: Annotated[
        int,
        typer.Option(
            help="Processes in which the plant is run at once, at the points of the range.",
            parser=number("at least 1", lambda n: n >= 1, int),
        ),
    ] = 1,
    kinds: Annotated[
        list[str] | None, typer.Option("--kind", help="A shaper to choose from, such as zvd; repeatable. Default: all.")
    ] = None,
    allow_negative: Annotated[bool, typer.Option("--allow-negative", help="Shapers may have negative impulses.")] = False,
    excitation_end: Annotated[
        float | None,
        typer.Option(help="When the measured response becomes free [s]. Default: from --input, or estimated.", parser=instant),
    ] = None,
    command: Annotated[
        str, typer.Option(help="For a measured response the column of a command that excites throughout, such as a swept sine.")
    ] = "",
    also: Annotated[
        list[Path] | None,
        typer.Option(
            "--also",
            help="A further recording of the machine; repeatable: the shaper is for the modes of all, or of those of its axis.",
            callback=input_file(*TABLES),
        ),
    ] = None,
    time_unit: Annotated[
        str | None, typer.Option(help="Unit of a measured response's time column. Default: from its header, or s.")
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option("--output-folder", help="Output folder. Default: <plant>_tuned.", callback=output_folder),
    ] = None,
    report: Annotated[bool, typer.Option("--report/--no-report", help="Whether to write the report.")] = True,
    machines: Annotated[
        list[Machine] | None, typer.Option("--for", help="Write the shaper for a machine, too (docs/machines.md); repeatable.")
    ] = None,
    axis: Annotated[
        str, typer.Option(help="With --for: the axis of a firmware. Default: that of a sweep's column, or x.", show_default=False)
    ] = "",
    cycle: Annotated[float, typer.Option(help="With --for st: the PLC's shortest cycle [s].", parser=time_span)] = 0.001,
) -> None:
    """Identify a plant's modes, choose a shaper for them, and verify it on the plant.

    Writes the shaper as an FMU and as a parameter set, the shaped plant as an SSP archive, a report, and all numbers as JSON.
    The exit code is 1 if no shaper meets the requirements; the output gives the reason, and what would help.

    \b
    Examples:
        shaper-fmu tune crane.fmu --input trolley_acceleration --output swing_angle --vary initial_rope_length=10%
        shaper-fmu tune gantry.fmu --input force_x --input force_y --output angle_x --output angle_y
        shaper-fmu tune loop.ssp --input controller.reference --output chain.position_3 --max-delay 2
        shaper-fmu tune ringing.csv --input force --output position
        shaper-fmu tune sweep.csv --command current --output acceleration
        shaper-fmu tune left.csv --also right.csv --also middle.csv
        shaper-fmu tune ringing.csv --output position --for klipper --axis y
        shaper-fmu tune raw_data_x.csv --also raw_data_y.csv --for klipper
    """
    from shaper_fmu.tune.kept_runs import FILE
    from shaper_fmu.tune.meter import Budget
    from shaper_fmu.tune.tuning import requirements_for

    spread = {name: share(text, "--vary") for name, text in pairs(vary, "--vary", "mass=10%").items()}
    allowed = share(tolerance, "--tolerance")
    wanted: dict[str, Any] = {
        "tolerance": allowed, "nominal_tolerance": min(allowed, share(nominal, "--nominal")),
        "damping_margin": share(damping_margin, "--damping-margin"),
        "longest_delay": max_delay, "kinds": tuple(kinds) if kinds else None, "allow_negative": allow_negative,
    }  # fmt: skip
    if margin is not None:
        wanted["frequency_margin"] = share(margin, "--margin")
        if not 0.0 <= wanted["frequency_margin"] < 1.0:
            raise typer.BadParameter(f"{margin} is outside its domain: at least 0% and less than 100%", param_hint="--margin")
    if wanted["damping_margin"] < 0.0:
        raise typer.BadParameter(f"{damping_margin} is outside its domain: at least 0%", param_hint="--damping-margin")
    if move is not None and machines:
        raise typer.BadParameter("a machine gets a shaper for all its commands, not a move; leave --move out", param_hint="--for")
    if move is not None:
        wanted["move"] = Move(move, max_velocity, max_acceleration)
    elif min(max_velocity, max_acceleration) < NO_LIMIT:
        raise typer.BadParameter("this needs a distance (--move)", param_hint="--max-velocity or --max-acceleration")
    with wrong_usage():
        requirements = requirements_for(spread, **wanted)
    names = list(inputs or ())
    if common and len(names) < 2:
        raise typer.BadParameter("this needs several inputs (--input)", param_hint="--common")
    if len(names) > 1:
        check_several(names, is_table=plant.suffix.lower() in TABLES, moves=move is not None, machines=bool(machines))
    tell_missing(pages=report, panel=report, shaper=True)
    target: Path = output_folder(folder or Path(f"{plant.stem}_tuned"))
    start_values, beginning = pairs(settings, "--set", "mass=2"), pairs(start, "--start", "angle=0")
    if plant.suffix.lower() in TABLES:
        if workers > 1:
            raise typer.BadParameter("a measured response has no plant to run in processes", param_hint="--workers")
        if resume:
            raise typer.BadParameter("a measured response has no runs of a plant to go on from", param_hint="--resume")
        found = of_table(
            plant,
            names[0] if names else "",
            outputs,
            requirements,
            [*spread, *start_values, *beginning],
            excitation_end=excitation_end,
            time_unit=time_unit,
            command=command or None,
            also=also or (),
        )
    else:
        options: dict[str, Any] = {
            "amplitude": amplitude, "duration": duration, "budget": Budget(steps, budget), "settle": settle, "resume": resume,
            "workers": workers,
        }  # fmt: skip
        given = plant, names, outputs, requirements, spread, start_values, beginning
        if len(names) > 1:
            several_inputs(of_inputs(*given, common=common, keep=target, **options), target, report)
            return
        found = {"": of_plant(*given, keep=target / FILE, **options)}
    several = len(found) > 1
    good, into = [one.good for one in found.values()], target
    for along, one in found.items():
        if several:
            out.print(f"axis {along} ({one.source}):")
        print_result(one)
        into = write_results(one, target / along if several else target, report, say)
    for machine in machines or []:
        axes = {along: along if several else axis or along or "x" for along in found}
        good.append(write_for(machine, found, axes, cycle, target if several else into))
    stopped = next((one.system.meter.stopped for one in found.values() if one.system is not None), None)
    if stopped is not None:
        message, code = end_message(stopped)
        verdicts = " and ".join(one.verdict.replace("_", " ") for one in found.values())
        err.print(f"{message}: what was known is kept in {shown(into)}, and its verdict is {verdicts}; --resume goes on")
        raise typer.Exit(code)
    if not all(good):
        raise typer.Exit(1)
