"""Insensitivities that a sweep reads off by itself, and plans that sample."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from sweep_cases import runs_of

from shaper_fmu.analysis.vibration import Command
from shaper_fmu.analysis.vibration import tolerated_band as formula_band
from shaper_fmu.design.profiles import profile
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import StudyError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.engine import engine_for, run_study
from shaper_fmu.sweep.plan import Points, Sampling
from shaper_fmu.sweep.refine import slices, tolerated_band
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study, read_study
from shaper_fmu.sweep.variation import Vary

W = 10.0
SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="shaped">
  <ssd:System name="root">
    <ssd:Elements>
      <ssd:Component name="profile" type="application/x-fmu-sharedlibrary" source="resources/MotionProfile.fmu"/>
      <ssd:Component name="shaper" type="application/x-fmu-sharedlibrary" source="resources/InputShaper.fmu"/>
      <ssd:Component name="plant" type="application/x-fmu-sharedlibrary" source="resources/MassSpringDamper.fmu"/>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="profile" startConnector="position" endElement="shaper" endConnector="command"/>
      <ssd:Connection startElement="shaper" startConnector="shaped" endElement="plant" endConnector="force"/>
    </ssd:Connections>
  </ssd:System>
</ssd:SystemStructureDescription>
"""
STUDY = """
name = "insensitivity"
system = "shaped.ssp"
stop_time = 4.0
step = 0.002
reference = "unshaped"
[vary."plant.stiffness"]
nominal = 100.0
factors = [0.3, 0.5, 0.7, 0.8, 0.9, 1.1, 1.2, 1.4, 1.7, 2.0, 2.4]
[compare]
unshaped = { "shaper.shaper" = "none", "plant.damping" = 0.0, "profile.profile" = "step" }
zv = { "shaper.shaper" = "zv", "plant.damping" = 0.0, "profile.profile" = "step" }
zvd = { "shaper.shaper" = "zvd", "plant.damping" = 0.0, "profile.profile" = "step" }
ei = { "shaper.shaper" = "ei", "plant.damping" = 0.0, "profile.profile" = "step" }
two_hump_ei = { "shaper.shaper" = "two_hump_ei", "plant.damping" = 0.0, "profile.profile" = "step" }
[compare.two_part]
"shaper.shaper" = "none"
"plant.damping" = 0.0
"profile.profile" = "two_part"
"profile.duration" = 0.6283185307179586
"profile.natural_frequency" = 10.0
[metrics.residual]
kind = "residual"
output = "plant.position"
command = "shaper.shaped"
[refine]
metric = "residual"
level = 0.05
width = 0.001
"""


def shaped_study(folder: Path, text: str) -> Study:
    (folder / "shaped").mkdir()
    (folder / "shaped" / "SystemStructure.ssd").write_text(SYSTEM)
    (folder / "fmus").mkdir()
    for name in ("MotionProfile", "InputShaper", "MassSpringDamper"):
        (folder / "fmus" / f"{name}.fmu").write_bytes(fmu_path(name, platforms=["this"]).read_bytes())
    pack_ssp(folder / "shaped", folder / "fmus")
    (folder / "study.toml").write_text(text)
    return read_study(folder / "study.toml")


