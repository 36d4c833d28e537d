"""Taskin, Kilic and Kapucu (2019): a unity-magnitude pulse width modulated command, through the FMUs.

The claims' residual vibration is `relative`: the envelope over that of an unshaped step at the same time, in %. The paper
does not define its measure; with V, which also credits the decay during the move, its threshold of 12 would be 10.
"""

from __future__ import annotations

from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Reproduction
from shaper_fmu.reproduce.pwm.blocks import blocks
from shaper_fmu.reproduce.pwm.claims import claims
from shaper_fmu.reproduce.pwm.study import study


def reproduce(update: Update) -> Reproduction:
    """Run the paper's studies; `update(done, total)` is called now and then."""
    found = study(update)
    return Reproduction(
        "pwm",
        "Command shaping for systems driven by pulse width modulation",
        "C. Taskin, A. Kilic, S. Kapucu: Applicability of Command Shaping Techniques to the Pulse Width Modulation Driven "
        "Systems. UMTS 2019, 19th National Symposium on Machine Theory, Iskenderun (in Turkish)",
        claims(found),
        blocks(found),
    )
