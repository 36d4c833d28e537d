"""SNA-ZV: zero vibration with a specified negative amplitude, (a, -b, a) with a = (1 + b)/2.

Singhose, Singer and Seering 1997. Between ZV (b = 0) and UM-ZV (b = 1). Undamped t2 = acos(b / 2a) / w, t3 = 2 t2; with
damping the times solve the zero condition, which small b and large damping make impossible.
"""

from __future__ import annotations

import math

from shaper_fmu.component import Parameter, Variable
from shaper_fmu.shapers.conditions import rising, zero_at
from shaper_fmu.shapers.method import ShaperMethod
from shaper_fmu.shapers.newton import follow_damping
from shaper_fmu.shapers.workspace import DesignWorkspace
from shaper_fmu.variable import Array


class _Workspace(DesignWorkspace):
    negative_amplitude: Variable[float]


def specified_negative_amplitude(m: _Workspace, damping_ratio: float) -> int:
    """Write the sequence for 1 rad/s into m.factor_amplitude, m.factor_delay; returns 3, or 0 if there is none.

    Reads m.negative_amplitude, 0 < b <= 1.
    """
    b = m.negative_amplitude
    a = 0.5 * (1.0 + b)
    m.factor_amplitude[0] = a
    m.factor_amplitude[1] = -b
    m.factor_amplitude[2] = a
    m.unknown[0] = math.acos(0.5 * b / a)
    m.unknown[1] = 2.0 * m.unknown[0]
    if not follow_damping(m, _equations, 2, damping_ratio):
        return 0
    _unpack(m, m.unknown)
    return 3 if rising(m.factor_delay, 0, 2) else 0


def _unpack(m: DesignWorkspace, x: Array) -> None:
    m.factor_delay[0] = 0.0
    m.factor_delay[1] = x[0]
    m.factor_delay[2] = x[1]


def _equations(m: DesignWorkspace, x: Array, f: Array) -> None:
    _unpack(m, x)
    zero_at(f, 0, m.factor_amplitude, m.factor_delay, 3, m.damping, 1.0)


_AMPLITUDE = Parameter(0.5, "", "size of the negative impulse of sna_zv", min=0.0, max=1.0, exclusive="min", published=(1e-6, 1.0))
SNA_ZV = ShaperMethod(
    name="sna_zv",
    number=12,
    title="SNA-ZV",
    impulses=specified_negative_amplitude,
    solved=True,
    negative=True,
    parameters={"negative_amplitude": _AMPLITUDE},
    summary="(a, -b, a) with a specified negative amplitude b",
    paper="Singhose, Singer and Seering 1997",
)
