"""The modes of a nonlinear plant over the command: about its rest before, halfway and after."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from shaper_fmu.tune.identify.range import PlantModes, identify_plant
from shaper_fmu.tune.plant import Plant

_SHIFTED = 5e-3
"""Change of a natural frequency, relative, from which on the command's size matters."""
_PLACES = (0.5, 1.0)
"""Of the command, about which the plant is excited."""


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
