"""The fields of a record that the profiles made of segments and for several modes read."""

from __future__ import annotations

from shaper_fmu.component import Component, Variable


class SegmentWorkspace(Component):
    """Base of components that make a move of segments; they declare these variables."""

    segments: Variable[int]
    segment_end: Variable[list[float]]
    segment_acceleration: Variable[list[float]]
    segment_jerk: Variable[list[float]]


class ModesWorkspace(Component):
    """Base of components that make a move for several modes; they declare these variables."""

    second_natural_frequency: Variable[float]
    second_damping_ratio: Variable[float]
    third_natural_frequency: Variable[float]
    third_damping_ratio: Variable[float]
    segment_time: Variable[float]