def test_the_sweep_finds_the_insensitivities_by_itself(tmp_path):
    """The band of V <= 5 % of each command on an undamped mode, against its formula; the stiffness goes with the frequency squared.

    Half the peak-to-peak value of samples misses (w h)^2 / 8 of it at most, which moves an edge by less than 1e-5.
    """
    study = shaped_study(tmp_path, STUDY)
    counts = run_study(study, tmp_path / "s.sqlite", engine=engine_for(2))
    assert set(counts) == {"done"}
    assert counts["done"] < 6 * 12 + 20 * 3 * 6 * 2
    commands: dict[str, Command] = {kind: shaper(kind, W) for kind in ("zv", "zvd", "ei", "two_hump_ei")}
    commands["two_part"] = profile("two_part", 1.0, 0.2 * math.pi, W, 0.0)
    widths = {}
    with Store(tmp_path / "s.sqlite") as store:
        for case, _, along in slices(store.study(), store, 0):
            found = tolerated_band(along, 0.05, 100.0)
            assert found is not None
            ratios = [math.sqrt(value / 100.0) for value in found]
            assert ratios == pytest.approx(formula_band(commands[case], W), abs=3e-5 if case != "two_part" else 1e-3), case
            widths[case] = ratios[1] - ratios[0]
    closed_form = 4.0 / math.pi * math.asin(0.05)  # ZV on an undamped mode: V = |cos(pi r / 2)|
    assert widths["zv"] == pytest.approx(closed_form, abs=3e-5)


def test_a_run_ends_when_its_variable_says_so(tmp_path):
    """`settled` is true once the last impulse is through, pi / w after the step; then it goes on for a tenth of a second."""
    text = STUDY.replace("stop_time = 4.0", 'stop_time = 4.0\nstop_when = "shaper.settled"\nstop_hold = 0.1').split("[refine]")[0]
    text = text.replace('kind = "residual"', 'kind = "final"').replace('command = "shaper.shaped"\n', "")
    study = shaped_study(tmp_path, text)
    run_study(study, tmp_path / "s.sqlite")
    found = {(run.compared, run.varied["plant.stiffness"]): run.metrics["residual"] for run in runs_of(tmp_path / "s.sqlite")}
    k = 120.0
    w = math.sqrt(k)
    end = math.pi / W + 0.1
    end = 0.002 * math.ceil(round(end / 0.002, 9))  # the first communication point from there on
    expected = (1.0 - 0.5 * math.cos(w * end) - 0.5 * math.cos(w * (end - math.pi / W))) / k
    assert found["zv", k] == pytest.approx(expected, abs=1e-4 / k)


@pytest.mark.parametrize("kind", ["random", "latin_hypercube", "sobol"])
def test_sampled_plans_are_the_same_for_the_same_seed_and_follow_their_distributions(kind):
    """Kolmogorov and Smirnov's test against scipy's distributions; the mean and deviation of log_normal are the value's own."""
    vary = {
        "a": Vary(low=2.0, high=5.0), "b": Vary(nominal=10.0, deviation=0.5, distribution="normal"),
        "c": Vary(mean=3.0, deviation=1.5, distribution="log_normal"),
        "d": Vary(nominal=1.0, low=0.0, high=4.0, distribution="triangular"),
    }  # fmt: skip
    one, same, other = (Points(vary, Sampling(kind, 1000, seed)) for seed in (7, 7, 8))
    values = np.array(list(one))
    assert values.tolist() == [list(same.point(i)) for i in range(1000)]
    assert values.tolist() != np.array(list(other)).tolist()
    spread = math.sqrt(math.log(1.25))
    expected = [
        stats.uniform(2.0, 3.0), stats.norm(10.0, 0.5), stats.lognorm(spread, scale=3.0 / math.sqrt(1.25)), stats.triang(0.25, 0.0, 4.0),
    ]  # fmt: skip
    for column, distribution in zip(values.T, expected, strict=True):
        assert stats.kstest(column, distribution.cdf).pvalue > 0.001
    assert expected[2].mean() == pytest.approx(3.0)
    assert expected[2].std() == pytest.approx(1.5)


def test_zipped_plans_take_lists_side_by_side():
    vary = {"a": Vary(nominal=5.0, values=[3.0, 1.0]), "b": Vary(values=["x", "y"])}
    assert list(Points(vary, Sampling("zip"))) == [(3.0, "x"), (1.0, "y")]
    with pytest.raises(StudyError, match="zip needs lists of one length; here are a: 2, b: 1"):
        Points({**vary, "b": Vary(values=["x"])}, Sampling("zip"))
