"""The profiles of `shaper-fmu design`: the S-curve takes several modes, the others one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import typer

from shaper_fmu.profiles.limits import NO_LIMIT

if TYPE_CHECKING:
    from shaper_fmu.design.profiles import Profile
    from shaper_fmu.page.blocks import Block

_MODES = "s_curve_modes"


def design_profile(
    kind: str,
    distance: float,
    duration: float | None,
    modes: Sequence[tuple[float, float]],
    limits: Mapping[str, float],
    parameters: Mapping[str, float],
) -> Profile:
    """The profile for the options: with both limits and no duration, the S-curve for several modes is the shortest one."""
    from shaper_fmu.design.profiles import profile
    from shaper_fmu.design.s_curve import modes_as_parameters, shortest_s_curve

    if kind != _MODES:
        return profile(kind, distance, duration, *modes[0], **limits, **parameters)
    given = [name for name in (*modes_as_parameters([(1.0, 0.0)] * 3),) if parameters.get(name)]
    if len(modes) > 1 and given:
        raise typer.BadParameter("repeat --natural-frequency, or give this, not both", param_hint=f"--{given[0].replace('_', '-')}")
    if duration is None and max(limits.values()) < NO_LIMIT and not given and not parameters.get("segment_time"):
        return shortest_s_curve(distance, **limits, modes=modes)
    return profile(kind, distance, duration, *modes[0], **limits, **{**parameters, **modes_as_parameters(modes)})


def modes_of(frequencies: Sequence[float], ratios: Sequence[float]) -> list[tuple[float, float]]:
    """Pairs of natural frequency and damping ratio; one ratio is for all modes."""
    if len(ratios) not in (1, len(frequencies)):
        raise typer.BadParameter(f"{len(ratios)} for {len(frequencies)} natural frequencies", param_hint="--damping-ratio")
    return list(zip(frequencies, ratios if len(ratios) > 1 else [ratios[0]] * len(frequencies), strict=True))


def residual_blocks(law: Profile, modes: Sequence[tuple[float, float]]) -> list[Block]:
    """What several modes are left with."""
    from shaper_fmu.page.blocks import Table

    rows = [
        [f"{w:g}", f"{w / (2.0 * math.pi):.4g}", f"{zeta:g}", f"{100.0 * law.residual_vibration(w, zeta):.3g} %"]
        for w, zeta in modes
    ]
    return [Table("Modes", ["frequency [rad/s]", "[Hz]", "damping ratio", "V"], rows)] if len(modes) > 1 else []
