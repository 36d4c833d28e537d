"""Natural frequencies on the command line: -w in rad/s, or -f in Hz, and both in what is printed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from shaper_fmu.cli.arguments import hertz as in_hertz

Frequencies = Annotated[
    list[float] | None,
    typer.Option("--frequency", "-f", help="The same in Hz: -f 5 is -w 31.4; repeat it for several modes.", parser=in_hertz),
]
Frequency = Annotated[float | None, typer.Option("--frequency", "-f", help="The same in Hz: -f 5 is 31.4 rad/s.", parser=in_hertz)]


def natural_frequencies(rates: Sequence[float] | None, hertz: Sequence[float] | None) -> list[float]:
    """The frequencies [rad/s], of which one way alone may be used. Raises BadParameter."""
    if rates and hertz:
        raise typer.BadParameter("give the frequency in rad/s (-w) or in Hz (-f), not both", param_hint="--frequency")
    return [*(rates or []), *(2.0 * math.pi * one for one in hertz or [])]


def frequency_words(rates: Sequence[float]) -> str:
    """ "5 rad/s (0.796 Hz)", or of several modes "5, 14 rad/s (0.796, 2.23 Hz)"."""
    return f"{', '.join(f'{w:.6g}' for w in rates)} rad/s ({', '.join(f'{w / (2.0 * math.pi):.4g}' for w in rates)} Hz)"


def band_words(low: float, high: float) -> str:
    """ "4.5 to 5.5 rad/s (0.7162 to 0.8754 Hz)"."""
    return f"{low:g} to {high:g} rad/s ({low / (2.0 * math.pi):.4g} to {high / (2.0 * math.pi):.4g} Hz)"


def mode_words(rates: Sequence[float], ratios: Sequence[float] | None) -> str:
    """The frequencies, and the damping ratios with a word on what nobody has given."""
    given = f"damping ratio {', '.join(f'{z:g}' for z in ratios)}" if ratios else "damping ratio 0, since none is given (-z)"
    return f"{frequency_words(rates)}, {given}"
