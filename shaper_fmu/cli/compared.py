"""Several kinds in `shaper-fmu design zv zvd ei`: shapers for the same mode, compared."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import typer

from shaper_fmu.errors import nearest

if TYPE_CHECKING:
    from shaper_fmu.design.impulse_sequence import ImpulseSequence
    from shaper_fmu.page.blocks import Block


class _Mode(Protocol):
    """What is asked of all kinds."""

    @property
    def frequencies(self) -> list[float]: ...
    @property
    def ratios(self) -> list[float]: ...
    @property
    def tolerance(self) -> float: ...
    @property
    def low(self) -> float | None: ...
    @property
    def high(self) -> float | None: ...


def check_compared(kinds: Sequence[str], known: Sequence[str], alone: Mapping[str, object]) -> None:
    """Raise BadParameter for kinds that are no shapers, and for options that are for one kind."""
    for kind in kinds:
        if kind not in known:
            several = f" Numbers follow options: -w {kind} is a frequency, and of several modes each has its -w."
            hint = several if kind.replace(".", "", 1).isdigit() else nearest(kind, known)
            message = f"{kind!r} is no shaper; only shapers are compared with each other.{hint}"
            raise typer.BadParameter(message, param_hint="KIND")
    for option, given in alone.items():
        if given:
            raise typer.BadParameter("this is for one kind; give one", param_hint=option)


def compared_blocks(wanted: _Mode, kinds: Sequence[str], design: Callable[[str], ImpulseSequence]) -> list[Block]:
    """The blocks of several shapers, judged for the first mode."""
    from shaper_fmu.report.design import Mode
    from shaper_fmu.report.kinds import kinds_blocks

    if not wanted.frequencies:
        raise typer.BadParameter("give at least one, such as -w 5 [rad/s] or -f 0.8 [Hz]", param_hint="--natural-frequency")
    if "si" in kinds and (wanted.low is None or wanted.high is None):
        raise typer.BadParameter("si needs --low and --high", param_hint="KIND")
    if len(wanted.ratios) not in (1, len(wanted.frequencies)):
        message = f"{len(wanted.ratios)} damping ratios for {len(wanted.frequencies)} natural frequencies"
        raise typer.BadParameter(message, param_hint="--damping-ratio")
    return kinds_blocks({kind: design(kind) for kind in kinds}, Mode(wanted.frequencies[0], wanted.ratios[0], wanted.tolerance))
