"""The public names of shaper_fmu. `__all__` has those that most people need; all others live in the sub-packages, whose stub files
list them, and can be imported from the top, too."""

from shaper_fmu.analysis import *
from shaper_fmu.component import NO_EVENT, Component, time_tolerance
from shaper_fmu.design import *
from shaper_fmu.errors import ArgumentError, ShaperFmuError
from shaper_fmu.export import *
from shaper_fmu.info import *
from shaper_fmu.master import *
from shaper_fmu.metrics import *
from shaper_fmu.registry import components, find_component, load_components
from shaper_fmu.report import *
from shaper_fmu.ssp import *
from shaper_fmu.sweep import *
from shaper_fmu.tune import *
from shaper_fmu.variable import Calculated, Input, Local, Output, Parameter, State

__all__ = [
    "NO_EVENT",
    "ArgumentError",
    "Calculated",
    "Component",
    "Input",
    "Local",
    "Output",
    "Parameter",
    "Results",
    "ShaperFmuError",
    "State",
    "System",
    "build_fmu",
    "carrier_pulses",
    "check_ssp",
    "compare",
    "components",
    "find_component",
    "fmu_path",
    "load_components",
    "load_ssp",
    "minimax_pulses",
    "polished_pulses",
    "profile",
    "shaper",
    "sweep_system",
    "time_tolerance",
    "tune_plant",
    "unity_magnitude_pulses",
    "zv_carrier_pulses",
]
__version__: str
