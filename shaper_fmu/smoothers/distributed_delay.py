"""DZV and DZVD: one impulse at once, and the rest of the command distributed over a time.

u = A w + (1 - A)/T (integral of w over the last T), whose zero is the mode's pole: the shaper with an equally distributed delay of
Vyhlidal, Kucera and Hromcik 2013. With box_share below 1 the distributed part begins later, and A is larger. Without damping both
are closed forms; with a box over the whole duration A is then 0.
"""

from __future__ import annotations

import math

from shaper_fmu.component import Parameter
from shaper_fmu.smoothers.method import SmootherMethod
from shaper_fmu.smoothers.terms import put_box, put_impulse, square
from shaper_fmu.smoothers.workspace import SmootherWorkspace

_BISECTIONS = 100


def distributed_length(damping_ratio: float, box_share: float) -> float:
    """How long DZV takes for 1 rad/s.

    What the mode makes of the distributed part must be opposite to what it makes of the impulse. The undamped phase is known;
    damping weights what is later, so that less time is needed, and never less than half a period: bisected between.
    """
    damped = math.sqrt(1.0 - damping_ratio * damping_ratio)
    short = math.pi / damped
    long = math.pi / (1.0 - 0.5 * box_share) / damped
    if damping_ratio > 0.0:
        for _ in range(_BISECTIONS):
            middle = 0.5 * (short + long)
            _, ahead = _opposite(damping_ratio, damped, middle, box_share * middle)
            if ahead > 0.0:
                long = middle
            else:
                short = middle
    return long


def distributed_zv(m: SmootherWorkspace, damping_ratio: float) -> int:
    """DZV for 1 rad/s; returns the number of terms."""
    long = distributed_length(damping_ratio, m.box_share)
    width = m.box_share * long
    share, _ = _opposite(damping_ratio, math.sqrt(1.0 - damping_ratio * damping_ratio), long, width)
    if damping_ratio == 0.0 and m.box_share == 1.0:  # the mean over a period, but for rounding
        share = 0.0
    a = share / (share + math.exp(-damping_ratio * long))
    count = put_impulse(m, 0, a, 0.0) if a > 0.0 else 0
    return put_box(m, count, 1.0 - a, long - width, width)


def _opposite(damping_ratio: float, damped: float, length: float, width: float) -> tuple[float, float]:
    """The motion that a box of the area 1 leaves at its end, (exp(p w) - 1)/(p w), over the phase of the impulse's, exp(p L).

    Returns how far it is opposite, and how far it is ahead of that. p = -zeta + j wd, |p| = 1.
    """
    left = math.exp(-damping_ratio * width)
    real = (left * math.cos(damped * width) - 1.0) / width
    imaginary = left * math.sin(damped * width) / width
    box_real = imaginary * damped - real * damping_ratio
    box_imaginary = -real * damped - imaginary * damping_ratio
    cosine = math.cos(damped * length)
    sine = math.sin(damped * length)
    return -(box_real * cosine + box_imaginary * sine), box_imaginary * cosine - box_real * sine


def distributed_zvd(m: SmootherWorkspace, damping_ratio: float) -> int:
    """DZVD for 1 rad/s: DZV twice, which doubles the zero; returns the number of terms."""
    return square(m, distributed_zv(m, damping_ratio))


_PAPER = "Vyhlidal, Kucera and Hromcik 2013"
_BOX_SHARE = {
    "box_share": Parameter(
        1.0, "", "share of the duration over which dzv and dzvd distribute the delayed part", min=0.0, max=1.0, exclusive="min",
        published=(1e-3, 1.0),
    )
}  # fmt: skip
DZV = SmootherMethod(
    name="dzv",
    number=2,
    title="DZV",
    kernel=distributed_zv,
    parameters=_BOX_SHARE,
    summary="a part at once, the rest distributed equally over a time",
    paper=_PAPER,
)
DZVD = SmootherMethod(
    name="dzvd",
    number=3,
    title="DZVD",
    kernel=distributed_zvd,
    parameters=_BOX_SHARE,
    summary="DZV twice: with a zero derivative",
    paper=_PAPER,
)
