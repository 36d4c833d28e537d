"""How this thread's processor rounds, flushes denormal numbers and traps; see loop/arithmetic.h."""

from __future__ import annotations

from shaper_fmu.master.loop_library import loop


def arithmetic_mode() -> int:
    """The mode of this thread."""
    return loop().arithmetic_mode()


def set_arithmetic_mode(mode: int) -> None:
    """Set the mode of this thread."""
    loop().set_arithmetic_mode(mode)


def standard_arithmetic() -> int:
    """The mode that C begins with."""
    return loop().standard_arithmetic()
