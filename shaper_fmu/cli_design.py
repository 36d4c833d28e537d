"""The command `shaper-fmu design`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from shaper_fmu.console import out, show
from shaper_fmu.errors import ComponentError, nearest
from shaper_fmu.shapers.design import shaper
from shaper_fmu.shapers.kinds import Shaper
from shaper_fmu.shapers.sequence import ImpulseSequence

OFFLINE = ("si", "direct_zv", "direct_zvd")
KINDS = [item.name for item in Shaper if item != Shaper.custom] + list(OFFLINE)


def design(
    kind: Annotated[str, typer.Argument(help=f"One of {', '.join(KINDS)}.")],
    natural_frequency: Annotated[
        list[float] | None,
        typer.Option("--natural-frequency", "-w", help="Undamped natural frequency [rad/s]; repeat it for several modes."),
    ] = None,
    damping_ratio: Annotated[
        list[float] | None, typer.Option("--damping-ratio", "-z", help="Damping ratio; once, or once for each mode.")
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Tolerated residual vibration V: of EI, SI, the insensitivity.")] = 0.05,
    negative_amplitude: Annotated[float, typer.Option(help="Size of the negative impulse of sna_zv.")] = 0.5,
    equal_impulses: Annotated[int, typer.Option(help="Number of impulses of miszv.")] = 3,
    low: Annotated[float | None, typer.Option(help="Lowest natural frequency that si tolerates [rad/s].")] = None,
    high: Annotated[float | None, typer.Option(help="Highest natural frequency that si tolerates [rad/s].")] = None,
    plot: Annotated[Path | None, typer.Option(help="Write a page with the sensitivity curves, and a picture of each.")] = None,
) -> None:
    """Design a shaper: print its impulses, duration, insensitivity and distance to the floor; plot its sensitivity.

    si: specified insensitivity from --low to --high. direct_zv, direct_zvd: two modes at once, shorter than convolved.
    Example: shaper-fmu design zvd --natural-frequency 5 --damping-ratio 0.1 --plot zvd.html
    """
    from shaper_fmu.report.design_report import design_blocks, impulse_table, merit_table
    from shaper_fmu.report.page import write_report

    frequencies, ratios = natural_frequency or [], damping_ratio or [0.0]
    if kind == "si":
        if low is None or high is None:
            raise typer.BadParameter("si needs --low and --high", param_hint="KIND")
        frequencies = frequencies or [0.5 * (low + high)]
        sequence = _specified(low, high, tolerance, ratios[0])
    elif not frequencies:
        raise typer.BadParameter("give at least one", param_hint="--natural-frequency")
    elif kind in OFFLINE:
        sequence = _direct(kind, frequencies, ratios)
    elif kind in KINDS:
        damping = ratios[0] if len(ratios) == 1 else ratios
        options = {"negative_amplitude": negative_amplitude, "equal_impulses": equal_impulses}
        sequence = shaper(kind, frequencies, damping, vibration_tolerance=tolerance, **options)
    else:
        raise ComponentError(f"there is no shaper {kind!r}.{nearest(kind, KINDS)}")
    mode = frequencies[0], ratios[0], tolerance
    show(impulse_table(sequence))
    show(merit_table(sequence, *mode))
    if len(frequencies) > 1:
        out.print(f"The figures of merit are for the first mode, {frequencies[0]:g} rad/s.")
    if plot:
        title = f"{kind} for {', '.join(f'{w:g}' for w in frequencies)} rad/s"
        for path in write_report(plot, title, design_blocks(kind, sequence, *mode)):
            out.print(f"wrote {path}")


def _specified(low: float, high: float, tolerance: float, damping_ratio: float) -> ImpulseSequence:
    from shaper_fmu.shapers.specified_insensitivity import specified_insensitivity

    return specified_insensitivity(low, high, tolerance, damping_ratio)


def _direct(kind: str, frequencies: list[float], ratios: list[float]) -> ImpulseSequence:
    from shaper_fmu.shapers.two_mode import direct_two_mode

    if len(frequencies) != 2:
        raise ComponentError(f"{kind} is for two modes; {len(frequencies)} natural frequencies were given")
    return direct_two_mode(frequencies, ratios if len(ratios) == 2 else ratios * 2, kind.removeprefix("direct_"))
