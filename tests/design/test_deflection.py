"""The transient deflection of on/off commands: scipy's matrix exponential, and designs that keep to a limit at all times."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from shaper_fmu.analysis.deflection import peak_deflection
from shaper_fmu.design.pulses import pulses
from shaper_fmu.errors import ArgumentError, NoSolutionError
from shaper_fmu.kinds.pulses import PULSES

W, ZETA = 2.0 * math.pi, 0.05


def sampled_peak(times: np.ndarray, levels: np.ndarray, w: float, zeta: float, points: int = 3000) -> float:
    """The largest |x| at many points between switches, and for four periods after the last one."""
    matrix = np.array([[0.0, 1.0], [-w * w, -2.0 * zeta * w]])
    peak, state = 0.0, np.zeros(2)
    for begin, end, level in zip(times, [*times[1:], times[-1] + 8.0 * math.pi / w], levels, strict=True):
        static, step = np.array([level, 0.0]), expm(matrix * (end - begin) / points)
        for _ in range(points):
            state = static + step @ (state - static)
            peak = max(peak, abs(float(state[0])))
    return peak


def test_the_peak_is_that_of_the_matrix_exponential():
    rng = np.random.default_rng(1)
    for _ in range(25):
        count = int(rng.integers(1, 8))
        times, levels = np.sort(rng.uniform(0.0, 3.0, count)), rng.choice([0.0, 1.0, -1.0, 0.5], count)
        w, zeta = float(rng.uniform(2.0, 9.0)), float(rng.choice([0.0, 0.02, 0.3, 0.7]))
        found = peak_deflection(times.tolist(), levels.tolist(), w, zeta)
        assert found == pytest.approx(sampled_peak(times, levels, w, zeta), abs=1e-5)
        assert found >= sampled_peak(times, levels, w, zeta) - 1e-12  # points miss the peak, never the other way


def test_a_step_and_known_commands():
    """A step: 1 + exp(-zeta pi/sqrt(1 - zeta^2)); without vibration the undamped deflection rises to 1 and no further."""
    assert peak_deflection([0.3], [1.0], W, ZETA) == pytest.approx(
        1.0 + math.exp(-ZETA * math.pi / math.sqrt(1.0 - ZETA**2)), rel=1e-14
    )
    for kind in ("um_zv", "um_zvd"):
        assert pulses(kind, W).peak_deflection(W) == pytest.approx(1.0, abs=1e-12)


_IMPOSSIBLE = {("carrier", 1.0), ("zv_carrier", 1.0)}


@pytest.mark.parametrize(("kind", "limit"), [(k, x) for k in PULSES for x in (1.0, 1.02) if (k, x) not in _IMPOSSIBLE])
def test_within_a_limit_at_all_times(kind, limit):
    """The command keeps it by the matrix exponential, and for timed designs the grid's shorter ones do not."""
    command = pulses(kind, W, ZETA, deflection_limit=limit)
    assert sampled_peak(np.array(command.switch_times), np.array(command.levels), W, ZETA, 400) <= limit + 1e-9
    if PULSES[kind].timed:
        shorter = command.duration - 4.0 / 800.0 / math.sqrt(1.0 - ZETA**2)  # one of 800 parts of four damped periods of 1 s
        with pytest.raises(NoSolutionError):
            pulses(kind, W, ZETA, duration=shorter, deflection_limit=limit)


def test_what_cannot_be_kept_is_refused():
    with pytest.raises(NoSolutionError, match=r"deflected by 1\.0"):
        pulses("carrier", W, ZETA, duration=0.4, deflection_limit=1.01)
    with pytest.raises(ArgumentError, match=r"deflection_limit = 0\.9"):
        pulses("um_zv", W, ZETA, deflection_limit=0.9)
    for kind, limit in sorted(_IMPOSSIBLE):
        with pytest.raises(NoSolutionError, match="deflect"):
            pulses(kind, W, ZETA, deflection_limit=limit)
    with pytest.raises(ArgumentError, match="needs a duration"):
        pulses("carrier", W, ZETA)
