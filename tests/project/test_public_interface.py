"""What others wire to: the FMUs' names, the Python names, the README's code."""

from __future__ import annotations

import re
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest

import shaper_fmu
from shaper_fmu.registry import components
from shaper_fmu.reproduce.claims import Claim
from shaper_fmu.ssp.findings import Finding

ROOT = Path(__file__).parents[2]

# The FMU interface that is public: never take a name away, never change a causality.
NAMES = {
    "InputShaper": {
        "input": "command",
        "output": "shaped shaped_mean next_event_time settled",
        "parameter": "shaper modes natural_frequency damping_ratio shape_mode vibration_tolerance negative_amplitude custom_impulses "
        "custom_amplitude custom_delay",
        "calculatedParameter": "duration impulses insensitivity",
    },
    "HoistingShaper": {
        "input": "command rope_length",
        "output": "shaped shaped_mean pending next_event_time settled",
        "parameter": "shaper damping_ratio damping_rope_length gravity remainder_tolerance initial_command",
    },
    "ShapedStop": {
        "input": "target_speed stop rope_length swing_angle swing_rate",
        "output": "speed acceleration acceleration_mean model_angle model_rate rest_time next_event_time settled",
        "parameter": "max_speed max_acceleration stop_deceleration criterion overshoot swing_source swing_tolerance damping_ratio "
        "gravity initial_speed initial_angle initial_rate",
    },
    "FeedbackInverse": {
        "input": "measurement",
        "output": "feedback next_event_time",
        "parameter": "natural_frequency damping_ratio sample_period inverse initial_measurement",
        "calculatedParameter": "samples duration direct_share sample_share last_share peak_gain",
    },
    "OperatorPanel": {
        "output": "speed stop next_event_time",
        "parameter": "presses press_time press_speed stop_time release_time",
    },
    "LimitedShaper": {
        "input": "command",
        "output": "position velocity acceleration next_event_time settled",
        "parameter": "command_is max_velocity max_acceleration max_jerk shaper modes natural_frequency damping_ratio shape_mode "
        "vibration_tolerance custom_impulses custom_amplitude custom_delay initial_position",
        "calculatedParameter": "duration impulses insensitivity smoothing",
    },
    "SmoothShaper": {
        "input": "command",
        "output": "shaped shaped_slope shaped_mean next_event_time settled",
        "parameter": "smoother modes natural_frequency damping_ratio box_share ramp_periods initial_command",
        "calculatedParameter": "duration mean_delay certificate",
    },
    "MotionProfile": {
        "output": "position velocity acceleration moving next_event_time",
        "parameter": "profile distance duration start_time natural_frequency damping_ratio max_velocity max_acceleration",
    },
    "PulseTrain": {
        "output": "pulse reference carrier next_event_time",
        "parameter": "design amplitude duration start_time natural_frequency damping_ratio frequency_ratio",
        "calculatedParameter": "pulses switches minimum_pulse_width residual_vibration",
    },
    "PulseWidthModulator": {
        "input": "reference",
        "output": "pulse next_event_time",
        "parameter": "carrier_frequency carrier_phase minimum_pulse_width",
    },
    "PositionController": {
        "input": "reference position velocity",
        "output": "force",
        "parameter": "proportional_gain integral_gain derivative_gain force_limit",
    },
    "MassSpringDamper": {
        "input": "force",
        "output": "position velocity acceleration",
        "parameter": "mass stiffness damping",
        "calculatedParameter": "natural_frequency damping_ratio",
    },
    "OverheadCrane": {
        "input": "trolley_acceleration hoist_speed",
        "output": "trolley_position rope_length swing_angle swing_rate load_position rope_tension",
        "parameter": "initial_rope_length damping_ratio gravity load_mass",
        "calculatedParameter": "natural_frequency",
    },
    "DoublePendulumCrane": {
        "input": "trolley_acceleration hoist_speed",
        "output": "trolley_position rope_length hook_angle load_angle hook_offset load_offset hook_position load_position "
        "mode_frequency rope_tension sling_tension",
        "parameter": "initial_rope_length sling_length hook_mass load_mass damping_ratio gravity",
        "calculatedParameter": "natural_frequency",
    },
    "RotatingBeam": {
        "input": "hub_acceleration",
        "output": "hub_angle tip_deflection tip_position tip_acceleration hub_torque",
        "parameter": "hub_radius length thickness width youngs_modulus beam_mass tip_mass modes modal_damping",
        "calculatedParameter": "natural_frequency participation",
    },
}


@pytest.mark.parametrize("name", NAMES)
def test_the_public_names_are_there(name):
    variables = components()[name].variables
    for causality, names in NAMES[name].items():
        for variable in names.split():
            assert variables[variable].causality == causality


