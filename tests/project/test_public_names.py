"""The public names: where they live, that they stay, that examples and documentation use no others, and that they are typed."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import shaper_fmu
from shaper_fmu.component import Component, Input, Output, Parameter, State
from shaper_fmu.public_names import homes, packages, public

ROOT = Path(__file__).parents[2]
MODULES = ("shaper_fmu.errors", "shaper_fmu.reproduce", "shaper_fmu.propagation", "shaper_fmu.integration")  # see docs/python.md
INSIDE = ("shaper_fmu.cli.arguments", "shaper_fmu.console")  # for a command, which becomes a file of shaper_fmu itself
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")), *sorted((ROOT / "examples").glob("*.py"))]

# Names that could be imported from the top before sub-packages had lists of their own: never take one away.
TOP = [
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


@pytest.mark.parametrize("package", packages())
def test_the_names_of_a_package_are_those_that_its_stub_lists(package):
    module = importlib.import_module(package)
    assert module.__all__ == public(package)
    assert set(module.__all__) <= set(homes(package))
    for name, home in homes(package).items():
        assert getattr(module, name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'Sytem'"):
        _ = module.Sytem


@pytest.mark.parametrize("package", packages())
def test_no_public_name_is_that_of_a_module_beside_it(package):
    """Python sets an imported module as an attribute of its package: such a name would change with what was imported before."""
    folder = ROOT.joinpath(*package.split("."))
    modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or (path / "__init__.py").is_file()}
    assert "__init__" in modules
    assert not modules & set(homes(package))


def test_names_at_the_top_stay():
    assert set(TOP) <= set(homes("shaper_fmu"))


def test_a_name_of_two_packages_is_one_thing():
    found: dict[str, str] = {}
    for package in packages()[1:]:
        for name, home in homes(package).items():
            assert found.setdefault(name, home) == home


def test_importing_the_package_loads_nothing_heavy():
    code = "import shaper_fmu, sys; print(*[name for name in ('numpy', 'scipy', 'shaper_fmu.ssp.system') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def imports_that_are_not_public(text: str) -> list[str]:
    """What a page or an example imports from shaper_fmu that is in no list of public names."""
    found = []
    for match in re.finditer(
        r"^[ >.]*(?:import (shaper_fmu\.[\w.]+)|from (shaper_fmu[\w.]*) import (\([^)]*\)|.*))", text, re.MULTILINE
    ):
        alone, module, names = match.groups()
        if alone:
            found += [] if alone in (*packages(), *MODULES) else [alone]
            continue
        known = public(module) if module in packages() else [n for n in vars(importlib.import_module(module)) if n[0] != "_"]
        listed = [name.split(" as ")[0].strip() for name in names.split("#")[0].strip("()\n ").split(",") if name.strip()]
        found += [f"{module}: {name}" for name in listed if name not in known or module not in (*packages(), *MODULES, *INSIDE)]
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_examples_and_documentation_import_public_names_only(page):
    assert imports_that_are_not_public(page.read_text()) == []


def test_imports_of_private_names_are_seen():
    text = """
    >>> from shaper_fmu.page.figures import Figure
from shaper_fmu import System, Vary
from shaper_fmu.sweep import (
    Vary,
    Runner,
)
import shaper_fmu.master.loops
"""
    expected = ["shaper_fmu.page.figures: Figure", "shaper_fmu: Vary", "shaper_fmu.sweep: Runner", "shaper_fmu.master.loops"]
    assert imports_that_are_not_public(text) == expected


class Declared(Component):
    """One variable of each type."""

    force = Input("N", "a force")
    inputs = Input("N", "forces", size=3)
    number = Parameter(2, "", "a number")
    switch = Parameter(True, "", "a switch")
    share = Parameter(0.5, "", "a share")
    levels = Output("m", "levels", size=2)
    counts = State(0, size=2)


TYPES = {
    "force": "float",
    "inputs": "list[float]",
    "number": "int",
    "switch": "bool",
    "share": "float",
    "levels": "list[float]",
    "counts": "list[int]",
}


def checked(arguments: list[str], folder: Path) -> str:
    """What pyright prints, run as in a project that has shaper_fmu installed."""
    tool = shutil.which("pyright", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if tool is None:
        pytest.skip("pyright is not installed")
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    done = subprocess.run(
        [tool, *arguments], capture_output=True, text=True, cwd=folder, env={**os.environ, "PATH": path}, check=False
    )
    return done.stdout


@pytest.mark.thorough
def test_all_types_are_complete(tmp_path):
    """https://github.com/microsoft/pyright/blob/main/docs/typed-libraries.md"""
    said = checked(["--verifytypes", "shaper_fmu", "--ignoreexternal"], tmp_path)
    assert "Type completeness score: 100%" in said, said[-3000:]


@pytest.mark.thorough
def test_a_variable_has_the_type_of_its_value(tmp_path):
    source = Path(__file__).read_text()
    declared = source[source.index("class Declared") : source.index("TYPES =")]
    lines = ["from shaper_fmu import Component, Input, Output, Parameter, State", declared, "one = Declared()"]
    (tmp_path / "one.py").write_text("\n".join([*lines, *[f"reveal_type(one.{name})" for name in TYPES]]))
    found = re.findall(r'Type of "one\.(\w+)" is "(.*)"', checked(["one.py"], tmp_path))
    assert dict(found) == TYPES


def test_a_variable_holds_values_of_that_type():
    one = Declared()
    for name, said in TYPES.items():
        value = getattr(one, name)
        kind = type(value[0]).__name__ if isinstance(value, list) else type(value).__name__
        assert said == (f"list[{kind}]" if isinstance(value, list) else kind)


def test_the_top_is_what_most_people_need():
    assert len(shaper_fmu.__all__) <= 30
