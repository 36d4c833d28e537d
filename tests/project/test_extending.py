"""docs/extending.md and extending_more.md: their files, found by entry point in a folder outside of the package, in all that follows from a method."""

from __future__ import annotations

import json
import math
import re
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from outside_packages import COMMAND, announced, python
from sweep_cases import runs_of

from shaper_fmu.design.method_tables import with_tables
from shaper_fmu.errors import StudyError

PAGE = "".join((Path(__file__).parents[2] / "docs" / name).read_text() for name in ("extending.md", "extending_more.md"))
W, ZETA, LATE = 5.0, 0.05, 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The page's files, and the entry points that it tells."""
    place = tmp_path_factory.mktemp("theirs")
    blocks = re.findall(r"```(\w+)\n(.*?)```", PAGE, re.DOTALL)
    points = tomllib.loads(next(text for kind, text in blocks if kind == "toml"))["project"]["entry-points"]
    announced(place, points)
    files = [text for kind, text in blocks if kind == "python"]
    modules = [module for group in points.values() for module in group.values()]
    assert len(files) == len(modules) + 2
    for module, text in zip([*modules, "distributions", "period"], files, strict=True):
        (place / f"{module}.py").write_text(text)
    return place


_WORK = f"""
import json, math, sys
from pathlib import Path

from shaper_fmu import (
    ModeBox, Residual, Simulation, Store, Study, System, Requirements, build_fmu, choose, find_component, profile, read_study, run_study,
    shaper,
)
from shaper_fmu.sweep.variation import Vary
from shaper_fmu.design.pulses import pulses
from shaper_fmu.sweep.engines import Serial

found = {{}}
for backend in ("native", "python"):
    for name in ("InputShaper", "MotionProfile", "PulseTrain", "PiezoStage"):
        build_fmu(find_component(name), backend, backend=backend, platforms=["this"] if backend == "native" else ())
    system = System("shaped")
    values = {{"shaper": "late_zv", "natural_frequency": [{W}], "damping_ratio": [{ZETA}], "late_periods": {LATE}}}
    system.add("shaper", f"{{backend}}/InputShaper.fmu", values)
    system.drive("shaper.command", 1.0)
    shaped = system.simulate(4.0, 0.5, record=["shaper.shaped", "shaper.duration"])
    system = System("moved")
    system.add("profile", f"{{backend}}/MotionProfile.fmu", profile="smooth_polynomial", duration=2.0)
    moved = system.simulate(2.0, 0.5)
    system = System("flat")
    system.add("profile", f"{{backend}}/MotionProfile.fmu", profile="smooth_polynomial", duration=2.0, flat_derivatives=2)
    flat = system.simulate(2.0, 0.5)
    system = System("staged")
    system.add("stage", f"{{backend}}/PiezoStage.fmu")
    system.drive("stage.base", 1.0)
    staged = system.simulate(0.1, 0.02)
    system = System("switched")
    system.add("train", f"{{backend}}/PulseTrain.fmu", design="quick_pulse", natural_frequency={W})
    switched = system.simulate(1.0, 0.5, record=["train.residual_vibration", "train.travel_time"])
    found[backend] = {{
        "shaped": [float(shaped["shaper.shaped"][0]), float(shaped["shaper.duration"][-1])],
        "position": moved["profile.position"].tolist(),
        "flat": flat["profile.position"].tolist(),
        "stage": staged["stage.position"].tolist(),
        "residual": float(switched["train.residual_vibration"][-1]),
        "travel_time": float(switched["train.travel_time"][-1]),
    }}

one = shaper("late_zv", {W}, {ZETA}, late_periods={LATE})
law, cubic = profile("smooth_polynomial", 1.0, max_velocity=0.7), profile("smooth_polynomial", 1.0, 2.0, flat_derivatives=2)
on_off = pulses("quick_pulse", {W})
found["python"]["objects"] = [one.residual_vibration({W}, {ZETA}), law.duration, on_off.residual_vibration({W})]
found["python"]["cubic"] = [cubic.position(0.6).tolist(), cubic.peak_acceleration, cubic.residual_vibration({W})]
ours = profile("polynomial_345", 1.0, 2.0)
found["python"]["ours"] = [ours.position(0.6).tolist(), ours.peak_acceleration, ours.residual_vibration({W})]

system = System("studied")
system.add("shaper", "native/InputShaper.fmu", shaper="late_zv", command={W * W}, natural_frequency=[{W}], damping_ratio=[{ZETA}])
plant = build_fmu(find_component("MassSpringDamper"), "native", platforms=["this"])
system.add("plant", plant, mass=1.0, stiffness={W * W}, damping={2 * ZETA * W})
system.connect("shaper.shaped", "plant.force")
system.to_ssp("studied.ssp", stop_time=8.0, step=0.01)
Path("study.toml").write_text('''
name = "late"
system = "studied.ssp"
stop_time = 8.0
step = 0.01

[vary."shaper.late_periods"]
values = [0, 1, 2]

[metrics.duration]
kind = "final"
output = "shaper.duration"

[metrics.share]
kind = "residual_share"
output = "plant.position"
command = "shaper.shaped"
static_deflection = 1.0
''')
found["sweep"] = run_study(read_study(Path("study.toml")), Path("late.sqlite"), engine=Serial())
with Store("late.sqlite") as store:
    found["late"] = [run.metrics for run in store.iterate()]

from residual_share import ResidualShare
from shaper_fmu.report.sweep.data import read_sweep
from shaper_fmu.sweep.engine import engine_for, load_stored_system

metrics = {{
    "share": ResidualShare("plant.position", "shaper.shaped", static_deflection=2.0),
    "residual": Residual("plant.position", "shaper.shaped"),
}}
with Simulation(system, record=[], metrics=metrics) as simulation:
    found["single"] = simulation.run(4.0, 0.01, start_values={{"shaper.shaper": "none"}}).metrics
study = Study(
    name="shares", system="studied.ssp", stop_time=4.0, step=0.01, metrics=metrics,
    vary={{"plant.damping": Vary(values=[0.0, {2 * ZETA * W}])}}, compare={{"unshaped": {{"shaper.shaper": "none"}}}},
)
run_study(study, Path("shares.sqlite"), engine=engine_for(2))
with Store("shares.sqlite") as store:
    found["resumed"] = store.study().metrics == metrics
    found["shares"] = [run.metrics for run in store.iterate()]
    found["shown"] = read_sweep(store, load_stored_system(store)).quantities["share"].shown(0.25)

from distributions import write_page

found["pages"] = [path.name for path in write_page(Path("shares.sqlite"), Path("shares.html"))]
found["section"] = "Distribution of share" in Path("shares.html").read_text()

choice = choose([ModeBox.around({W}, {ZETA})], Requirements(tolerance=0.2, kinds=("late_zv",)), floor=False)
found["tune"] = [choice.recommended.name, choice.recommended.start_values()]
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def found(folder) -> dict[str, Any]:
    """What the FMUs, Python's objects, a sweep and `tune` make of the methods, in one process: kernels are compiled once."""
    done = python(folder, _WORK)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("backend", ["native", "python"])
