"""`shaper-fmu wrap`: a plant's FMU with shaped inputs, which takes its place."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from command_line import Done, typed
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from shaper_fmu.container.wrap import wrap
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import build_fmu
from shaper_fmu.registry import find_component, load_components

W = 10.0  # of a mass of 1 kg on a spring of 100 N/m
BOTH = pytest.mark.parametrize(("inner", "fmi"), [(2, 2), (2, 3), (3, 2), (3, 3)])
TUNED = ("--set", f"natural_frequency={W}")
FORCE = np.array(
    [(0.0, 1.0), (0.5, 1.0), (0.5, -2.0), (1.0, -2.0), (1.0, 3.0), (2.0, 0.5)], dtype=[("time", float), ("force", float)]
)
MANY = '''
"""A plant with variables of every kind, arrays and names that collide with the shaper's."""
from enum import IntEnum
from shaper_fmu.component import Calculated, Component, Input, Local, Output, Parameter

class Side(IntEnum):
    left = 1
    right = 5

class Many(Component):
    """Follows its inputs."""
    pull = Input("N", "force", size=2, start=0.5)
    side = Input("", "which", start=Side.left)
    on = Input("", "whether", start=True)
    count = Input("", "how many", start=3)
    gain = Parameter(2.0, "1/s", "gain", min=0.0, tunable=True)
    level = Parameter(1, "", "level", min=0, max=9)
    twice = Calculated("1/s", "twice the gain")
    sum = Output("N", "sum of the forces")
    shaper = Output("", "a name that the shaper's parameters would have")
    inside = Local("N", "one of them")

    def start(self):
        self.twice = 2.0 * self.gain

    def step(self, t, h):
        self.sum = self.gain * (self.pull[0] + 10.0 * self.pull[1]) + self.count
        self.shaper = 1.0 * self.level
        self.inside = self.pull[0]
