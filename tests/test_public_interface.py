"""What others wire to: the FMUs' names, the Python names, the README's code."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import shaper_fmu
from shaper_fmu.registry import components

ROOT = Path(__file__).parents[1]

# The FMU interface that is public: never take a name away, never change a causality.
NAMES = {
    "InputShaper": {
        "input": "command",
        "output": "shaped shaped_mean next_event_time settled",
        "parameter": "shaper modes natural_frequency damping_ratio shape_mode vibration_tolerance custom_impulses custom_amplitude "
        "custom_delay",
        "calculatedParameter": "duration impulses insensitivity",
    },
    "MotionProfile": {
        "output": "position velocity acceleration moving next_event_time",
        "parameter": "profile distance duration start_time natural_frequency damping_ratio",
    },
    "MassSpringDamper": {
        "input": "force",
        "output": "position velocity acceleration",
        "parameter": "mass stiffness damping",
        "calculatedParameter": "natural_frequency damping_ratio",
    },
    "OverheadCrane": {
        "input": "trolley_acceleration hoist_speed",
        "output": "trolley_position rope_length swing_angle swing_rate load_position",
        "parameter": "initial_rope_length damping_ratio gravity",
        "calculatedParameter": "natural_frequency",
    },
}


@pytest.mark.parametrize("name", NAMES)
def test_the_public_names_are_there(name):
    variables = components()[name].variables
    for causality, names in NAMES[name].items():
        for variable in names.split():
            assert variables[variable].causality == causality


def test_enumeration_values_never_change():
    shapers = {item.name: item.value for item in components()["InputShaper"].variables["shaper"].kind}  # pyright: ignore
    profiles = {item.name: item.value for item in components()["MotionProfile"].variables["profile"].kind}  # pyright: ignore
    assert {"none": 1, "zv": 2, "zvd": 3, "zvdd": 4, "custom": 13}.items() <= shapers.items()
    assert {"step": 1, "cycloid": 3, "cycloid_versine_ramp": 5, "two_part": 6}.items() <= profiles.items()


def test_every_public_python_name_is_importable():
    assert sorted(shaper_fmu.__all__) == sorted(shaper_fmu._HOME)
    for name in shaper_fmu.__all__:
        assert getattr(shaper_fmu, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'Sytem'"):
        _ = shaper_fmu.Sytem  # pyright: ignore


def test_the_version_is_that_of_the_package():
    project = (ROOT / "pyproject.toml").read_text()
    assert f'version = "{shaper_fmu.__version__}"' in project


def test_the_readmes_python_runs(fmus, tmp_path):
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    assert len(blocks) == 2
    (tmp_path / "fmus").symlink_to(fmus)
    for block in blocks:
        done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, cwd=tmp_path, timeout=60)
        assert done.returncode == 0, done.stderr
