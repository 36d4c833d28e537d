"""The fields of a record that pulse designs read and write."""

from __future__ import annotations

from shaper_fmu.component import Variable
from shaper_fmu.shapers.workspace import DesignWorkspace


class PulseWorkspace(DesignWorkspace):
    """Base of components that design on/off commands; they declare these variables."""

    natural_frequency: Variable[float]
    damping_ratio: Variable[float]
    frequency_ratio: Variable[float]
    duration: Variable[float]
    switch_time: Variable[list[float]]
    original_time: Variable[list[float]]
    travel_time: Variable[float]
    frequency: Variable[float]
    minimum_pulse_width_limit: Variable[float]