'''


@pytest.fixture(scope="module")
def plants(tmp_path_factory) -> dict[tuple[str, int], Path]:
    """Spring and Many for both versions of FMI."""
    folder = tmp_path_factory.mktemp("plants")
    (folder / "many.py").write_text(MANY)
    parts = [*load_components(folder / "many.py"), find_component("MassSpringDamper")]
    return {
        (part.__name__, fmi): build_fmu(part, folder / str(fmi), fmi=fmi, platforms=["this"]) for part in parts for fmi in (2, 3)
    }


def told(description: ModelDescription) -> dict[str, tuple[Any, ...]]:
    """What is said of each variable but the time, in words that do not depend on the version of FMI."""
    types = {"Real": "Float64", "Integer": "Int32"}
    found = {}
    for v in description.modelVariables:
        starts = tuple(float({"true": 1, "false": 0}.get(text, text)) for text in str(v.start).split()) if v.start else ()
        bounds = tuple(float(text) if text is not None else None for text in (v.min, v.max, v.nominal))
        items = [(item.name, item.value) for item in v.declaredType.items] if v.declaredType is not None else []
        common = (v.causality, v.variability, v.initial, types.get(v.type, v.type), v.unit, v.displayUnit, v.description)
        found[str(v.name)] = (*common, starts, bounds, items, [dimension.start for dimension in v.dimensions])
    found.pop("time", None)
    return found


def same_variables(plant: Path, wrapped: Path) -> set[str]:
    """The variables that the wrapped plant has besides; all of the plant's are as they were, in their order."""
    old, new = (told(fmpy.read_model_description(path)) for path in (plant, wrapped))
    assert list(new)[: len(old)] == list(old)
    for name, said in old.items():
        assert new[name] == said, name
    return set(new) - set(old)


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_wrapped_plant_has_the_plants_variables_one_by_one(plants, tmp_path, fmi):
    plant = plants["Many", fmi]
    name = "pull[2]"
    done = typed("wrap", plant, "--input", name, "--set", "natural_frequency=4", "--output", "w.fmu", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert validate_fmu(str(tmp_path / "w.fmu")) == []
    more = same_variables(plant, tmp_path / "w.fmu")
    assert {"shaper_2.shaper", "shaper_2.modes"} <= more  # "shaper" is an output of the plant
    assert all(other.startswith("shaper_2.") for other in more)


@BOTH
def test_without_a_shaper_the_values_are_the_plants_own_to_the_bit(plants, tmp_path, inner, fmi):
    plant = plants["MassSpringDamper", inner]
    done = typed("wrap", plant, "--input", "force", "--shaper", "none", "--fmi", str(fmi), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    outputs = ["position", "velocity", "acceleration"]
    for step in (0.007, 0.05):
        old, new = (
            fmpy.simulate_fmu(
                str(path), stop_time=2.0, output_interval=step, input=FORCE, output=outputs, fmi_type="CoSimulation",
                start_values={"mass": 1.5},
            )
            for path in (plant, tmp_path / "MassSpringDamper_shaped.fmu")
        )  # fmt: skip
        assert np.ptp(old["position"]) > 0.01
        for name in outputs:
            assert np.array_equal(old[name], new[name]), name


@BOTH
def test_a_shaped_step_leaves_nothing_whatever_the_host_steps(plants, tmp_path, inner, fmi):
    """After a ZV-shaped step of 1 N the undamped mass rests at F/k = 0.01 m."""
    plant = plants["MassSpringDamper", inner]
    options = ["--input", "force", "--set", f"natural_frequency={W}", "--fmi", str(fmi), "--output", "w.fmu"]
    assert typed("wrap", plant, *options, cwd=tmp_path).returncode == 0
    found = fmpy.simulate_fmu(
        str(tmp_path / "w.fmu"), stop_time=1.0, output_interval=0.05, start_values={"force": 1.0, "damping": 0.0},
        output=["position", "velocity"],
    )  # fmt: skip
    after = found[found["time"] > np.pi / W + 0.05]
    assert np.max(np.abs(after["position"] - 0.01)) < 1e-12
    assert np.max(np.abs(after["velocity"])) < 1e-10 * 0.01 * W


def test_several_inputs_have_a_shaper_each(plants, tmp_path):
    options = ["--input", "pull[1]", "--input", "pull[2]", "--set", "natural_frequency=4,20", "--set", "damping_ratio=0,0.1"]
    done = typed("wrap", plants["Many", 2], *options, "--shaper", "zvd", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    described = {v.name: v.start for v in fmpy.read_model_description(tmp_path / "Many_shaped.fmu").modelVariables}
    assert {name.partition(".")[0] for name in described if "." in name} == {"shaper_2", "shaper_2_2"}
    for prefix in ("shaper_2", "shaper_2_2"):
        assert [described[f"{prefix}.natural_frequency[{i}]"] for i in (1, 2)] == ["4.0", "20.0"]
        assert (described[f"{prefix}.modes"], described[f"{prefix}.shaper"]) == ("2", "3")
        assert described[f"{prefix}.initial_command"] == "0.5"  # where the plant's input starts


def tuning(folder: Path, **changes: Any) -> Path:
    """A file as `tune` writes it, as far as it is read (see test_tune_command.py for one that it has written)."""
    values = {"shaper": "zvd", "modes": 1, "natural_frequency": [W], "damping_ratio": [0.05], "vibration_tolerance": 0.05}
    recommended = {"name": "ZVD on 10 rad/s", "profile": None, "start_values": values}
    found = {
        "schema": 1, "verdict": "tuned", "good": True, "words": "tuned: ZVD on 10 rad/s", "caveat": None, "source": "MassSpringDamper.fmu",
        "input": "force", "settings": {}, "choice": {"recommended": recommended}, **changes,
    }  # fmt: skip
    path = folder / "tuning.json"
    path.write_text(json.dumps(found))
    return path


def of_tuning(plants: Any, folder: Path, *options: str, **changes: Any) -> Done:
    return typed("wrap", plants["MassSpringDamper", 2], "--tuned", tuning(folder, **changes), *options, cwd=folder)


def test_a_tuning_gives_input_shaper_and_parameters(plants, tmp_path):
    done = of_tuning(plants, tmp_path)
    assert done.returncode == 0, done.stderr
    description = fmpy.read_model_description(tmp_path / "MassSpringDamper_shaped.fmu")
    assert description.description == "MassSpringDamper.fmu with force shaped by ZVD on 10 rad/s."
    starts = {v.name: v.start for v in description.modelVariables}
    assert (starts["shaper.shaper"], starts["shaper.natural_frequency[1]"], starts["shaper.damping_ratio[1]"]) == (
        "3",
        "10.0",
        "0.05",
    )


def test_a_tuning_that_is_not_proven_is_written_with_its_caveat_and_exits_with_1(plants, tmp_path):
    caveat = "NOT PROVEN: findings contradict the modes that this shaper is for"
    done = of_tuning(plants, tmp_path, good=False, verdict="not_proven", caveat=caveat, words="not proven: two modes")
    assert done.returncode == 1
    assert f"{caveat}: not proven: two modes" in done.stdout
    assert str(fmpy.read_model_description(tmp_path / "MassSpringDamper_shaped.fmu").description).startswith(caveat)


def test_it_is_told_what_the_tuning_was_made_for(plants, tmp_path):
    done = of_tuning(plants, tmp_path, source="crane.fmu", settings={"mass": 2.0, "stiffness": 100.0})
    assert "note: the tuning is of crane.fmu" in done.stderr
    assert "note: the tuning is for mass = 2, but MassSpringDamper.fmu starts with 1: set it where the FMU is used" in done.stderr
    assert "stiffness" not in done.stderr


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"choice": None, "words": "nothing vibrates"}, "recommends no shaper: nothing vibrates"),
        ({"schema": 2}, "its layout is 2; this version reads 1: tune again"),
        ({"choice": {}}, "is not a tuning.json that 'shaper-fmu tune' has written"),
        (
            {"choice": {"recommended": {"name": "a cycloid", "profile": {}, "start_values": {}}}},
            "which is a motion and not only a shaper",
        ),
    ],
)
def test_a_tuning_without_a_shaper_is_refused(plants, tmp_path, changes, problem):
    done = of_tuning(plants, tmp_path, **changes)
    assert done.returncode == 1
    assert problem in done.stderr
    assert not (tmp_path / "MassSpringDamper_shaped.fmu").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "name the input that is shaped. Known: force."),
        (["--input", "forc"], "Did you mean 'force'?"),  # before what else is lacking
        (["--input", "forc", *TUNED], "Did you mean 'force'?"),
        (["--input", "force"], "the shaper zv needs --set natural_frequency=... [rad/s], --frequency [Hz], or --tuned"),
        (["--input", "force", "--input", "force", *TUNED], "input force is named twice"),
        (["--input", "force", "--shaper", "zvx", *TUNED], "'zvx' is not a value of shaper"),
        (["--input", "force", "--set", "frequency=4", *TUNED], "has no input or parameter 'frequency'"),
        (["--input", "force", "--shaper", "zvx"], "'zvx' is not a value of shaper"),
        (["--input", "force", "--set", "frequency=4"], "has no input or parameter 'frequency'"),
        (["--input", "force", "--set", "natural_frequency=fast"], "natural_frequency: 'fast' is not a number"),
        (["--input", "force", "--set", "natural_frequency=0"], "natural_frequency: 0 is outside its domain"),
        (["--input", "force", "--set", "natural_frequency[1]=-1"], "natural_frequency[1]: -1 is outside its domain"),
        (["--input", "force", "--set", "natural_frequency=4,nan"], "natural_frequency: nan is outside its domain"),
        (["--input", "force", *TUNED, "--set", "damping_ratio=2"], "damping_ratio: 2 is outside its domain: 0 <= zeta < 1"),
        (["--input", "force", *TUNED, "--set", "initial_command=nan"], "initial_command: nan is outside its domain"),
        (["--input", "force", *TUNED, "--platform", "linux64"], "no platform 'linux64'. Did you mean 'x86_64-linux'?"),
    ],
)
def test_wrong_usage_exits_with_2(plants, tmp_path, options, words):
    done = typed("wrap", plants["MassSpringDamper", 2], *options, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert words in " ".join(done.stderr.replace("│", " ").split())
    assert not list(tmp_path.glob("*.fmu"))


def test_the_plant_itself_is_not_overwritten(plants, tmp_path):
    plant = tmp_path / "plant.fmu"
    plant.write_bytes(plants["MassSpringDamper", 2].read_bytes())
    done = typed("wrap", plant, "--input", "force", *TUNED, "--output", "./plant.fmu", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "is the plant itself" in done.stderr
    assert plant.read_bytes() == plants["MassSpringDamper", 2].read_bytes()


def test_a_plant_without_a_real_input_is_told(tmp_path):
    plant = build_fmu(find_component("PulseTrain"), tmp_path / "in", fmi=2, platforms=["this"])
    for options in ([], ["--input", "force"]):
        done = typed("wrap", plant, *options, cwd=tmp_path)
        assert done.returncode == 2, done.stderr
        words = "PulseTrain.fmu has no input of real numbers, so there is nothing to shape"
        assert words in " ".join(done.stderr.replace("│", " ").split())


def test_a_plant_that_cannot_be_in_a_container_is_refused(plants, tmp_path):
    from spring_fmus import spring_fmu

    with pytest.raises(ModelError, match=r"is of FMI 1\.0, which a container cannot run"):
        wrap(spring_fmu(), ["force"], tmp_path / "w.fmu", {"shaper": "none"})


def test_the_documents_lines_for_fmpy_run(plants, tmp_path, monkeypatch):
    """And their number is that of ZVD in the FMU."""
    wrap(plants["MassSpringDamper", 2], "force", tmp_path / "crane_shaped.fmu", {"shaper": "zv", "natural_frequency": [W]})
    page = (Path(__file__).parents[2] / "docs" / "one_fmu.md").read_text()
    code = page.partition("**fmpy**")[2].partition("```python")[2].partition("```")[0]
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(code, names)
    (shaper,) = [v for v in fmpy.read_model_description("crane_shaped.fmu").modelVariables if v.name == "shaper.shaper"]
    assert shaper.declaredType is not None
    named = {item.value: item.name for item in shaper.declaredType.items}
    assert named[str(names["start"]["shaper.shaper"])] == "zvd"
    assert names["result"]["time"][-1] == pytest.approx(20.0)