@pytest.mark.parametrize(
    ("component", "variable", "items"),
    [
        (
            "InputShaper",
            "shaper",
            "none=1 zv=2 zvd=3 zvdd=4 zvddd=5 mzv=6 ei=7 two_hump_ei=8 three_hump_ei=9 um_zv=10 um_zvd=11 sna_zv=12 custom=13 "
            "um_ei=14 miszv=15",
        ),
        ("HoistingShaper", "shaper", "zv=1 zvd=2"),
        ("SmoothShaper", "smoother", "none=1 dzv=2 dzvd=3 ramped_zv=4 ramped_zvd=5 smoother=6"),
        ("LimitedShaper", "command_is", "position=1 speed=2"),
        ("ShapedStop", "criterion", "time=1 braking=2 travel=3"),
        ("ShapedStop", "swing_source", "model=1 measured=2"),
        (
            "MotionProfile",
            "profile",
            "step=1 trapezoid=2 cycloid=3 polynomial_345=4 cycloid_versine_ramp=5 two_part=6 s_curve=7 "
            "fastest=8 ramp=9 cycloid_ramp=10 versine_ramp=11 cycloid_cruise=12 constant_acceleration=13 "
            "trapezoidal_acceleration=14 exponential=15 s_curve_modes=16",
        ),
        ("PulseTrain", "design", "carrier=1 carrier_polished=2 minimax=3 um_zv=4 um_zvd=5 zv_carrier=6"),
    ],
)
def test_enumeration_values_never_change(component, variable, items):
    """Those that are there keep their numbers, which are in people's files; more may come."""
    kind: Any = components()[component].variables[variable].kind
    known = {name: int(number) for name, number in (item.split("=") for item in items.split())}
    assert {item.name: item.value for item in kind if item.name in known} == known
    assert not [item.name for item in kind if item.name not in known and item.value in known.values()]


OLD_NAMES = {"Wish": "Requirements", "wish_for": "requirements_for"}


@pytest.mark.parametrize("old", OLD_NAMES)
def test_old_names_are_importable_and_warn(old):
    with pytest.warns(DeprecationWarning, match=f"shaper_fmu.{old} is now {OLD_NAMES[old]}") as warned:
        assert getattr(shaper_fmu, old) is getattr(shaper_fmu, OLD_NAMES[old])
    assert warned[0].filename == __file__, "at the line that uses the old name"


def test_old_arguments_and_attributes_work_and_warn():
    boxes, requirements = [shaper_fmu.ModeBox.around(5.0)], shaper_fmu.Requirements(0.2, kinds=("zv",))
    old: Any = shaper_fmu.choose
    with pytest.warns(DeprecationWarning, match="argument wish is now requirements") as warned:
        choice = old(boxes, wish=requirements, floor=False)
    assert warned[0].filename == __file__, "at the line that uses the old name"
    assert choice.requirements is requirements
    with pytest.warns(DeprecationWarning, match=r"Choice\.wish is now requirements"):
        assert choice.wish is requirements
    with pytest.raises(TypeError, match="'requirements' and its old name 'wish'"):
        old(boxes, requirements=requirements, wish=requirements)


@pytest.mark.parametrize(
    ("owner", "new"), [(shaper_fmu.Tuning, "summary"), (Claim, "statement"), (Finding, "message")], ids=lambda one: str(one)
)
def test_words_are_readable_and_warn(owner: Any, new: str):
    one = object.__new__(owner)
    object.__setattr__(one, new, "some text")
    with pytest.warns(DeprecationWarning, match=f"{owner.__name__}.words is now {new}"):
        assert one.words == "some text"


def test_the_readmes_python_runs(fmus, tmp_path):
    text = (ROOT / "README.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 2
    (tmp_path / "fmus").symlink_to(fmus)
    for block in blocks:
        done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, cwd=tmp_path, timeout=900)
        assert done.returncode == 0, done.stderr
        assert textwrap.indent(done.stdout, "    ") in text, "what the README says that it prints"


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: shaper_fmu.shaper("zvd", -1.0),
        lambda: shaper_fmu.shaper("zvx", 5.0),
        lambda: shaper_fmu.profile("cycloid", distance=1.0, duration=-1.0),
        lambda: shaper_fmu.carrier_pulses(-1.0, 5.0, 0.1, 12.0),
        lambda: shaper_fmu.direct_two_mode((5.0, -1.0), (0.1, 0.1)),
        lambda: shaper_fmu.specified_insensitivity(-1.0, 5.0),
        lambda: shaper_fmu.choose([]),
        lambda: shaper_fmu.Requirements(tolerance=-1.0),
    ],
)
def test_wrong_arguments_are_value_errors(wrong):
    """As Python's users expect, and one of the family, too."""
    with pytest.raises(ValueError) as told:  # noqa: PT011 - every one has its own words, which its own test compares
        wrong()
    assert isinstance(told.value, shaper_fmu.ShaperFmuError)
