"""Finds clipped values: a clipped signal arrives at its limit with slope, the peak of a swing or its quantised value does not.

A peak is a parabola: where it has fallen by c at the ends of a stretch around it, it has fallen by 4 c at twice the distance (by
less, as a cosine). A clipped swing is flat within the stretch, and falls steeply outside.
"""

from __future__ import annotations

import math

import numpy as np

from shaper_fmu.analysis.identification.record import FreeResponse, IdentificationError

_FEWEST_SAMPLES, _FEWEST_TOPS = 3, 2
_BAND = 6.0
"""Height of a stretch in standard deviations of the noise: so much values differ on a flat one."""
_SURE = 3.0
_STEEP = 5.0
"""Fall outside of a stretch, over that within it: 4 is a parabola's."""
_SAME = 1e-9


def check_clipping(response: FreeResponse) -> None:
    """Raise IdentificationError where an output is cut off at its largest or smallest values, more than once."""
    for name, column, floor in zip(response.names, response.values.T, response.floor, strict=True):
        for sign in (1.0, -1.0):
            tops = flat_tops(sign * column, math.sqrt(12.0) * float(floor))
            if len(tops) >= _FEWEST_TOPS:
                free = (tops[-1][1] - 1) * response.step
                level = float(np.median(np.concatenate([column[begin:end] for begin, end in tops])))
                raise IdentificationError(
                    f"{name} is clipped: it stays at {level:.6g} {len(tops)} times for {_FEWEST_SAMPLES} samples and more, and "
                    f"arrives there with slope, the last time {free:.4g} s after the first sample; excite less, widen the sensor's "
                    "range, or use the part behind"
                )


def flat_tops(values: np.ndarray, quantum: float) -> list[tuple[int, int]]:
    """First sample of each flat stretch at the largest values, and the one behind its last; those at the ends do not count."""
    spread = float(np.ptp(values))
    if spread == 0.0:
        return []
    noise = _noise(values)
    found = []
    for band, deviation in ((_SAME * spread, 0.0), (_BAND * noise + 2.0 * quantum, noise)):
        if band < 0.2 * spread:
            inside = values >= values.max() - band
            found.append([one for one in _runs(inside) if _is_flat(values, *one, quantum + _SAME * spread, deviation)])
    return max(found, key=len, default=[])


def _noise(values: np.ndarray) -> float:
    """Standard deviation of white noise, from third differences, which leave little of a well-sampled swing."""
    third = np.diff(values, 3)
    return float(np.median(np.abs(third)) / 0.6745 / math.sqrt(20.0)) if len(third) else 0.0


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Begin and end of the runs of true values that are long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= _FEWEST_SAMPLES]


def _is_flat(values: np.ndarray, begin: int, end: int, quantum: float, noise: float) -> bool:
    """Whether the values fall outside of a stretch by more than a parabola that fits it."""
    length = end - begin
    beside = max(1, length // 2)
    if begin - beside < 0 or end + beside > len(values):
        return False
    within, error = _bend(values[begin:end])
    middle = float(np.median(values[begin:end]))
    falls = (middle - float(values[begin - beside]), middle - float(values[end + beside - 1]))
    limit = _STEEP * (max(0.0, within) + _SURE * error * noise + quantum) + _SURE * noise
    return min(falls) > limit


def _bend(values: np.ndarray) -> tuple[float, float]:
    """How much a parabola that fits these values falls from its middle to the ends, and its standard deviation for noise of 1."""
    u = np.linspace(-1.0, 1.0, len(values))
    basis = np.column_stack([np.ones_like(u), u, u * u])
    inverse = np.linalg.inv(basis.T @ basis)
    return -float((inverse @ basis.T @ values)[2]), float(math.sqrt(inverse[2, 2]))
