"""Jung (2011): selects the modes of a chain of three masses that must be shaped, and the closed loop's modes.

The paper prints neither masses nor gains. Two sets of `machine.SETS` have the modes of its eq. (11): the defaults of the chain's
FMU, and one that was searched for. Where the conclusion holds, it does so with the labels of the two modes exchanged.
"""

from __future__ import annotations

from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Reproduction
from shaper_fmu.reproduce.partial_modes.blocks import blocks
from shaper_fmu.reproduce.partial_modes.claims import claims
from shaper_fmu.reproduce.partial_modes.study import study


def reproduce(update: Update) -> Reproduction:
    """Run the paper's studies; `update(done, total)` is called now and then."""
    found = study(update)
    return Reproduction(
        "partial-modes",
        "Shaping some modes only: a chain of three masses under control",
        "K. Jung: Reducing Effect of Residual Vibration Through Command Input Shaped Considering Partial Modes. Chungju National "
        "University, 2011 (in Korean)",
        claims(found),
        blocks(found),
    )