def test_the_methods_are_in_fmus_of_both_backends(found, backend):
    """The formulas of the page, by hand: K of the late impulse; the polynomial; V = 0 undamped."""
    delay = (2 * LATE + 1) * math.pi / math.sqrt(1 - ZETA**2)
    assert found[backend]["shaped"] == pytest.approx([1 / (1 + math.exp(-ZETA * delay)), delay / W], rel=1e-12)
    u = [0.0, 0.25, 0.5, 0.75, 1.0]
    assert found[backend]["position"] == pytest.approx([35 * x**4 - 84 * x**5 + 70 * x**6 - 20 * x**7 for x in u], abs=1e-12)
    assert found[backend]["flat"] == pytest.approx([10 * x**3 - 15 * x**4 + 6 * x**5 for x in u], abs=1e-12)
    assert found[backend]["residual"] == pytest.approx(0.0, abs=1e-15)
    assert found[backend]["travel_time"] == pytest.approx(2 * math.pi / 3 / W, rel=1e-12)


@pytest.mark.parametrize("backend", ["native", "python"])
def test_the_plant_is_exact_in_fmus_of_both_backends(found, backend):
    """Step response of an underdamped oscillator: 1 - exp(-zeta w t) (cos wd t + zeta w/wd sin wd t)."""
    w, zeta = 115.0, 0.02
    wd = w * math.sqrt(1 - zeta**2)
    times = [0.02 * i for i in range(6)]
    expected = [1 - math.exp(-zeta * w * t) * (math.cos(wd * t) + zeta * w / wd * math.sin(wd * t)) for t in times]
    assert found[backend]["stage"] == pytest.approx(expected, abs=1e-12)


def test_python_makes_objects_of_them(found):
    """With two flat derivatives the polynomials are our 3-4-5 one, but for rounding."""
    assert found["python"]["objects"] == pytest.approx([0.0, 35 / 16 / 0.7, 0.0], abs=1e-12)
    assert found["python"]["cubic"] == pytest.approx(found["python"]["ours"], rel=1e-12)


def test_a_report_has_the_figure(found):
    assert found["section"]
    assert "shares_distribution_share.png" in found["pages"]


