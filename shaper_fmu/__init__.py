"""Command shaping for flexible machines: components as FMUs, a master to couple and sweep them, SSP systems.

The public names are imported when first used, so that `import shaper_fmu` is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from shaper_fmu.public_names import HOME, RENAMED
from shaper_fmu.renamed import warn_renamed
from shaper_fmu.version import __version__ as __version__

if TYPE_CHECKING:
    from shaper_fmu.analysis.vibration import damping_curve, insensitivity, relative_residual, sensitivity_curve, tolerated_band
    from shaper_fmu.component import NO_EVENT, Calculated, Component, Input, Local, Output, Parameter, State, time_tolerance
    from shaper_fmu.design.floor import distance_to_floor, shortest_duration
    from shaper_fmu.design.impulse_sequence import ImpulseSequence
    from shaper_fmu.design.modal_response import ModalResponse, modal_response, step_response
    from shaper_fmu.design.mode_file import read_modes
    from shaper_fmu.design.mode_selection import ModeSet, Selection, mode_sets, select_modes
    from shaper_fmu.design.profiles import Profile, profile
    from shaper_fmu.design.pulse_sequence import PulseSequence
    from shaper_fmu.design.pulses import carrier_pulses, minimax_pulses, polished_pulses, unity_magnitude_pulses, zv_carrier_pulses
    from shaper_fmu.design.shapers import shaper
    from shaper_fmu.design.specified_insensitivity import Band, specified_insensitivity
    from shaper_fmu.design.two_mode import direct_two_mode
    from shaper_fmu.errors import ArgumentError, ShaperFmuError
    from shaper_fmu.export.build import build_fmu, fmu_path
    from shaper_fmu.master.batch import Batch, Plan
    from shaper_fmu.master.results import Results
    from shaper_fmu.master.simulation import Simulation
    from shaper_fmu.metrics.effort import Effort
    from shaper_fmu.metrics.envelope import Envelope
    from shaper_fmu.metrics.final import Final
    from shaper_fmu.metrics.overshoot import Overshoot
    from shaper_fmu.metrics.peak import Peak
    from shaper_fmu.metrics.residual import Residual
    from shaper_fmu.metrics.settling_time import SettlingTime
    from shaper_fmu.registry import components, find_component
    from shaper_fmu.report.tune.outputs import write_tuning
    from shaper_fmu.ssp.system import System
    from shaper_fmu.sweep.engine import run_study
    from shaper_fmu.sweep.in_python import sweep_system
    from shaper_fmu.sweep.plan import Sampling
    from shaper_fmu.sweep.store import Store
    from shaper_fmu.sweep.study import Refine, Study, read_study
    from shaper_fmu.sweep.variation import Vary
    from shaper_fmu.tune.choice.boxes import ModeBox, mode_boxes
    from shaper_fmu.tune.choice.choice import choose
    from shaper_fmu.tune.choice.requirements import Move, Requirements
    from shaper_fmu.tune.choice.result import Choice
    from shaper_fmu.tune.identify.experiment import PlantIdentification, experiment
    from shaper_fmu.tune.identify.measured import MeasuredIdentification, identify_measured
    from shaper_fmu.tune.identify.range import PlantModes, identify_plant, operating_points
    from shaper_fmu.tune.tuning import Tuning, requirements_for
    from shaper_fmu.tune.tuning_measured import tune_measured
    from shaper_fmu.tune.tuning_plant import tune_plant
    from shaper_fmu.tune.verification.verify import Verification, verify

__all__ = [
    "NO_EVENT",
    "ArgumentError",
    "Band",
    "Batch",
    "Calculated",
    "Choice",
    "Component",
    "Effort",
    "Envelope",
    "Final",
    "ImpulseSequence",
    "Input",
    "Local",
    "MeasuredIdentification",
    "ModalResponse",
    "ModeBox",
    "ModeSet",
    "Move",
    "Output",
    "Overshoot",
    "Parameter",
    "Peak",
    "Plan",
    "PlantIdentification",
    "PlantModes",
    "Profile",
    "PulseSequence",
    "Refine",
    "Requirements",
    "Residual",
    "Results",
    "Sampling",
    "Selection",
    "SettlingTime",
    "ShaperFmuError",
    "Simulation",
    "State",
    "Store",
    "Study",
    "System",
    "Tuning",
    "Vary",
    "Verification",
    "build_fmu",
    "carrier_pulses",
    "choose",
    "components",
    "damping_curve",
    "direct_two_mode",
    "distance_to_floor",
    "experiment",
    "find_component",
    "fmu_path",
    "identify_measured",
    "identify_plant",
    "insensitivity",
    "minimax_pulses",
    "modal_response",
    "mode_boxes",
    "mode_sets",
    "operating_points",
    "polished_pulses",
    "profile",
    "read_modes",
    "read_study",
    "relative_residual",
    "requirements_for",
    "run_study",
    "select_modes",
    "sensitivity_curve",
    "shaper",
    "shortest_duration",
    "specified_insensitivity",
    "step_response",
    "sweep_system",
    "time_tolerance",
    "tolerated_band",
    "tune_measured",
    "tune_plant",
    "unity_magnitude_pulses",
    "verify",
    "write_tuning",
    "zv_carrier_pulses",
]


def __getattr__(name: str) -> Any:
    if name in RENAMED:
        warn_renamed(f"shaper_fmu.{name}", RENAMED[name])
        name = RENAMED[name]
    if name not in HOME:
        raise AttributeError(f"module 'shaper_fmu' has no attribute {name!r}")
    return getattr(importlib.import_module(HOME[name]), name)
