"""How the tests over all components run each of them: parameters off their start values, and inputs that change now and then."""

from __future__ import annotations

import math
import random
from functools import lru_cache
from typing import Any

import numpy as np

from shaper_fmu.component import Component, Variable
from shaper_fmu.errors import ComponentError
from shaper_fmu.registry import components

STEPS = 120
STEP = 0.0371
CHOSEN: dict[str, dict[str, Any]] = {
    "FeedbackInverse": {"natural_frequency": 7.0, "damping_ratio": 0.2, "sample_period": 0.0173},
    "HoistingShaper": {"shaper": 2, "damping_ratio": 0.04, "gravity": 40.0},
    "InputShaper": {"shaper": 3, "modes": 2, "natural_frequency[1]": 5.0, "natural_frequency[2]": 13.0, "damping_ratio[1]": 0.1},
    "LimitedShaper": {"shaper": 3, "modes": 2, "natural_frequency[1]": 5.0, "natural_frequency[2]": 13.0},
    "MotionProfile": {"profile": 6, "duration": 3.1, "start_time": 0.2, "damping_ratio": 0.08, "natural_frequency": 5.5045},
    "FlexibleBeam": {"modes": 2, "tip_mass": 0.012, "modal_damping[1]": 0.01, "modal_damping[2]": 0.02},
    "MassSpringDamper": {"mass": 0.7, "damping": 0.9},
    "OverheadCrane": {"initial_rope_length": 3.3, "damping_ratio": 0.02},
    "DoublePendulumCrane": {"initial_rope_length": 3.3, "sling_length": 1.2, "load_mass": 310.0, "damping_ratio": 0.02},
    "OperatorPanel": {
        "presses": 12,
        **{f"press_time[{i + 1}]": 0.31 * i + 0.1 for i in range(12)},
        **{f"press_speed[{i + 1}]": 0.7 - 0.1 * i for i in range(12)},
        "stop_time": 3.0,
        "release_time": 3.5,
    },
    "ShapedStop": {"damping_ratio": 0.03, "initial_angle": 0.1, "initial_speed": 0.4, "gravity": 40.0, "overshoot": 0.1},
    "RotatingBeam": {"modes": 2, "hub_radius": 0.08, "modal_damping[1]": 0.01, "modal_damping[2]": 0.02},
    "HydraulicPendulum": {"rod_length": 0.6, "leakage": 2e-12},
    "PulseTrain": {
        "design": 2,
        "amplitude": 0.7,
        "duration": 0.9,
        "start_time": 0.2,
        "natural_frequency": 4.0,
        "damping_ratio": 0.08,
    },
    "PulseWidthModulator": {"carrier_frequency": 3.0, "carrier_phase": 0.3, "minimum_pulse_width": 0.001},
    "PositionController": {"proportional_gain": 30.0, "integral_gain": 7.0, "derivative_gain": 4.0, "force_limit": 2.5},
    "SmoothShaper": {"smoother": 5, "modes": 2, "natural_frequency[1]": 5.0, "natural_frequency[2]": 13.0, "damping_ratio[1]": 0.1},
    "ThreeMassChain": {"mass[2]": 5.0, "damping[1]": 9.0, "stiffness[2]": 80.0},
}
"""Where a component has a case that shows more than others; no component needs one."""


def accepted(component: type[Component], values: dict[str, Any]) -> bool:
    """Whether the component starts with these values."""
    try:
        component(**values).initialize()
    except ComponentError:
        return False
    return True


def varied(component: type[Component], rng: random.Random) -> dict[str, Any]:
    """Its real parameters, each at 0.5 to 1.5 times its start value, as far as the component starts with it."""
    values: dict[str, Any] = {}
    for variable in component.variables.values():
        if variable.causality == "parameter" and variable.kind is float:
            moved = [start * rng.uniform(0.5, 1.5) if start else rng.uniform(0.0, 0.4) for start in variable.starts]
            tried = {**values, variable.name: moved if variable.size else moved[0]}
            values = tried if accepted(component, tried) else values
    return values


def off_the_start(component: type[Component]) -> dict[str, Any]:
    """Real parameters off their start values, by their FMI 2 names."""
    values = varied(component, random.Random(component.__name__)).items()
    labels = {name: component.variables[name].scalar_names for name, _ in values}
    return {label: x for name, found in values for label, x in zip(labels[name], np.atleast_1d(found).tolist(), strict=True)}


FOR_ITEM: dict[tuple[str, str], dict[str, Any]] = {
    ("MotionProfile", "fastest"): {  # one metre: 1 m/s2 for 1 s, and back
        "segments": 2, "segment_end[1]": 1.0, "segment_end[2]": 2.0, "segment_acceleration[1]": 1.0, "segment_acceleration[2]": -1.0,
    },
}  # fmt: skip
"""What an item of an enumeration needs besides, by the component's and the item's name."""
PARAMETERS = {name: CHOSEN.get(name) or off_the_start(component) for name, component in components().items()}
"""The parameters of each component, by their FMI 2 names."""


@lru_cache
def _inputs(name: str) -> list[tuple[str, Variable]]:
    inputs = [v for v in components()[name].variables.values() if v.causality == "input"]
    return [(label, variable) for variable in inputs for label in variable.scalar_names]


def stimulus(step: int, place: int) -> float:
    """A value that changes now and then, moderate enough for every component."""
    return 0.02 * ((7 * (step // 5) + 3 * place) % 11) - 0.1


def stimuli(name: str, step: int) -> dict[str, Any]:
    """The inputs of a component in a step, by their FMI 2 names: within 0.1 of the start value, or as far as their domain allows."""
    return {label: moved(variable, stimulus(step, place)) for place, (label, variable) in enumerate(_inputs(name))}


def moved(variable: Variable, change: float) -> Any:
    """The start value of an input that is real, changed by this."""
    return allowed(variable, variable.starts[0] + change if variable.kind is float else change)


def allowed(variable: Variable, value: float) -> Any:
    """The value, or the nearest one within the input's domain; an input that is not real keeps its start value."""
    if variable.kind is not float:
        return variable.starts[0]
    low = -math.inf if variable.min is None else math.nextafter(variable.min, math.inf)
    high = math.inf if variable.max is None else math.nextafter(variable.max, -math.inf)
    return min(max(value, low), high)
