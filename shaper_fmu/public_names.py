"""The modules that define the public names: `import shaper_fmu` loads a module when one of its names is first used."""

from __future__ import annotations

_HOMES = {
    "design.modal_response": ["ModalResponse", "modal_response", "step_response"],
    "design.mode_file": ["read_modes"],
    "analysis.vibration": ["damping_curve", "insensitivity", "relative_residual", "sensitivity_curve", "tolerated_band"],
    "component": ["NO_EVENT", "Calculated", "Component", "Input", "Local", "Output", "Parameter", "State", "time_tolerance"],
    "errors": ["ArgumentError", "ShaperFmuError"],
    "export.build": ["build_fmu", "fmu_path"],
    "master.batch": ["Batch", "Plan"],
    "metrics.effort": ["Effort"],
    "metrics.envelope": ["Envelope"],
    "metrics.final": ["Final"],
    "metrics.overshoot": ["Overshoot"],
    "metrics.peak": ["Peak"],
    "metrics.residual": ["Residual"],
    "metrics.settling_time": ["SettlingTime"],
    "master.results": ["Results"],
    "master.simulation": ["Simulation"],
    "ssp.system": ["System"],
    "design.profiles": ["Profile", "profile"],
    "design.pulses": ["carrier_pulses", "minimax_pulses", "polished_pulses", "unity_magnitude_pulses", "zv_carrier_pulses"],
    "design.pulse_sequence": ["PulseSequence"],
    "registry": ["components", "find_component"],
    "design.shapers": ["shaper"],
    "design.floor": ["distance_to_floor", "shortest_duration"],
    "design.mode_selection": ["ModeSet", "Selection", "mode_sets", "select_modes"],
    "design.impulse_sequence": ["ImpulseSequence"],
    "design.specified_insensitivity": ["Band", "specified_insensitivity"],
    "design.two_mode": ["direct_two_mode"],
    "sweep.engine": ["run_study"],
    "sweep.store": ["Store"],
    "sweep.in_python": ["sweep_system"],
    "sweep.plan": ["Sampling"],
    "sweep.study": ["Refine", "Study", "read_study"],
    "sweep.variation": ["Vary"],
    "tune.choice.boxes": ["ModeBox", "mode_boxes"],
    "tune.choice.choice": ["choose"],
    "tune.choice.result": ["Choice"],
    "tune.identify.experiment": ["PlantIdentification", "experiment"],
    "tune.identify.range": ["PlantModes", "identify_plant", "operating_points"],
    "tune.identify.measured": ["MeasuredIdentification", "identify_measured"],
    "report.tune.outputs": ["write_tuning"],
    "tune.tuning": ["Tuning", "requirements_for"],
    "tune.tuning_measured": ["tune_measured"],
    "tune.tuning_plant": ["tune_plant"],
    "tune.verification.verify": ["Verification", "verify"],
    "tune.choice.requirements": ["Move", "Requirements"],
}
HOME = {name: f"shaper_fmu.{module}" for module, names in _HOMES.items() for name in names}
"""Public name -> the module that defines it."""

RENAMED = {"Wish": "Requirements", "wish_for": "requirements_for"}
"""Old public name -> the new one. The old ones are importable, too, and warn."""
