"""The fields of a record that the profile made of segments reads."""

from __future__ import annotations

from shaper_fmu.component import Component, Variable


class SegmentWorkspace(Component):
    """Base of components that make a move of segments; they declare these variables."""

    segments: Variable[int]
    segment_end: Variable[list[float]]
    segment_acceleration: Variable[list[float]]
    segment_jerk: Variable[list[float]]
