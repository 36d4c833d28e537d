"""The command `shaper-fmu design`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from shaper_fmu.cli import arguments as check
from shaper_fmu.cli.compared import check_compared, compared_blocks
from shaper_fmu.cli.designed import (
    OF_PROFILES,
    OF_SHAPERS,
    OFFLINE,
    PULSES,
    SHAPERS,
    Wanted,
    blocks_of,
    fastest,
    fastest_shown,
    panel,
    sequence_of,
)
from shaper_fmu.cli.fastest import write_segments
from shaper_fmu.cli.frequencies import Frequencies, band_words, frequency_words, mode_words, natural_frequencies
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.modes import design_for_modes, write_plot
from shaper_fmu.cli.optional import tell_missing
from shaper_fmu.console import out, show
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.kinds.pulses import FURTHER_PARAMETERS as OF_PULSES
from shaper_fmu.page.blocks import Table
from shaper_fmu.profiles.limits import NO_LIMIT

if TYPE_CHECKING:
    from shaper_fmu.page.blocks import Block


def design(
    kinds: Annotated[
        list[str],
        typer.Argument(
            metavar="KIND",
            help=f"A shaper ({', '.join(SHAPERS + OFFLINE)}), a profile ({', '.join(PROFILES)}), "
            f"or a pulse train ({', '.join(PULSES)}); several shapers are compared.",
        ),
    ],
    natural_frequency: Annotated[
        list[float] | None,
        typer.Option(
            "--natural-frequency",
            "-w",
            help="Undamped natural frequency [rad/s]; repeat it for several modes.",
            parser=check.rate,
        ),
    ] = None,
    frequency: Frequencies = None,
    damping_ratio: Annotated[
        list[float] | None,
        typer.Option(
            "--damping-ratio",
            "-z",
            help="Damping ratio, such as 0.05 or 5%; one for all modes, or one per mode.",
            parser=check.damping_ratio,
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="Tolerated residual vibration V, such as 5%, for EI, SI and the insensitivity (default: 5%), "
            "and fastest (default: none).",
            parser=check.share,
        ),
    ] = None,
    low: Annotated[
        float | None,
        typer.Option(
            help="Lowest natural frequency: the lower end of the range of si and fastest, or for which V is bounded "
            "[rad/s], or such as 0.8Hz.",
            parser=check.rate,
        ),
    ] = None,
    high: Annotated[
        float | None,
        typer.Option(
            help="Highest natural frequency: the upper end of the same range [rad/s], or such as 1.2Hz.", parser=check.rate
        ),
    ] = None,
    damping_range: Annotated[
        tuple[float, float] | None,
        typer.Option(help="Damping ratios for which V is bounded, with --low and --high.", parser=check.damping_ratio),
    ] = None,
    distance: Annotated[float, typer.Option(help="Distance of a profile [m].", parser=check.finite)] = 1.0,
    duration: Annotated[
        float | None,
        typer.Option(help="Duration of a profile (default: the shortest) or pulse train [s].", parser=check.not_negative),
    ] = None,
    max_velocity: Annotated[float, typer.Option(help="Largest speed of a profile [m/s].", parser=check.positive)] = NO_LIMIT,
    max_acceleration: Annotated[
        float, typer.Option(help="Largest acceleration of a profile [m/s2].", parser=check.positive)
    ] = NO_LIMIT,
    max_jerk: Annotated[float, typer.Option(help="Largest jerk of fastest [m/s3].", parser=check.positive)] = NO_LIMIT,
    deflection_limit: Annotated[
        list[float] | None,
        typer.Option(
            help="Largest deflection of the modes from the base on the way of fastest [m]; one for all, or one per mode.",
            parser=check.positive,
        ),
    ] = None,
    on_off_pulses: Annotated[
        int,
        typer.Option(min=0, max=12, help="With --deflection-limit: on/off pulses in place of a held deflection (default: none)."),
    ] = 0,
    segments: Annotated[
        Path | None,
        typer.Option(
            help="Write the segments of fastest for a machine: a table (.csv), or all numbers (.json).",
            callback=check.output_file(".csv", ".json"),
        ),
    ] = None,
    frequency_ratio: Annotated[
        float, typer.Option(help="Carrier frequency of pulse trains, divided by the damped frequency.", parser=check.positive)
    ] = 13.0,
    minimum_pulse_width: Annotated[
        float, typer.Option(help="Shortest pulse or gap of pulse trains [s].", parser=check.not_negative)
    ] = 0.0,
    modes: Annotated[
        Path | None,
        typer.Option(
            help="Select the modes to shape from a file with the modes of a step response (TOML or JSON).",
            callback=check.input_file(".toml", ".json"),
        ),
    ] = None,
    other: Annotated[
        list[str] | None, typer.Option("--or", help="With --modes: an alternative shaper for each mode; repeatable.")
    ] = None,
    settling: Annotated[
        bool, typer.Option("--settling", help="With --modes: minimise the settling time instead of the shaper's duration.")
    ] = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            help="Write the curves: a page (.html) and a picture of each, or all in one picture (.png, .svg).",
            callback=check.output_file(*check.PAGE, *check.PICTURE),
        ),
    ] = None,
    force: Force = False,
    **parameters: float,
) -> None:
    """Design a shaper, a profile or a pulse train; print its numbers and figures of merit, and plot its sensitivity.

    si: specified insensitivity from --low to --high. direct_zv, direct_zvd: two modes at once, shorter than convolved.
    fastest: the fastest move without vibration of all modes (-w 5 -w 14), within limits of speed, acceleration and jerk, and a
    proof that none is faster; from --low to --high it leaves at most --tolerance; --deflection-limit is kept on the way.
    s_curve_modes: an S-curve without vibration of up to three modes (-w 5 -w 14), the shortest within the limits.
    With --low and --high, an upper bound of the residual vibration V is proven for all frequencies (and damping ratios) in between.
    With --modes, --tolerance is the share of the final values that may swing after the last impulse.

    \b
    Examples:
        shaper-fmu design zvd --natural-frequency 5 --damping-ratio 0.1 --plot zvd.html
        shaper-fmu design ei -f 0.8 -z 5% --tolerance 2%
        shaper-fmu design zv zvd ei -f 5 --plot kinds.html
        shaper-fmu design fastest -w 5 --max-velocity 1 --max-acceleration 3 --segments move.csv
    """
    kind, compared = kinds[0], list(dict.fromkeys(kinds))
    page = plot is not None and plot.suffix.lower() in check.PAGE
    tell_missing(pages=page, panel=page and compared == [kind] and kind in SHAPERS and modes is None)
    check_kept(plot, force, "--plot")
    check_kept(segments, force, "--segments")
    if kind != "fastest":
        of_fastest = {
            "--segments": segments is not None,
            "--max-jerk": max_jerk < NO_LIMIT,
            "--deflection-limit": deflection_limit,
            "--on-off-pulses": on_off_pulses,
        }
        for option, given in of_fastest.items():
            if given:
                raise typer.BadParameter(f"this needs the kind fastest, not {kind}", param_hint=option)
    if len(compared) > 1:
        check_compared(
            compared, [*SHAPERS, *OFFLINE], {"--modes": modes, "--or": other, "--settling": settling, "--segments": segments}
        )
    if modes is not None:
        if natural_frequency or frequency or damping_ratio:
            raise typer.BadParameter("it takes the place of --natural-frequency and --damping-ratio", param_hint="--modes")
        design_for_modes(
            modes,
            [kind, *(other or [])],
            0.05 if tolerance is None else tolerance,
            settling,
            plot,
            **{name: value for name, value in parameters.items() if name in OF_SHAPERS},
        )
        return
    if other or settling:
        raise typer.BadParameter("this needs --modes", param_hint="--or" if other else "--settling")
    wanted = Wanted(
        kind, natural_frequencies(natural_frequency, frequency), damping_ratio or [0.0],
        0.05 if tolerance is None else tolerance, parameters, low, high,
        damping_range, distance, duration, max_velocity, max_acceleration, max_jerk, frequency_ratio, minimum_pulse_width,
    )  # fmt: skip
    if len(compared) > 1:
        with check.wrong_usage():
            blocks = compared_blocks(wanted, compared, lambda one: sequence_of(replace(wanted, kind=one)))
        _show(blocks, wanted, damping_ratio)
        if plot:
            write_plot(plot, f"{', '.join(compared)} for {frequency_words(wanted.frequencies)}", blocks)
        return
    with check.wrong_usage():
        deflections = deflection_limit or []
        move = fastest(wanted, tolerance or 0.0, deflections, on_off_pulses) if kind == "fastest" else None
        blocks = blocks_of(wanted) if move is None else fastest_shown(wanted, move)
    _show(blocks, wanted, damping_ratio)
    if move is not None and segments is not None:
        write_segments(segments, move)
    if len(wanted.frequencies) > 1:
        out.print(f"The figures of merit are for the first mode, {frequency_words(wanted.frequencies[:1])}.")
    if plot:
        write_plot(plot, f"{kind} for {_for_words(wanted)}", [*blocks, *panel(wanted, plot)])


def _for_words(wanted: Wanted) -> str:
    """The modes, or the band, that it was designed for."""
    if wanted.frequencies or wanted.low is None or wanted.high is None:
        return frequency_words(wanted.frequencies)
    return band_words(wanted.low, wanted.high)


def _show(blocks: Sequence[Block], wanted: Wanted, ratios: list[float] | None) -> None:
    """Print for which modes, and the tables."""
    if wanted.frequencies:
        out.print(f"for {mode_words(wanted.frequencies, ratios)}")
    for block in blocks:
        if isinstance(block, Table):
            show(block)


check.add_options(design, {**OF_SHAPERS, **OF_PROFILES, **OF_PULSES})
