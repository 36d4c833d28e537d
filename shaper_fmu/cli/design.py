"""The command `shaper-fmu design`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from shaper_fmu.cli import arguments as check
from shaper_fmu.cli.compared import check_compared, compared_blocks
from shaper_fmu.cli.fastest import design_fastest, write_segments
from shaper_fmu.cli.frequencies import Frequencies, frequency_words, mode_words, natural_frequencies
from shaper_fmu.cli.kept import Force, check_kept
from shaper_fmu.cli.modes import design_for_modes, write_plot
from shaper_fmu.cli.profile import design_profile, modes_of, residual_blocks
from shaper_fmu.component import Variable
from shaper_fmu.console import out, show
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.shapers import OPTIONS, shaper
from shaper_fmu.errors import ComponentError, nearest
from shaper_fmu.kinds.profiles import FURTHER_PARAMETERS as OF_FOREIGN_PROFILES
from shaper_fmu.kinds.profiles import PARAMETERS as OF_OWN_PROFILES
from shaper_fmu.kinds.profiles import PROFILES
from shaper_fmu.kinds.pulses import FURTHER_PARAMETERS as OF_PULSES
from shaper_fmu.kinds.pulses import PULSES as DESIGNS
from shaper_fmu.kinds.shapers import Shaper
from shaper_fmu.page.blocks import Table
from shaper_fmu.profiles.limits import NO_LIMIT

if TYPE_CHECKING:
    from shaper_fmu.design.fastest import FastestMove
    from shaper_fmu.design.pulse_sequence import PulseSequence
    from shaper_fmu.page.blocks import Block

SHAPERS = [item.name for item in Shaper if item != Shaper.custom]
OFFLINE = ["si", "direct_zv", "direct_zvd"]
PULSES = [name for name in DESIGNS if name not in SHAPERS]


OF_PROFILES = {**OF_OWN_PROFILES, **OF_FOREIGN_PROFILES}
OF_SHAPERS = {name: variable for name, variable in OPTIONS.items() if name != "vibration_tolerance"}


@dataclass(frozen=True)
class _Wanted:
    """The options, as given."""

    kind: str
    frequencies: list[float]
    ratios: list[float]
    tolerance: float
    given: dict[str, float]
    low: float | None
    high: float | None
    damping: tuple[float, float] | None
    distance: float
    duration: float | None
    max_velocity: float
    max_acceleration: float
    max_jerk: float
    frequency_ratio: float
    minimum_pulse_width: float

    def parameters(self, known: Mapping[str, Variable[Any]]) -> dict[str, float]:
        """Those of the methods' parameters that are known."""
        return {name: value for name, value in self.given.items() if name in known}


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
    Example: shaper-fmu design zvd --natural-frequency 5 --damping-ratio 0.1 --plot zvd.html
    Example: shaper-fmu design ei -f 0.8 -z 5% --tolerance 2%
    Example: shaper-fmu design zv zvd ei -f 5 --plot kinds.html
    Example: shaper-fmu design fastest -w 5 --max-velocity 1 --max-acceleration 3 --segments move.csv
    """
    kind, compared = kinds[0], list(dict.fromkeys(kinds))
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
    wanted = _Wanted(
        kind, natural_frequencies(natural_frequency, frequency), damping_ratio or [0.0],
        0.05 if tolerance is None else tolerance, parameters, low, high,
        damping_range, distance, duration, max_velocity, max_acceleration, max_jerk, frequency_ratio, minimum_pulse_width,
    )  # fmt: skip
    if len(compared) > 1:
        with check.wrong_usage():
            blocks = compared_blocks(wanted, compared, lambda one: _sequence(replace(wanted, kind=one)))
        _show(blocks, wanted, damping_ratio)
        if plot:
            write_plot(plot, f"{', '.join(compared)} for {frequency_words(wanted.frequencies)}", blocks)
        return
    with check.wrong_usage():
        deflections = deflection_limit or []
        move = _fastest(wanted, tolerance or 0.0, deflections, on_off_pulses) if kind == "fastest" else None
        blocks = _blocks(wanted) if move is None else _of_fastest(wanted, move)
    _show(blocks, wanted, damping_ratio)
    if move is not None and segments is not None:
        write_segments(segments, move)
    if len(wanted.frequencies) > 1:
        out.print(f"The figures of merit are for the first mode, {frequency_words(wanted.frequencies[:1])}.")
    if plot:
        write_plot(
            plot, f"{kind} for {', '.join(f'{w:g}' for w in wanted.frequencies) or '10'} rad/s", [*blocks, *_panel(wanted, plot)]
        )


def _show(blocks: Sequence[Block], wanted: _Wanted, ratios: list[float] | None) -> None:
    """Print for which modes, and the tables."""
    if wanted.frequencies:
        out.print(f"for {mode_words(wanted.frequencies, ratios)}")
    for block in blocks:
        if isinstance(block, Table):
            show(block)


def _fastest(wanted: _Wanted, tolerance: float, deflections: Sequence[float], pulses: int) -> FastestMove:
    if wanted.duration is not None:
        raise typer.BadParameter("the fastest move takes the time that it needs", param_hint="--duration")
    if wanted.damping is not None:
        raise typer.BadParameter("the fastest move is for one damping ratio of each mode", param_hint="--damping-range")
    if (wanted.low is None) != (wanted.high is None):
        raise typer.BadParameter("give both ends of the band", param_hint="--low" if wanted.low is None else "--high")
    limits = {"max_velocity": wanted.max_velocity, "max_acceleration": wanted.max_acceleration, "max_jerk": wanted.max_jerk}
    band = wanted.low, wanted.high
    if not wanted.frequencies and None in band:
        raise typer.BadParameter("give at least one, or --low and --high", param_hint="--natural-frequency")
    return design_fastest(wanted.distance, limits, wanted.frequencies, wanted.ratios, tolerance, band, deflections, pulses)


def _of_fastest(wanted: _Wanted, move: FastestMove) -> list[Block]:
    from shaper_fmu.report.design import Mode
    from shaper_fmu.report.moves import fastest_blocks

    first = move.modes[0]
    return fastest_blocks(move, Mode(0.5 * (first.low + first.high), first.damping_ratio, wanted.tolerance))


check.add_options(design, {**OF_SHAPERS, **OF_PROFILES, **OF_PULSES})


def _blocks(wanted: _Wanted) -> list[Block]:
    from shaper_fmu.report.design import Mode, profile_blocks, pulse_blocks, shaper_blocks

    known = [*SHAPERS, *OFFLINE, *PROFILES, *PULSES]
    if wanted.kind not in known:
        raise ComponentError(f"there is no shaper, profile or pulse train {wanted.kind!r}.{nearest(wanted.kind, known)}")
    if wanted.kind == "si":
        if wanted.low is None or wanted.high is None:
            raise typer.BadParameter("si needs --low and --high", param_hint="KIND")
        wanted.frequencies.append(0.5 * (wanted.low + wanted.high))
    if not wanted.frequencies:
        raise typer.BadParameter("give at least one", param_hint="--natural-frequency")
    mode = Mode(wanted.frequencies[0], wanted.ratios[0], wanted.tolerance)
    if wanted.kind in PROFILES:
        from shaper_fmu.report.moves import floor_blocks

        modes = modes_of(wanted.frequencies, wanted.ratios)
        limits = {"max_velocity": wanted.max_velocity, "max_acceleration": wanted.max_acceleration}
        own = wanted.parameters(OF_PROFILES)
        law = design_profile(wanted.kind, wanted.distance, wanted.duration, modes, limits, own)
        return [*profile_blocks(wanted.kind, law, mode), *residual_blocks(law, modes), *floor_blocks(law, mode)]
    if wanted.kind in PULSES:
        pulses = _pulses(wanted)
        return [*_proven(wanted, pulses), *pulse_blocks(wanted.kind, pulses, mode)]
    sequence = _sequence(wanted)
    return [*_proven(wanted, sequence), *shaper_blocks(wanted.kind, sequence, mode)]


def _panel(wanted: _Wanted, plot: Path) -> list[Block]:
    """The live page with this shaper, and its modes as the plant."""
    if wanted.kind not in SHAPERS or plot.suffix.lower() not in check.PAGE:
        return []
    from shaper_fmu.live.panel import live_panel

    ratios = wanted.ratios if len(wanted.ratios) > 1 else wanted.ratios * len(wanted.frequencies)
    modes = list(zip(wanted.frequencies, ratios, strict=False))
    given = [(w, w, w) for w, _ in modes], [(zeta, zeta, zeta) for _, zeta in modes]
    return live_panel(wanted.kind, modes, wanted.tolerance, *given)


def _proven(wanted: _Wanted, command: ImpulseSequence | PulseSequence) -> list[Block]:
    """The bound of V over the wanted frequencies and damping ratios, if any are wanted."""
    from shaper_fmu.design.guarantees import guarantee

    if wanted.low is None or wanted.high is None:
        if wanted.damping is not None:
            raise typer.BadParameter("give --low and --high, too", param_hint="--damping-range")
        return []
    damping = wanted.damping or (wanted.ratios[0], wanted.ratios[0])
    found = guarantee(command, (wanted.low, wanted.high), damping)
    ends = f"{wanted.low / (2.0 * math.pi):.4g} to {wanted.high / (2.0 * math.pi):.4g} Hz"
    where = f"{wanted.low:g} to {wanted.high:g} rad/s ({ends}), damping ratio {damping[0]:g} to {damping[1]:g}"
    rows = [
        ["V is nowhere above", f"{100.0 * found.bound:.6f} %"],
        ["its largest value found", f"{100.0 * found.attained:.6f} %"],
        ["at", f"{frequency_words([found.at[0]])}, damping ratio {found.at[1]:g}"],
    ]
    return [Table(f"Proven: {where}", ["what", "value"], rows)]


def _sequence(wanted: _Wanted) -> ImpulseSequence:
    from shaper_fmu.design.specified_bands import specified_insensitivity
    from shaper_fmu.design.two_mode import direct_two_mode

    ratios = wanted.ratios
    if wanted.low is not None and wanted.high is not None and wanted.kind == "si":
        return specified_insensitivity(wanted.low, wanted.high, wanted.tolerance, ratios[0])
    if wanted.kind in OFFLINE:
        if len(wanted.frequencies) != 2:
            raise ComponentError(f"{wanted.kind} is for two modes; {len(wanted.frequencies)} natural frequencies were given")
        return direct_two_mode(wanted.frequencies, ratios if len(ratios) == 2 else ratios * 2, wanted.kind.removeprefix("direct_"))
    return shaper(
        wanted.kind,
        wanted.frequencies,
        ratios[0] if len(ratios) == 1 else ratios,
        vibration_tolerance=wanted.tolerance,
        **wanted.parameters(OF_SHAPERS),
    )


def _pulses(wanted: _Wanted) -> PulseSequence:
    from shaper_fmu.design.pulses import pulses

    if wanted.duration is None and DESIGNS[wanted.kind].timed:
        raise typer.BadParameter(f"{wanted.kind} needs one", param_hint="--duration")
    return pulses(
        wanted.kind,
        wanted.frequencies[0],
        wanted.ratios[0],
        duration=wanted.duration if DESIGNS[wanted.kind].timed else None,
        frequency_ratio=wanted.frequency_ratio,
        minimum_pulse_width=wanted.minimum_pulse_width,
        **wanted.parameters(OF_PULSES),
    )
