"""Several inputs: a shaper before each, or a common one, against a plant whose vibration is known by its eigenvalues."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from two_drives import frequencies, left_together, two_drives

from shaper_fmu.errors import ArgumentError
from shaper_fmu.report import write_tuning
from shaper_fmu.report.tune.inputs import write_inputs
from shaper_fmu.report.tune.outputs import folder_for
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set
from shaper_fmu.tune import ModeBox, requirements_for, tune_inputs
from shaper_fmu.tune.choice.boxes import merged_boxes
from shaper_fmu.tune.choice.requirements import Move
from shaper_fmu.tune.tuning_inputs import InputsTuning

MORE = pytest.mark.thorough
SPREAD = {"mass": 0.05}
MASSES = np.linspace(0.95, 1.05, 21)


@pytest.fixture(scope="module")
def plant(tmp_path_factory) -> Path:
    return two_drives(tmp_path_factory.mktemp("drives"))


def tuned(plant: Path, common: bool, nominal: float = 0.02) -> InputsTuning:
    requirements = requirements_for(SPREAD, nominal_tolerance=nominal)
    return tune_inputs(plant, ["f1", "f2"], ["x1", "x2"], spread=SPREAD, requirements=requirements, common=common)


@pytest.mark.parametrize("common", [False, pytest.param(True, marks=MORE)])
def test_all_commands_at_once_leave_what_the_eigenvalues_tell(plant, common):
    """Each drive excites both modes, and both are seen in both outputs."""
    found = tuned(plant, common)
    assert found.verdict == "tuned"
    for one in found.tunings.values():
        assert one.plant is not None
        assert [mode.natural_frequency for mode in one.plant.nominal.modes] == pytest.approx(frequencies(), rel=1e-6)
    sequences = [one.candidate.sequence for one in found.tunings.values() if one.candidate is not None]
    assert (sequences[0] == sequences[1]) == common
    jumps = [(one.amplitudes, one.delays) for one in sequences]
    assert found.together is not None
    assert found.together.nominal.share == pytest.approx(left_together(jumps), rel=2e-3)
    assert found.together.worst.share == pytest.approx(max(left_together(jumps, mass=m) for m in MASSES), rel=2e-3)
    assert max(left_together(jumps, mass=m) for m in MASSES) <= 0.05
    assert left_together(jumps) <= 0.02


@MORE
def test_the_tunings_of_one_input_and_of_all_do_not_replace_each_other(plant, tmp_path):
    found, folder = tuned(plant, common=True), tmp_path / "out"
    write_inputs(found, folder, report=False)
    assert folder_for(found, folder) == folder
    for one in found.tunings.values():
        assert folder_for(one, folder) == tmp_path / "out_2"
        write_tuning(one, tmp_path / one.input, report=False)
        assert folder_for(found, tmp_path / one.input) == tmp_path / f"{one.input}_2"


@MORE
def test_what_holds_alone_but_not_together_is_designed_tighter_or_told(plant, monkeypatch):
    """Alone 1.96 % are left nominally, together 2.02 % of 2 %; without a second try the verdict, of each input, too, is not held."""
    monkeypatch.setattr("shaper_fmu.tune.tuning_inputs._tighter", lambda *_: None)
    found = tuned(plant, common=False)
    assert found.verdict == "not_held"
    assert found.together is not None
    assert found.together.nominal.share > 0.02
    assert {one.verdict for one in found.tunings.values()} == {"not_held"}
    assert all(one.caveat for one in found.tunings.values())
    assert "more than the nominal tolerance of 2 %" in found.summary


@MORE
def test_the_command_writes_an_archive_with_a_shaper_before_each_input(plant, tmp_path):
    """The archive's run leaves no more than was told: both drives are moved at once."""
    arguments = ["tune", plant, "--input", "f1", "--input", "f2", "--vary", "mass=5%", "--nominal", "2%"]
    done = typed(*arguments, "--output-folder", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "all inputs: tuned" in " ".join(done.stdout.split())
    folder = tmp_path / "out"
    numbers = json.loads((folder / "tuning.json").read_text(encoding="utf-8"))
    assert numbers["verdict"] == "tuned"
    assert numbers["inputs"]["f2"] == {"folder": "f2", "verdict": "tuned"}
    assert (folder / "f1" / "shaper.ssv").is_file()
    assert (folder / "f2" / "tuning.json").is_file()
    page = (folder / "report.html").read_text(encoding="utf-8")
    worst = numbers["verification"]["worst"]["share"]
    assert f"All commands at once leave at most {100.0 * worst:.3g} % of the unshaped vibration (tolerance 5 %)" in page
    assert {"report_decision_f1.png", "report_decision_f2.png", "report.html"} <= {path.name for path in folder.iterdir()}
    assert len(page) < 1_000_000
    sizes = []
    for unshaped in (False, True):
        loaded, end = load_ssp(folder / "shaped_plant.ssp"), 1.0
        if unshaped:
            apply_parameter_set(loaded, "unshaped")
        found = loaded.system.simulate(end + 2.0, 0.001, record=["plant.x1", "plant.x2"])
        late = found.time > end
        sizes.append([0.5 * np.ptp(found[name][late]) for name in ("plant.x1", "plant.x2")])
    assert (np.array(sizes[0]) <= 0.05 * np.array(sizes[1])).all()
    again = typed(*arguments, "--output-folder", "out", "--resume", cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert json.loads((folder / "tuning.json").read_text(encoding="utf-8"))["verification"] == numbers["verification"]


def test_modes_of_several_inputs_are_merged():
    """Those within 25 % are one; amplitudes are those of all sets, 0 where a set has no such mode."""
    one = [ModeBox.around(10.0, 0.01, 0.1, (1.0, 2.0)), ModeBox.around(30.0, 0.02, 0.0, (3.0, 4.0))]
    other = [ModeBox.around(12.0, 0.03, 0.1, (5.0,)), ModeBox.around(50.0, 0.0, 0.0, (6.0,))]
    low, middle, high = merged_boxes([one, other])
    assert low.frequencies == pytest.approx((9.0, 13.2))
    assert low.dampings == (0.01, 0.03)
    assert low.amplitudes == (1.0, 2.0, 5.0)
    assert (middle.natural_frequency.nominal, middle.amplitudes) == (30.0, (3.0, 4.0, 0.0))
    assert (high.natural_frequency.nominal, high.amplitudes) == (50.0, (0.0, 0.0, 6.0))


def test_wrong_inputs_are_refused(plant, tmp_path):
    with pytest.raises(ArgumentError, match="2 to 4 different ones are needed"):
        tune_inputs(plant, ["f1", "f1"])
    with pytest.raises(ArgumentError, match="a move is for one input"):
        tune_inputs(plant, ["f1", "f2"], requirements=requirements_for({}, move=Move(1.0, 1.0, 1.0)))
    cases = {
        ("--input", "f1", "--common"): "needs several inputs",
        ("--input", "f1", "--input", "f3"): "f3",
        ("--input", "f1", "--input", "f2", "--for", "klipper"): "the shaper of one input",
        ("--input", "f1", "--input", "f2", "--vary", "f2=10%"): "f2 gets commands",
    }
    for words, why in cases.items():
        done = typed("tune", plant, *words, cwd=tmp_path)
        assert done.returncode == 2, words
        assert why in " ".join(done.stderr.split())
