"""UM-ZV and UM-ZVD as on/off commands: the switches are the impulses of the unity-magnitude shapers."""

from __future__ import annotations

from shaper_fmu.pulses.method import PulseMethod
from shaper_fmu.pulses.workspace import PulseWorkspace
from shaper_fmu.shapers.unity_magnitude import unity_magnitude_zv, unity_magnitude_zvd


def _zv(m: PulseWorkspace, room: int) -> int:
    return _switches(m, unity_magnitude_zv(m, m.damping_ratio))


def _zvd(m: PulseWorkspace, room: int) -> int:
    return _switches(m, unity_magnitude_zvd(m, m.damping_ratio))


def _switches(m: PulseWorkspace, count: int) -> int:
    """The impulses' times [s] as switches."""
    for i in range(count):
        m.switch_time[i] = m.factor_delay[i] / m.natural_frequency
    if count > 0:
        m.travel_time = m.switch_time[count - 1]
    return count


_FAILURE = "no unity magnitude switch times were found for damping_ratio = {damping_ratio}"
_PAPER = "Singhose, Singer and Seering 1997"
UM_ZV = PulseMethod(
    name="um_zv",
    number=4,
    switches=_zv,
    failure=_FAILURE,
    timed=False,
    summary="the shortest switching without vibration",
    paper=_PAPER,
)
UM_ZVD = PulseMethod(
    name="um_zvd",
    number=5,
    switches=_zvd,
    failure=_FAILURE,
    timed=False,
    summary="a switching without vibration that is flat besides",
    paper=_PAPER,
)
