"""MZV and MISZV: zero vibration by three, or by n, impulses that are equally spaced; closed forms for any damping.

MZV spaces three impulses by 3/8 of the damped period; MISZV spaces n impulses by 1/n of it, so that undamped ones are
equal. In both the amplitudes of the undamped shaper are scaled by the decay between the impulses and normalised.
"""

from __future__ import annotations

import math

from shaper_fmu.component import Parameter, Variable
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.workspace import DesignWorkspace


class _Workspace(DesignWorkspace):
    equal_impulses: Variable[int]


def modified_zv(m: DesignWorkspace, damping_ratio: float) -> int:
    """MZV for 1 rad/s into m.factor_amplitude, m.factor_delay; returns 3."""
    m.factor_amplitude[0] = 1.0 - math.sqrt(0.5)
    m.factor_amplitude[1] = math.sqrt(2.0) - 1.0
    m.factor_amplitude[2] = m.factor_amplitude[0]
    return _equally_spaced(m, 3, 0.375, damping_ratio)


def equal_impulses(m: _Workspace, damping_ratio: float) -> int:
    """MISZV with m.equal_impulses >= 2 impulses for 1 rad/s; returns their number."""
    for i in range(m.equal_impulses):
        m.factor_amplitude[i] = 1.0
    return _equally_spaced(m, m.equal_impulses, 1.0 / m.equal_impulses, damping_ratio)


def _equally_spaced(m: DesignWorkspace, count: int, spacing: float, damping_ratio: float) -> int:
    """Space by this share of the damped period, scale by the decay over it, and normalise to the sum 1."""
    period = 2.0 * math.pi / math.sqrt(1.0 - damping_ratio * damping_ratio)
    decay = math.exp(-damping_ratio * spacing * period)
    total = 0.0
    scale = 1.0
    for i in range(count):
        m.factor_delay[i] = i * spacing * period
        m.factor_amplitude[i] *= scale
        total += m.factor_amplitude[i]
        scale *= decay
    for i in range(count):
        m.factor_amplitude[i] /= total
    return count


MZV = ShaperMethod(name="mzv", number=6, title="MZV", impulses=modified_zv, summary="three impulses, 3/8 of a period apart")
MISZV = ShaperMethod(
    name="miszv",
    number=15,
    title="MISZV",
    impulses=equal_impulses,
    parameters={"equal_impulses": Parameter(3, "", "number of impulses of miszv", min=2, max=16)},
    summary="n equal impulses, 1/n of a period apart",
)
