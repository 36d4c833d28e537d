"""The kind `fastest` of `shaper-fmu design`: the fastest move without vibration, and its segments as a file for a machine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from shaper_fmu.archives import write_file
from shaper_fmu.cli.paths import wrote
from shaper_fmu.profiles.limits import NO_LIMIT

if TYPE_CHECKING:
    from shaper_fmu.design.fastest import FastestMove


def design_fastest(
    distance: float,
    limits: Mapping[str, float],
    frequencies: Sequence[float],
    ratios: Sequence[float],
    tolerance: float,
    band: tuple[float | None, float | None],
    deflection_limits: Sequence[float] = (),
    on_off_pulses: int = 0,
) -> FastestMove:
    """The move for the options; with --low and --high for a band instead of frequencies."""
    from shaper_fmu.design.fastest import fastest_move
    from shaper_fmu.design.lp.layout import Band

    if min(limits["max_acceleration"], limits["max_jerk"]) >= NO_LIMIT:
        raise typer.BadParameter("the fastest move needs it, or --max-jerk", param_hint="--max-acceleration")
    if len(ratios) not in (1, len(frequencies)):
        raise typer.BadParameter(f"{len(ratios)} for {len(frequencies)} natural frequencies", param_hint="--damping-ratio")
    damping = ratios if len(ratios) == len(frequencies) else [ratios[0]] * len(frequencies)
    modes = [Band(w, w, tolerance, zeta) for w, zeta in zip(frequencies, damping, strict=True)]
    low, high = band
    if low is not None and high is not None:
        modes.append(Band(low, high, tolerance, ratios[0]))
    if deflection_limits and low is not None:
        raise typer.BadParameter(
            "it needs single frequencies (-w), not a band from --low to --high", param_hint="--deflection-limit"
        )
    if len(deflection_limits) > 1 and len(deflection_limits) != len(frequencies):
        raise typer.BadParameter(
            f"{len(deflection_limits)} for {len(frequencies)} natural frequencies: give one, or one for each",
            param_hint="--deflection-limit",
        )
    if on_off_pulses and not deflection_limits:
        raise typer.BadParameter("this needs --deflection-limit", param_hint="--on-off-pulses")
    limit = deflection_limits if len(deflection_limits) > 1 else deflection_limits[0] if deflection_limits else math.inf
    return fastest_move(distance, **limits, modes=modes, deflection_limit=limit, on_off_pulses=on_off_pulses)


def write_segments(path: Path, move: FastestMove) -> None:
    """Write the segments as numbers: JSON with all about the move, or a table of the segments alone."""
    text = move.to_json() if path.suffix.lower() == ".json" else move.to_csv()
    write_file(path, text.encode())
    wrote(path)
