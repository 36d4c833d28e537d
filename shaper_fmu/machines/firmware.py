"""What is known of a firmware that shapes commands itself: its shapers, its limits, and how its settings are written."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ArgumentError
from shaper_fmu.machines.definitions import Impulses


@dataclass(frozen=True)
class Setting:
    """A shaper of a firmware, as it is set.

    Attributes:
        shaper: its name in the firmware.
        frequency: undamped natural frequency [Hz], as written.
        damping_ratio: as written.
        sequence: the impulses that the firmware makes of it.
    """

    shaper: str
    frequency: float
    damping_ratio: float
    sequence: ImpulseSequence


def plain(value: float) -> str:
    """A number without an exponent: in G-code an E begins the next word."""
    return f"{Decimal(repr(value)):f}"


@dataclass(frozen=True)
class Firmware:
    """A firmware.

    Attributes:
        name: as in `--for`.
        title: as people call it.
        definition: the revision of the source that its impulses are taken from.
        shapers: its shapers, each with the impulses that it makes of a frequency [Hz] and a damping ratio.
        lines: the settings' text for an axis.
        how: what to do with the settings, a line each.
        frequencies: lowest and highest frequency that it takes [Hz].
        damping: least and largest damping ratio that it takes.
        most_damped: the largest damping ratio of shapers that take less.
        axes: the axes that can be set; () if it has one shaper for all.
        comment: what begins a comment.
        suffix: of the file.
    """

    name: str
    title: str
    definition: str
    shapers: Mapping[str, Impulses]
    lines: Callable[[str, Setting], str]
    how: tuple[str, ...]
    frequencies: tuple[float, float] = (1e-6, 1e6)
    damping: tuple[float, float] = (0.0, 0.99)
    most_damped: Mapping[str, float] = field(default_factory=dict)
    axes: tuple[str, ...] = ("x", "y")
    comment: str = ";"
    suffix: str = ".gcode"

    def setting(self, shaper: str, frequency: float, damping_ratio: float) -> Setting | None:
        """The setting with numbers as they are written; None if the firmware does not take them."""
        f, zeta = float(f"{frequency:.6g}"), self.damping_for(shaper, damping_ratio)
        if not self.frequencies[0] <= f <= self.frequencies[1]:
            return None
        try:
            return Setting(shaper, f, zeta, self.shapers[shaper](f, zeta))
        except ArgumentError:  # impulses that come too late or too early: a fit outside of its range
            return None

    def damping_for(self, shaper: str, damping_ratio: float) -> float:
        """The nearest damping ratio that the firmware takes, as it is written."""
        most = self.most_damped.get(shaper, self.damping[1])
        return float(f"{min(max(damping_ratio, self.damping[0]), most):.4g}")
