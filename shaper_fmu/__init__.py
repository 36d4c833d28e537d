"""Command shaping for flexible machines: components as FMUs, a master to couple and sweep them, SSP systems.

The public names are imported when first used, so that `import shaper_fmu` is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shaper_fmu.analysis.modal_response import ModalResponse, modal_response, step_response
    from shaper_fmu.analysis.mode_file import read_modes
    from shaper_fmu.analysis.vibration import damping_curve, insensitivity, relative_residual, sensitivity_curve, tolerated_band
    from shaper_fmu.component import Calculated, Component, Input, Local, Output, Parameter, State
    from shaper_fmu.errors import ShaperFmuError
    from shaper_fmu.export.build import build_fmu, fmu_path
    from shaper_fmu.master.batch import Batch, Plan
    from shaper_fmu.master.metrics import Effort, Envelope, Final, Overshoot, Peak, Residual, SettlingTime
    from shaper_fmu.master.results import Results
    from shaper_fmu.master.simulation import Simulation
    from shaper_fmu.master.system import System
    from shaper_fmu.profiles.design import Profile, profile
    from shaper_fmu.pulses.design import carrier_pulses, minimax_pulses, polished_pulses, unity_magnitude_pulses, zv_carrier_pulses
    from shaper_fmu.pulses.sequence import PulseSequence
    from shaper_fmu.registry import components, find_component
    from shaper_fmu.shapers.design import shaper
    from shaper_fmu.shapers.floor import distance_to_floor, shortest_duration
    from shaper_fmu.shapers.mode_selection import ModeSet, Selection, mode_sets, select_modes
    from shaper_fmu.shapers.sequence import ImpulseSequence
    from shaper_fmu.shapers.specified_insensitivity import Band, specified_insensitivity
    from shaper_fmu.shapers.two_mode import direct_two_mode
    from shaper_fmu.sweep.engine import run_study
    from shaper_fmu.sweep.store import Store
    from shaper_fmu.sweep.study import Study, read_study

__version__ = "0.1.0"

_HOMES = {
    "analysis.modal_response": ["ModalResponse", "modal_response", "step_response"],
    "analysis.mode_file": ["read_modes"],
    "analysis.vibration": ["damping_curve", "insensitivity", "relative_residual", "sensitivity_curve", "tolerated_band"],
    "component": ["Calculated", "Component", "Input", "Local", "Output", "Parameter", "State"],
    "errors": ["ShaperFmuError"],
    "export.build": ["build_fmu", "fmu_path"],
    "master.batch": ["Batch", "Plan"],
    "master.metrics": ["Effort", "Envelope", "Final", "Overshoot", "Peak", "Residual", "SettlingTime"],
    "master.results": ["Results"],
    "master.simulation": ["Simulation"],
    "master.system": ["System"],
    "profiles.design": ["Profile", "profile"],
    "pulses.design": ["carrier_pulses", "minimax_pulses", "polished_pulses", "unity_magnitude_pulses", "zv_carrier_pulses"],
    "pulses.sequence": ["PulseSequence"],
    "registry": ["components", "find_component"],
    "shapers.design": ["shaper"],
    "shapers.floor": ["distance_to_floor", "shortest_duration"],
    "shapers.mode_selection": ["ModeSet", "Selection", "mode_sets", "select_modes"],
    "shapers.sequence": ["ImpulseSequence"],
    "shapers.specified_insensitivity": ["Band", "specified_insensitivity"],
    "shapers.two_mode": ["direct_two_mode"],
    "sweep.engine": ["run_study"],
    "sweep.store": ["Store"],
    "sweep.study": ["Study", "read_study"],
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "Band",
    "Batch",
    "Calculated",
    "Component",
    "Effort",
    "Envelope",
    "Final",
    "ImpulseSequence",
    "Input",
    "Local",
    "ModalResponse",
    "ModeSet",
    "Output",
    "Overshoot",
    "Parameter",
    "Peak",
    "Plan",
    "Profile",
    "PulseSequence",
    "Residual",
    "Results",
    "Selection",
    "SettlingTime",
    "ShaperFmuError",
    "Simulation",
    "State",
    "Store",
    "Study",
    "System",
    "build_fmu",
    "carrier_pulses",
    "components",
    "damping_curve",
    "direct_two_mode",
    "distance_to_floor",
    "find_component",
    "fmu_path",
    "insensitivity",
    "minimax_pulses",
    "modal_response",
    "mode_sets",
    "polished_pulses",
    "profile",
    "read_modes",
    "read_study",
    "relative_residual",
    "run_study",
    "select_modes",
    "sensitivity_curve",
    "shaper",
    "shortest_duration",
    "specified_insensitivity",
    "step_response",
    "tolerated_band",
    "unity_magnitude_pulses",
    "zv_carrier_pulses",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'shaper_fmu' has no attribute {name!r}")
    return getattr(importlib.import_module(f"shaper_fmu.{_HOME[name]}"), name)
