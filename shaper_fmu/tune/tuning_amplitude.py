"""A nonlinear plant over the command: its modes about the rest before, halfway and after, and whether it swings at all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shaper_fmu.analysis.identification import IdentificationError
from shaper_fmu.errors import SimulationError
from shaper_fmu.tune.identify.experiment import PlantIdentification, experiment
from shaper_fmu.tune.identify.range import PlantModes, identify_plant
from shaper_fmu.tune.identify.response import TOLERATED
from shaper_fmu.tune.meter import BudgetError
from shaper_fmu.tune.plant import Plant

_SHIFTED = 5e-3
"""Change of a natural frequency, relative, from which on the command's size matters."""
_PLACES = (0.5, 1.0)
"""Of the command, about which the plant is excited."""
_SMALLER = 1.0 - 1e-9
"""Of the command, from which on an experiment was as large as it."""


def modes_over_command(
    plant: Plant, points: Sequence[Mapping[str, Any]], size: float, options: Mapping[str, Any]
) -> PlantModes | None:
    """The modes at these operating points with the input at rest, halfway and at the end of a step of this `size`.

    A shaped command takes the plant to its new rest by parts, so that it swings with the frequencies of all places between. None
    if the end of the step does not change the frequencies at the first, the nominal point.
    """
    rest, name = plant.rest_value({}), plant.short(plant.input)
    ends = identify_plant(plant, points=[points[0], {**points[0], name: rest + size}], **options)
    ratios = [one.natural_frequency.high / one.natural_frequency.low for one in ends.ranges]
    if max((math.log(ratio) for ratio in ratios), default=0.0) < _SHIFTED and not ends.uncovered:
        return None
    moved = [{**point, name: rest + place * size} for place in _PLACES for point in points]
    return identify_plant(plant, points=[*points, *moved], **options)


def swings_at_size(
    plant: Plant, nominal: PlantIdentification, point: Mapping[str, Any], size: float, options: Mapping[str, Any]
) -> str:
    """Why a plant without a mode in the experiment at this point may vibrate all the same after a step of this `size`; "" if not.

    An experiment is made as small as the plant needs to be linear. In dry friction or backlash it then sticks, and shows no mode,
    while a command of the usual size takes it out of these, so that it swings.
    """
    small = abs(nominal.excitation.amplitude)
    if small >= _SMALLER * abs(size):
        return ""
    unit = f" {plant.input_unit}".rstrip()
    seen = f"the experiments that show none excite it by {small:.3g}{unit}, where it is linear; "
    try:
        found = experiment(plant, point=point, **{**options, "excitation": "step", "amplitude": size, "linear": False})
    except (IdentificationError, SimulationError, BudgetError) as error:
        return f"{seen}with a step as large as the commands, {size:.3g}{unit}, it was not to be seen whether it vibrates: {error}"
    if found.modes:
        ends = " and ".join(f"{mode.natural_frequency:.4g}" for mode in found.modes)
        return f"{seen}after a step as large as the commands, {size:.3g}{unit}, it swings at {ends} rad/s"
    if found.nonlinearity > TOLERATED:
        share = 100.0 * found.nonlinearity
        return f"{seen}after a step as large as the commands, {size:.3g}{unit}, {share:.2g} % of the response is not linear"
    return ""
