"""What `shaper-fmu design` designs: a shaper, a profile, a pulse train or the fastest move, and what is shown of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from shaper_fmu.cli import arguments as check
from shaper_fmu.cli.fastest import design_fastest
from shaper_fmu.cli.frequencies import band_words, frequency_words
from shaper_fmu.cli.profile import design_profile, modes_of, residual_blocks
from shaper_fmu.component import Variable
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
class Wanted:
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


def fastest(wanted: Wanted, tolerance: float, deflections: Sequence[float], pulses: int) -> FastestMove:
    """The fastest move. Raises BadParameter for options that do not go with it."""
    if wanted.duration is not None:
        raise typer.BadParameter("the fastest move takes the time that it needs", param_hint="--duration")
    if wanted.damping is not None:
        raise typer.BadParameter("the fastest move is for one damping ratio of each mode", param_hint="--damping-range")
    if (wanted.low is None) != (wanted.high is None):
        raise typer.BadParameter("give both ends of the band", param_hint="--low" if wanted.low is None else "--high")
    limits = {"max_velocity": wanted.max_velocity, "max_acceleration": wanted.max_acceleration, "max_jerk": wanted.max_jerk}
    band = wanted.low, wanted.high
    if not wanted.frequencies and None in band:
        raise typer.BadParameter(
            "give at least one, such as -w 5 [rad/s] or -f 0.8 [Hz], or --low and --high", param_hint="--natural-frequency"
        )
    return design_fastest(wanted.distance, limits, wanted.frequencies, wanted.ratios, tolerance, band, deflections, pulses)


def fastest_shown(wanted: Wanted, move: FastestMove) -> list[Block]:
    """The blocks of the fastest move."""
    from shaper_fmu.report.design import Mode
    from shaper_fmu.report.moves import fastest_blocks

    first = move.modes[0]
    return fastest_blocks(move, Mode(0.5 * (first.low + first.high), first.damping_ratio, wanted.tolerance))


def blocks_of(wanted: Wanted) -> list[Block]:
    """The blocks of a shaper, a profile or a pulse train. Raises BadParameter, and ComponentError for a kind that there is not."""
    from shaper_fmu.report.design import Mode, profile_blocks, pulse_blocks, shaper_blocks

    known = [*SHAPERS, *OFFLINE, *PROFILES, *PULSES]
    if wanted.kind not in known:
        raise ComponentError(f"there is no shaper, profile or pulse train {wanted.kind!r}.{nearest(wanted.kind, known)}")
    if wanted.kind == "si":
        if wanted.low is None or wanted.high is None:
            raise typer.BadParameter("si needs --low and --high", param_hint="KIND")
        wanted.frequencies.append(0.5 * (wanted.low + wanted.high))
    if not wanted.frequencies:
        raise typer.BadParameter("give at least one, such as -w 5 [rad/s] or -f 0.8 [Hz]", param_hint="--natural-frequency")
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
    sequence = sequence_of(wanted)
    return [*_proven(wanted, sequence), *shaper_blocks(wanted.kind, sequence, mode)]


def panel(wanted: Wanted, plot: Path) -> list[Block]:
    """The live page with this shaper, and its modes as the plant."""
    if wanted.kind not in SHAPERS or plot.suffix.lower() not in check.PAGE:
        return []
    from shaper_fmu.live.panel import live_panel

    ratios = wanted.ratios if len(wanted.ratios) > 1 else wanted.ratios * len(wanted.frequencies)
    modes = list(zip(wanted.frequencies, ratios, strict=False))
    given = [(w, w, w) for w, _ in modes], [(zeta, zeta, zeta) for _, zeta in modes]
    return live_panel(wanted.kind, modes, wanted.tolerance, *given)


def _proven(wanted: Wanted, command: ImpulseSequence | PulseSequence) -> list[Block]:
    """The bound of V over the wanted frequencies and damping ratios, if any are wanted."""
    from shaper_fmu.design.guarantees import guarantee

    if wanted.low is None or wanted.high is None:
        if wanted.damping is not None:
            raise typer.BadParameter("give --low and --high, too", param_hint="--damping-range")
        return []
    damping = wanted.damping or (wanted.ratios[0], wanted.ratios[0])
    found = guarantee(command, (wanted.low, wanted.high), damping)
    where = f"{band_words(wanted.low, wanted.high)}, damping ratio {damping[0]:g} to {damping[1]:g}"
    rows = [
        ["V is nowhere above", f"{100.0 * found.bound:.6f} %"],
        ["its largest value found", f"{100.0 * found.attained:.6f} %"],
        ["at", f"{frequency_words([found.at[0]])}, damping ratio {found.at[1]:g}"],
    ]
    return [Table(f"Proven: {where}", ["what", "value"], rows)]


def sequence_of(wanted: Wanted) -> ImpulseSequence:
    """The shaper. Raises ComponentError where there is none of this kind for these modes."""
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


def _pulses(wanted: Wanted) -> PulseSequence:
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
