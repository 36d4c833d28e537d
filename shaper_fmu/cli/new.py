"""The commands `shaper-fmu new ...`, which write templates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Typer

from shaper_fmu.cli.arguments import damping_ratio as damping
from shaper_fmu.cli.arguments import input_file, output_file, positive, wrong_usage
from shaper_fmu.cli.paths import shown, wrote
from shaper_fmu.console import err, out
from shaper_fmu.progress import progress

app: Typer = typer.Typer(no_args_is_help=True, help="Write templates.")


@app.callback()
def _new() -> None:
    """Write a template: a system."""


@app.command("system")
def new_system(
    plant: Annotated[Path, typer.Option(help="The plant (.fmu).", callback=input_file(".fmu"))],
    input_: Annotated[str, typer.Option("--input", help="The plant's input that gets the command, such as a force.")],
    output: Annotated[str, typer.Option(help="The plant's output to observe, such as a position.")],
    target: Annotated[
        Path | None,
        typer.Option("--output-file", help="Archive to write. Default: <plant>_shaped.ssp.", callback=output_file(".ssp")),
    ] = None,
    shaper: Annotated[str, typer.Option(help="Shaper: none, zv, zvd, zvdd, zvddd, ei, ...")] = "zv",
    natural_frequency: Annotated[
        float | None, typer.Option(help="Natural frequency [rad/s]. Default: the plant's, or 2 pi.", parser=positive)
    ] = None,
    damping_ratio: Annotated[float | None, typer.Option(help="Damping ratio. Default: the plant's, or 0.", parser=damping)] = None,
) -> None:
    """Write an SSP archive with a reference and an input shaper in front of a plant.

    \b
    Example:
        shaper-fmu new system --plant crane.fmu --input trolley_acceleration --output swing_angle
        shaper-fmu run crane_shaped.ssp --report shaped.html
        shaper-fmu run crane_shaped.ssp --parameter-set unshaped --report unshaped.html
    """
    from shaper_fmu.master.fmu import load_fmu
    from shaper_fmu.ssp.template import SHAPERS, check_ports, write_template

    if shaper not in SHAPERS:
        raise typer.BadParameter(f"{shaper!r} is none of {', '.join(SHAPERS)}", param_hint="--shaper")
    path: Path = output_file(".ssp")(target or Path(f"{plant.stem}_shaped.ssp"))
    fmu = load_fmu(plant)
    with wrong_usage("--input or --output"):
        check_ports(fmu, input_, output)
    with progress("writing the system", err):
        written = write_template(
            fmu, input_, output, path, kind=shaper, natural_frequency=natural_frequency, damping_ratio=damping_ratio
        )
    wrote(written.path, f": profile.{written.profile_output} -> shaper -> plant.{input_}")
    summary = f"{shaper} for {written.natural_frequency:.6g} rad/s and the damping ratio {written.damping_ratio:.6g}"
    out.print(summary if written.known else f"{summary}: the plant declares no natural frequency, so give --natural-frequency")
    out.print(f"try: shaper-fmu run {shown(written.path)}, and the same with --parameter-set unshaped; look at plant.{output}")
