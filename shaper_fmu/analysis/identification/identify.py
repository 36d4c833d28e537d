"""Identification of modes from free responses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from shaper_fmu.analysis.identification.basis import model
from shaper_fmu.analysis.identification.classify import FEWEST_PERIODS, Parts, parts_of, placed
from shaper_fmu.analysis.identification.clipping import check_clipping
from shaper_fmu.analysis.identification.findings import findings_of, too_coarse
from shaper_fmu.analysis.identification.order import find_model
from shaper_fmu.analysis.identification.projection import Fit, fit
from shaper_fmu.analysis.identification.record import Data, FreeResponse, IdentificationError, scaled
from shaper_fmu.analysis.identification.result import Identification

MOST_POLES = 24
SMALLEST_SHARE = 1e-4
RESOLUTION = 1e-7
_SURELY = 1.15
"""What noise may be more than its standard deviation by chance."""


def identify(
    responses: FreeResponse | Sequence[FreeResponse],
    *,
    smallest_share: float = SMALLEST_SHARE,
    resolution: float = RESOLUTION,
    most_poles: int = MOST_POLES,
) -> Identification:
    """The modes of one or several free responses (experiments with the same outputs and step, which share their poles).

    Args:
        responses: from `free_response`.
        smallest_share: modes with less of the amplitude than this, in each output, are not listed.
        resolution: what is below this share of an output's RMS is not looked at: the residual need not be smaller.
        most_poles: that are looked for, beside those at 0.

    Poles come from a subspace method, are polished to greatest likelihood for white noise, of each output its own, and are kept
    by the Bayesian information criterion. Raises IdentificationError where the data do not support an answer.
    """
    experiments = [responses] if isinstance(responses, FreeResponse) else list(responses)
    if not experiments:
        raise IdentificationError("there is no response to identify")
    for one in experiments:
        check_clipping(one)
    data = scaled(experiments, resolution)
    found = find_model(data, most_poles)
    parts = parts_of(found, data, smallest_share)
    _check_support(parts, found, data)
    residual = np.zeros((data.samples, *data.shape))
    for c, (experiment, output) in enumerate(data.column):
        residual[:, experiment, output] = found.residual[c] * data.scale[c]
    return Identification(
        parts.modes, parts.others, placed(found.noise * data.scale, data), found.model.order,
        tuple(findings_of(parts, found, data, smallest_share)),
        experiments[0].names, data.step, data.samples, placed(data.scale, data), residual,
    )  # fmt: skip


def unexplained(response: FreeResponse, found: Identification, noise: np.ndarray | None = None) -> float:
    """The part of this record that the poles found in another one do not explain: RMS of the residual over the response, 0 to 1.

    With `noise`, the standard deviation of white noise in each output, shape (m,), what exceeds that.
    """
    left = left_by(response, found).residual
    power = float(np.mean(left * left))
    if noise is not None:
        data = scaled([response], RESOLUTION)
        sizes = np.array([noise[column] for _, column in data.column]) / data.scale
        power -= float(np.mean((_SURELY * sizes) ** 2))
    return math.sqrt(max(0.0, power))


def left_by(response: FreeResponse, found: Identification) -> Fit:
    """The fit of the poles found in another record to this one, without any other."""
    data = scaled([response], RESOLUTION)
    poles = [part.pole for part in (*found.modes, *found.others)]
    pairs, reals = [p for p in poles if p.imag > 0.0], [p.real for p in poles if p.imag == 0.0 and p.real != 0.0]
    return fit(model(pairs, reals), data)


def _check_support(parts: Parts, found: Fit, data: Data) -> None:
    """Raise IdentificationError, with the reason, if the data support no answer."""
    if parts.modes:
        return
    kinds = {other.kind: other for other in parts.others}
    if "too_slow" in kinds and kinds["too_slow"].share > 0.5:
        slow = kinds["too_slow"]
        period = 2.0 * np.pi / slow.pole.imag
        raise IdentificationError(
            f"the record is too short: {data.duration:g} s are {data.duration / period:.2g} periods of a motion that seems to "
            f"swing with a period of {period:.3g} s; at least {FEWEST_PERIODS:g} are needed, better 5"
        )
    if "too_fast" in kinds:
        raise IdentificationError(too_coarse(kinds["too_fast"].pole, data))
    if not len(found.model.pairs) + len(found.model.reals) and (found.noise > 2.0 * data.floor).all():
        raise IdentificationError(
            "nothing but noise: no mode stands out from it; excite more, measure for longer, or look at other outputs"
        )