def test_a_sweep_varies_the_shapers_own_parameter(found):
    assert found["sweep"] == {"done": 3}
    durations = [run["duration"] for run in found["late"]]
    assert durations == pytest.approx([(n + 0.5) * 2 * math.pi / (W * math.sqrt(1 - ZETA**2)) for n in range(3)], rel=1e-12)


def test_a_metric_is_in_simulations_and_studies_beside_the_public_ones(found):
    """Half the way from 0 to the first peak 1 + exp(-pi zeta / sqrt(1 - zeta^2)) of a step response, of a deflection of 2.

    The peak is missed by (w h)^2 / 8 of the swing at most.
    """
    expected = [(1.0 + math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))) / 4.0 for zeta in (0.0, ZETA)]
    shares = [run["share"] for run in found["shares"]]
    assert shares == pytest.approx(expected, abs=2e-4)
    assert [run["residual"] / 2.0 for run in found["shares"]] == shares
    assert found["single"] == found["shares"][1]
    assert found["resumed"]
    assert found["shown"] == "25 %"


def test_a_study_file_names_it_as_ours(found):
    """Late by whole periods, ZV leaves nothing but what edges between communication points do: w h / 2 each at most."""
    assert all(run["share"] < 0.5 * W * 0.01 for run in found["late"])


def test_a_store_with_a_metric_that_is_not_installed_says_so(found, folder):
    with pytest.raises(StudyError, match="metrics of the kind residual_share are not known here; install the package"):
        runs_of(folder / "shares.sqlite")


def test_tune_chooses_among_them(found):
    name, values = found["tune"]
    assert name.startswith("late ZV on 5")
    assert values["shaper"] == "late_zv"


@pytest.mark.thorough
def test_the_command_tune_verifies_one_on_a_plant_of_theirs(found, folder):
    """Both from entry points: identified, chosen, simulated and written; late by (2 n + 1) pi / wd, here with n = 1."""
    words = ["tune", "native/PiezoStage.fmu", "--input", "base", "--output", "position", "--kind", "late_zv", "--margin", "1%"]
    done = python(folder, COMMAND, *words, "--tolerance", "25%", "--no-report", "--output-folder", "tuned")
    assert done.returncode == 0, done.stdout + done.stderr
    tuned = json.loads(next((folder / "tuned").glob("*.json")).read_text())
    assert tuned["verdict"] == "tuned", done.stdout
    assert f"{1.5 * 2 * math.pi / (115.0 * math.sqrt(1 - 0.02**2)):.4g} s later than unshaped" in done.stdout
    assert '<ssv:Enumeration value="late_zv"/>' in (folder / "tuned" / "shaper.ssv").read_text()
    assert zipfile.is_zipfile(next((folder / "tuned").glob("*.ssp")))


def test_the_command_period(folder):
    """T = 2 pi / (w sqrt(1 - zeta^2)); a wrong argument is told before the work."""
    code = "import sys, typer; sys.path.insert(0, '.'); from period import period; typer.run(period)"
    assert float(python(folder, code, "5", "-z", "0.6").stdout.split()[0]) == pytest.approx(2 * math.pi / 4.0, rel=1e-8)
    wrong = python(folder, code, "0")
    assert wrong.returncode == 2
    assert "0 is outside its domain" in wrong.stderr


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["late_zv", "-w", "5", "-z", "0.05", "--late-periods", "2"], f"{5 * math.pi / math.sqrt(1 - ZETA**2) / W:.6f}"),
        (["smooth_polynomial", "-w", "5", "--duration", "2"], "1.09375"),
        (["smooth_polynomial", "-w", "5", "--duration", "2", "--flat-derivatives", "2"], "0.9375"),
        (["smooth_polynomial", "-w", "5", "--duration", "2", "--flat-derivatives", "1"], "1 is outside its domain: 2 to 9"),
        (["quick_pulse", "-w", "5"], f"{2 * math.pi / 15:.8f}"),
        (["late_zv", "-w", "5", "--late-periods", "10"], "10 is outside its domain: 0 to 9"),
        (["--help"], "Whole periods by which the second impulse of late_zv is late"),
    ],
)
def test_the_command_line_knows_them(folder, words, expected):
    done = python(folder, COMMAND, "design", *words)
    assert expected in " ".join((done.stdout + done.stderr).split()), done.stdout + done.stderr


@pytest.mark.parametrize("name", ["shapers.md", "smooth_shapers.md", "commands.md", "pulse_trains.md", "sweeps.md", "python.md"])
def test_the_tables_of_the_docs_are_those_of_the_records(name):
    """After a change: python -m shaper_fmu.design.method_tables docs/*.md"""
    page = (Path(__file__).parents[2] / "docs" / name).read_text()
    assert "<!-- table of" in page
    assert with_tables(page) == page
