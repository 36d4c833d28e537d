"""Values with a unit on the command line: `run --set`, of an FMU and of a system, and `build --start`.

Expected: 0.8 Hz are 2 pi 0.8 rad/s, 500 g are 0.5 kg, 90 deg are pi / 2 rad (SI brochure, 9th edition).
"""

from __future__ import annotations

import math

import pytest
from command_line import typed
from fmpy import read_model_description

from shaper_fmu import System, load_fmu
from shaper_fmu.errors import ComponentError
from shaper_fmu.quantities import Defined, in_unit


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("0.8Hz", "rad/s", 1.6 * math.pi), ("5 rad/s", "rad/s", 5.0), ("5rad/s", "Hz", 2.5 / math.pi), ("90deg", "rad", math.pi / 2.0),
        ("500g", "kg", 0.5), ("-2e1mm", "m", -0.02), ("2 min", "s", 120.0), ("3N/mm", "N/m", 3000.0), ("5%", "", 0.05), ("7 kg", "kg", 7.0),
        ("180deg/s", "rad/s", math.pi), ("4furlong", "furlong", 4.0),
    ],
)  # fmt: skip
def test_conversion(text, unit, expected):
    assert in_unit(text, unit, "x") == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("text", ["2", "1e5", "true", "zvd", "inf", "nan", "", "5,kg"])
def test_other_texts_are_unchanged(text):
    assert in_unit(text, "kg", "x") == text


@pytest.mark.parametrize(
    ("text", "unit", "said"),
    [
        ("2kgg", "kg", "'kgg' is not a known unit symbol. Did you mean 'kg'? It is in kg"),
        ("2s", "kg", "it is in kg, and s is a unit of another kind"),
        ("2Hz", "kg", "it is in kg, and Hz is a unit of another kind"),
        ("2kg", "", "it has no unit, so give the number alone"),
        ("2m", "furlong", "its unit furlong is not defined, so give the number alone, in furlong"),
        ("5%", "kg", "'%' is not a known unit symbol"),
    ],
)
def test_refusals(text, unit, said):
    with pytest.raises(ComponentError) as error:
        in_unit(text, unit, "mass")
    assert f"mass = {text}: " in str(error.value)
    assert said in str(error.value)


def test_what_a_file_says_of_its_unit_counts():
    """Modelica tools write rpm with a factor, and some leave the radian out, so that Hz must not be taken for 1/s."""
    turns = Defined({"rad": 1, "s": -1}, 2.0 * math.pi / 60.0)
    assert in_unit("1Hz", "rev/min", "speed", turns) == pytest.approx(60.0)
    assert in_unit("1Hz", "rad/s", "speed", Defined({"s": -1})) == pytest.approx(2.0 * math.pi)
    assert in_unit("300g", "g", "load", Defined({"m": 1, "s": -2}, 9.81)) == 300.0  # its own name for its own unit
    with pytest.raises(ComponentError, match="of another kind"):
        in_unit("3kg", "g", "load", Defined({"m": 1, "s": -2}, 9.81))
    assert in_unit("300K", "degC", "t", Defined({"K": 1}, 1.0, 273.15)) == pytest.approx(26.85)


def test_one_fmu(fmus, tmp_path):
    def end(*given: str) -> str:
        done = typed("run", str(fmus / "MassSpringDamper.fmu"), "--until", "1", "--input", "force=step:1", *given, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert end("--set", "mass=500g", "--set", "stiffness=2 N/mm") == end("--set", "mass=0.5", "--set", "stiffness=2000")
    assert end("--set", "mass=500g") != end()
    done = typed("run", str(fmus / "MassSpringDamper.fmu"), "--until", "1", "--set", "mass=2s", cwd=tmp_path)
    assert done.returncode == 2
    assert "mass = 2s: it is in kg, and s is a unit of another kind" in " ".join(done.stderr.split())


def test_python_and_a_system(fmus):
    system = System("crane")
    system.add("shaper", fmus / "InputShaper.fmu", {"natural_frequency[1]": "0.8Hz", "damping_ratio[1]": "5%"})
    assert system.start_values["shaper"]["natural_frequency[1]"] == pytest.approx(1.6 * math.pi)
    assert system.start_values["shaper"]["damping_ratio[1]"] == pytest.approx(0.05)
    assert load_fmu(fmus / "InputShaper.fmu").start_values({"natural_frequency": ["1Hz", 3.0]}) == {
        "natural_frequency[1]": pytest.approx(2.0 * math.pi), "natural_frequency[2]": 3.0
    }  # fmt: skip


def test_build_start(tmp_path):
    done = typed(
        "build", "InputShaper", "--platform", "this", "--start", "natural_frequency[1]=0.8Hz", "--start", "shaper=zvd", "--name", "Slow",
        "--output", ".", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    variables = {v.name: v for v in read_model_description(tmp_path / "Slow.fmu").modelVariables}
    assert float(str(variables["natural_frequency[1]"].start)) == pytest.approx(1.6 * math.pi)
    done = typed("build", "InputShaper", "--start", "natural_frequency[1]=0.8kg", "--name", "Wrong", "--output", ".", cwd=tmp_path)
    assert done.returncode == 2
    assert "kg is a unit of another kind" in " ".join(done.stderr.split())
    assert not (tmp_path / "Wrong.fmu").exists()
