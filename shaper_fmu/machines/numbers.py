"""The impulses of a shaper as a table."""

from __future__ import annotations

from collections.abc import Sequence

from shaper_fmu.design.impulse_sequence import ImpulseSequence


def csv_text(sequence: ImpulseSequence, warnings: Sequence[str] = ()) -> str:
    """A line for each impulse: its delay [s], and its amplitude, whose sum is 1. Numbers are exact (shortest round trip).

    Warnings come first, as lines that begin with #."""
    rows = (f"{delay!r},{amplitude!r}\n" for delay, amplitude in zip(sequence.delays, sequence.amplitudes, strict=True))
    return "".join(f"# {line}\n" for line in warnings) + "delay [s],amplitude\n" + "".join(rows)
