"""The commands `shaper-fmu new ...`, which write templates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Typer

from shaper_fmu.cli.arguments import damping_ratio as damping
from shaper_fmu.cli.arguments import input_file, input_system, output_file, rate, wrong_usage
from shaper_fmu.cli.frequencies import Frequency, frequency_words, natural_frequencies
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.paths import shown, wrote
from shaper_fmu.console import err, out
from shaper_fmu.progress import progress

app: Typer = typer.Typer(no_args_is_help=True, help="Write templates.")


@app.callback()
def _new() -> None:
    """Write a template: a system, or a study."""


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
        float | None,
        typer.Option("--natural-frequency", "-w", help="Natural frequency [rad/s]. Default: the plant's, or 2 pi.", parser=rate),
    ] = None,
    frequency: Frequency = None,
    damping_ratio: Annotated[
        float | None,
        typer.Option(
            "--damping-ratio", "-z", help="Damping ratio, such as 0.05 or 5%. Default: the plant's, or 0.", parser=damping
        ),
    ] = None,
    force: Force = False,
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
    given = natural_frequencies(*([one] if one is not None else None for one in (natural_frequency, frequency)))
    path: Path = output_file(".ssp")(target or Path(f"{plant.stem}_shaped.ssp"))
    check_kept(path, force, "--output-file")
    fmu = load_fmu(plant)
    with wrong_usage("--input or --output"):
        check_ports(fmu, input_, output)
    with progress("writing the system", err):
        written = write_template(
            fmu, input_, output, path, kind=shaper, natural_frequency=next(iter(given), None), damping_ratio=damping_ratio
        )
    wrote(written.path, f": profile.{written.profile_output} -> shaper -> plant.{input_}")
    summary = f"{shaper} for {frequency_words([written.natural_frequency])} and the damping ratio {written.damping_ratio:.6g}"
    out.print(
        summary
        if written.known
        else f"{summary}: the plant declares no natural frequency, so give --natural-frequency or --frequency"
    )
    out.print(f"try: shaper-fmu run {shown(written.path)}, and the same with --parameter-set unshaped; look at plant.{output}")


@app.command("study")
def new_study(
    system: Annotated[Path, typer.Argument(help="SSP archive (.ssp), or a system's folder.", callback=input_system(".ssp"))],
    target: Annotated[
        Path | None,
        typer.Option(
            "--output-file",
            help="Study to write. Default: study.toml, of a folder in it.",
            callback=output_file(".toml"),
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Write a commented study of a system: what varies, what is compared, what is measured, in the system's own names.

    It runs as it stands: one start value of the last FMU varies by 20 %, and cases are unshaped, ZV and ZVD if there is a shaper.

    \b
    Example:
        shaper-fmu new study crane.ssp
        shaper-fmu sweep study.toml
    """
    from shaper_fmu.sweep.template import write_study

    path: Path = output_file(".toml")(target or (system / "study.toml" if system.is_dir() else Path("study.toml")))
    check_kept(path, force, "--output-file")
    with progress("reading the system", err):
        varied = write_study(system, path)
    wrote(path, f": varies {varied}")
    out.print(f"edit it, then: shaper-fmu sweep {shown(path)}")
