"""The machines that settings can be written for."""

from __future__ import annotations

from enum import StrEnum


class Machine(StrEnum):
    """Names of machines, as after `--for`."""

    klipper = "klipper"
    kalico = "kalico"
    marlin = "marlin"
    marlin_ft = "marlin-ft"
    reprapfirmware = "reprapfirmware"
    prusa = "prusa"
    c = "c"
    st = "st"
    csv = "csv"


MACHINES = tuple(str(one) for one in Machine)
