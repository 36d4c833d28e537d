"""From a plant to a tuned shaper, as a user types it: what `shaper-fmu tune` finds, writes and says."""

from __future__ import annotations

import json
import math
import zipfile
from pathlib import Path

import numpy as np
import pytest
from command_line import Done, in_a_process, typed
from move_records import driven
from test_tune_experiment import pid_loop, swinging, three_mass_loop
from three_mass_loop import closed_loop, response

from shaper_fmu import ImpulseSequence, System, requirements_for, tune_plant, verify
from shaper_fmu.export.native.toolchain import PLATFORMS, USUAL_PLATFORMS
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.ssp.check import check_ssp
from shaper_fmu.ssp.parameter_sets import apply_parameter_set

W, ZETA = 5.0, 0.05
PLANT = ["--set", "mass=2", "--set", "stiffness=50", "--set", "damping=1"]  # W and ZETA


def tuned(*arguments: str | Path, cwd: Path) -> Done:
    return typed("tune", *arguments, cwd=cwd)


def half_peak_to_peak(values: np.ndarray) -> float:
    return 0.5 * float(np.ptp(values))


@pytest.fixture(scope="module")
def spring(fmus, tmp_path_factory) -> tuple[Path, Done]:
    """A mass and a spring, tuned for a mass that varies by 10 %."""
    folder = tmp_path_factory.mktemp("tuned")
    plant = fmus / "MassSpringDamper.fmu"
    done = tuned(plant, "--input", "force", "--output", "position", "--vary", "mass=10%", *PLANT, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "MassSpringDamper_tuned", done


def test_the_words_and_the_files(spring):
    folder, done = spring
    assert "tuned: " in done.stdout
    assert "\n  On the plant: " in done.stdout  # a sentence, a line
    assert "the tolerance of 5 % holds" in done.stdout
    names = {
        "InputShaper_MassSpringDamper.fmu", "shaper.ssv", "shaped_plant.ssp", "MassSpringDamper_shaped.fmu", "tuning.json", "report.html"
    }  # fmt: skip
    assert names <= {path.name for path in folder.iterdir()}
    assert all(f"wrote MassSpringDamper_tuned/{name}" in done.stdout for name in names)
    assert len(list(folder.glob("report_*.png"))) >= 5


def test_the_numbers(spring):
    """The nominal mode is sqrt(k/m), c/(2 sqrt(k m)); its range goes with 1/sqrt(m)."""
    numbers = json.loads((spring[0] / "tuning.json").read_text())
    assert numbers["verdict"] == "tuned"
    mode = numbers["modes"][0]
    assert mode["natural_frequency"] == pytest.approx(W, rel=1e-9)
    assert mode["damping_ratio"] == pytest.approx(ZETA, rel=1e-9)
    assert mode["natural_frequency_range"] == pytest.approx([W / math.sqrt(1.1), W / math.sqrt(0.9)], rel=1e-9)
    assert numbers["verification"]["worst"]["share"] <= 0.05
    assert numbers["verification"]["nominal"]["share"] <= 0.01


def test_the_shapers_fmu_begins_tuned(spring):
    """A step through it has the levels of the recommended impulses, without any value set."""
    chosen = json.loads((spring[0] / "tuning.json").read_text())["choice"]["recommended"]
    delays, amplitudes = (np.array(chosen["impulses"][name]) for name in ("delay", "amplitude"))
    system = System()
    system.add("shaper", spring[0] / "InputShaper_MassSpringDamper.fmu")
    system.drive("shaper.command", 1.0)
    times = np.append(0.5 * (delays[1:] + delays[:-1]), delays[-1] + 1.0)
    results = system.simulate(delays[-1] + 2.0, 1e-3, record=["shaper.shaped"])
    found = np.interp(times, results.time, results["shaper.shaped"])
    assert found == pytest.approx(np.cumsum(amplitudes), rel=1e-12)


def test_the_shaped_plant_is_what_wrap_makes_of_the_tuning(spring, fmus, tmp_path):
    """The plant's FMU with the shaper inside, for the plant's own start values; that the tuning is for others is told."""
    plant = fmus / "MassSpringDamper.fmu"
    name = "MassSpringDamper_shaped.fmu"
    done = typed("wrap", plant, "--tuned", spring[0] / "tuning.json", "--output", name, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / name).read_bytes() == (spring[0] / name).read_bytes()
    note = "note: the tuning is for mass = 2, but MassSpringDamper.fmu starts with 1: set it where the FMU is used"
    assert note in done.stderr
    assert note in spring[1].stderr


def test_the_archive_runs_and_holds_the_tolerance(spring):
    """Without errors for `check`; shaped and, by its other parameter set, unshaped: half peak to peak after the command."""
    path = spring[0] / "shaped_plant.ssp"
    assert check_ssp(path) == []
    numbers = json.loads((spring[0] / "tuning.json").read_text())
    left = {}
    for case in ("shaped", "unshaped"):
        loaded = load_ssp(path)
        if case == "unshaped":
            apply_parameter_set(loaded, "unshaped")
        step, stop = loaded.structure.step_size, loaded.structure.stop_time
        assert step is not None
        assert stop is not None
        results = loaded.simulate(stop, step)
        end = (numbers["choice"]["recommended"]["delay"] if case == "shaped" else 0.0) + 0.02 * 2.0 * math.pi / W
        window = (results.time >= end) & (results.time <= end + 3.0 * math.pi / W)
        left[case] = half_peak_to_peak(results["plant.position"][window])
    # the reference is a move of a hundredth of a period: about what a step leaves
    assert left["shaped"] / left["unshaped"] == pytest.approx(numbers["verification"]["nominal"]["share"], abs=2e-3)


def without_times(path: Path) -> str:
    """The numbers of a tuning but for wall times."""
    numbers = json.loads(path.read_text())
    for part in (numbers["effort"], *numbers["effort"]["parts"].values()):
        del part["seconds"], part["stepping"]
    return json.dumps(numbers)


def test_the_same_twice_gives_the_same_bits(spring, fmus, tmp_path):
    plant = fmus / "MassSpringDamper.fmu"
    options = ["--input", "force", "--output", "position", "--vary", "mass=10%", *PLANT, "--no-report"]
    assert tuned(plant, *options, cwd=tmp_path).returncode == 0
    for name in ("shaper.ssv", "shaped_plant.ssp", "InputShaper_MassSpringDamper.fmu"):
        assert (tmp_path / "MassSpringDamper_tuned" / name).read_bytes() == (spring[0] / name).read_bytes(), name
    assert without_times(tmp_path / "MassSpringDamper_tuned" / "tuning.json") == without_times(spring[0] / "tuning.json")
    assert not (tmp_path / "MassSpringDamper_tuned" / "report.html").exists()


@pytest.mark.thorough
def test_a_closed_loop_in_an_archive(fmus, tmp_path):
    """The modes are the loop's (eigenvalues of its matrices, Jung 2011), not the chain's; the shaper holds on the loop."""
    loop = three_mass_loop(fmus)
    loop.to_ssp(tmp_path / "loop.ssp", stop_time=10.0, step=0.01)
    options = ["--input", "controller.reference", "--output", "chain.position[3]", "--margin", "5%", "--no-report"]
    done = in_a_process("tune", "loop.ssp", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr + done.stdout
    with zipfile.ZipFile(tmp_path / "loop_tuned" / "InputShaper_loop.fmu") as fmu:
        assert {PLATFORMS[name].fmi2_folder for name in USUAL_PLATFORMS} <= {
            path.split("/")[1] for path in fmu.namelist() if "/" in path
        }
    numbers = json.loads((tmp_path / "loop_tuned" / "tuning.json").read_text())
    poles = swinging(closed_loop()[0])
    found = [(mode["natural_frequency"], mode["damping_ratio"]) for mode in numbers["modes"]]
    assert found == [(pytest.approx(abs(p), rel=1e-6), pytest.approx(-p.real / abs(p), rel=1e-5)) for p in poles]
    assert numbers["verification"]["nominal"]["share"] <= 0.01
    archive = load_ssp(tmp_path / "loop_tuned" / "shaped_plant.ssp")
    assert archive.system.connections[("controller", "reference")] == ("shaper", "shaped_mean")
    assert archive.system.connections[("chain", "force")] == ("controller", "force")


def test_what_does_not_vibrate_needs_no_shaper(fmus, tmp_path):
    done = tuned(
        fmus / "MassSpringDamper.fmu", "--input", "force", "--output", "position", "--set", "damping=30", cwd=tmp_path
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "no vibration: " in done.stdout
    assert "no shaper is needed" in done.stdout
    assert {path.name for path in (tmp_path / "MassSpringDamper_tuned").iterdir()} >= {"tuning.json", "report.html"}
    assert not list((tmp_path / "MassSpringDamper_tuned").glob("*.fmu"))


def test_an_unstable_loop_is_refused_in_words(fmus):
    """s^3 + s^2 + 150 s + 400 has roots on the right."""
    found = tune_plant(pid_loop(fmus, integral_gain=400.0), "controller.reference", ["plant.position"])
    assert found.verdict == "unstable"
    assert not found.good
    assert "stabilise it by feedback first" in found.summary


def test_too_short_a_delay_says_what_would_fit(fmus, tmp_path):
    done = tuned(
        fmus / "MassSpringDamper.fmu", "--input", "force", "--output", "position", "--max-delay", "0.1", *PLANT, "--no-report",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert "\nnothing fits a tolerance of 5 %" in done.stdout
    assert "a delay of 0.1 s" in done.stdout
    assert "These changes would make one fit" in done.stdout
    assert not list((tmp_path / "MassSpringDamper_tuned").glob("*.fmu"))


@pytest.mark.thorough
@pytest.mark.parametrize(("output", "command"), [("position[3]", "doublet"), ("velocity[3]", "pulse")])
def test_a_rigid_body_is_excited_so_that_it_comes_to_rest(fmus, output, command):
    """A free chain: a constant force drives it on for ever; a pulse of force leaves its position drifting, a doublet does not."""
    found = tune_plant(fmus / "ThreeMassChain.fmu", "force", [output], spread={"mass[3]": 0.1})
    assert found.verdict == "tuned", found.summary
    assert found.command.name == command
    assert found.verification is not None
    assert found.verification.worst.share <= 0.05


def test_what_is_told_of_a_shaper_that_does_not_hold_is_of_that_one(fmus, monkeypatch):
    """Without a further attempt the first choice, for what was asked, remains, and what was measured is of it."""
    monkeypatch.setattr("shaper_fmu.tune.tuning_plant._MORE_ATTEMPTS", 0)
    requirements = requirements_for({"mass[3]": 0.1})
    found = tune_plant(fmus / "ThreeMassChain.fmu", "force", ["velocity[3]"], requirements=requirements, spread={"mass[3]": 0.1})
    assert found.verdict == "not_held"
    assert found.choice is not None
    assert found.verification is not None
    assert found.choice.requirements == requirements
    assert found.verification.worst.share > 0.05
    again = verify(
        fmus / "ThreeMassChain.fmu", "force", ["velocity[3]"], found.choice.nearest, found.choice.boxes, found.spread,
        command=found.command,
    )  # fmt: skip
    assert again.worst == found.verification.worst


def test_the_responses_shown_are_those_of_the_loop(fmus):
    """The step response of the loop's matrices (Jung 2011), unshaped and behind the impulses; in steps as fine as the verification's."""
    found = tune_plant(
        three_mass_loop(fmus), "controller.reference", ["chain.position[3]"], requirements=requirements_for({}, kinds=("zvd",))
    )
    known, shown = response(), found.responses[0]
    assert found.candidate is not None
    size, late = found.command.amplitude, shown.time > 0.0
    shapers = ImpulseSequence((1.0,), (0.0,)), found.candidate.sequence
    for shaper, values in zip(shapers, shown.outputs["chain.position[3]"], strict=True):
        assert values[late] == pytest.approx(size * known.values(shaper, shown.time[late])[2], abs=1e-3 * size)


def test_a_measured_response(tmp_path):
    """Two decaying cosines from a formula, sampled at 200 Hz with 0.5 % of noise."""
    t = np.arange(0.0, 12.0, 0.005)
    rng = np.random.default_rng(7)
    y = np.exp(-ZETA * W * t) * np.cos(W * math.sqrt(1 - ZETA**2) * t) + 0.2 * np.exp(-0.3 * t) * np.cos(17.0 * t)
    y += 0.005 * rng.standard_normal(len(t))
    rows = "\n".join(f"{a:.6f},{b:.9f}" for a, b in zip(t, y, strict=True))
    (tmp_path / "ringing.csv").write_text(f"time [s],position [mm]\n{rows}\n")
    done = tuned("ringing.csv", "--output", "position", "--excitation-end", "0", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    numbers = json.loads((tmp_path / "ringing_tuned" / "tuning.json").read_text())
    assert numbers["verdict"] == "for_modes_found"
    assert numbers["verification"] is None
    true = [W, math.hypot(17.0, 0.3)]
    for mode, w in zip(numbers["modes"], true, strict=True):
        assert abs(mode["natural_frequency"] - w) < 4.0 * mode["natural_frequency_std"]
    files = {path.name for path in (tmp_path / "ringing_tuned").iterdir()}
    assert {"InputShaper_ringing.fmu", "shaper.ssv", "report.html"} <= files
    assert "shaped_plant.ssp" not in files


@pytest.mark.thorough
def test_a_shaper_that_is_not_proven_says_so_wherever_it_is_met(tmp_path):
    """A rest, a sine's period of acceleration, the ringing, and nobody tells when it has ended: in the files, and where they are told."""
    t = np.arange(0.0, 12.0, 0.02)
    drive = np.where((t >= 1.0) & (t < 2.0), np.sin(2.0 * np.pi * t), 0.0)
    x = np.real(driven(complex(-ZETA * W, W * math.sqrt(1.0 - ZETA**2)), drive, 0.02) * -1j)
    np.savetxt(tmp_path / "move.csv", np.array([t, x]).T, "%.17g", ",", header="time,x", comments="")
    done = tuned("move.csv", cwd=tmp_path)
    folder = tmp_path / "move_tuned"
    assert done.returncode == 1
    assert "\nnot proven: it was not given when" in done.stdout
    told = {line.split("/")[-1] for line in done.stdout.splitlines() if line.startswith("wrote ")}
    assert {"InputShaper_move.fmu (not proven)", "shaper.ssv (not proven)", "tuning.json"} <= told
    with zipfile.ZipFile(folder / "InputShaper_move.fmu") as fmu:
        assert 'description="NOT PROVEN: ' in fmu.read("modelDescription.xml").decode()
    assert 'description="NOT PROVEN: ' in (folder / "shaper.ssv").read_text()
    numbers = json.loads((folder / "tuning.json").read_text())
    assert (numbers["verdict"], numbers["good"], numbers["caveat"][:12]) == ("not_proven", False, "NOT PROVEN: ")
    page = (folder / "report.html").read_text()
    assert page.count("nothing of it is proven") == 3
    assert "proven over the ranges" not in page
    again = tuned("move.csv", "--max-delay", "1e-3", "--no-report", cwd=tmp_path)
    assert again.returncode == 1
    assert "note: move_tuned/shaper.ssv is of an earlier tuning" in again.stderr
    assert "note: move_tuned/InputShaper_move.fmu is of an earlier tuning" in again.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--output", "position"], 2, "name the input"),
        (["--input", "forse", "--output", "position"], 2, "Did you mean 'force'?"),
        (["--input", "force", "--output", "positon"], 2, "Did you mean 'position'?"),
        (["--input", "force", "--tolerance", "5 percent"], 2, "is not a share; write 5% or 0.05"),
        (["--input", "force", "--tolerance", "200%"], 2, "outside its domain 0 < tolerance < 1"),
        (["--input", "force", "--vary", "mass"], 2, "is not of the form mass=10%"),
        (["--input", "force", "--vary", "mas=10%"], 2, "Did you mean 'mass'?"),
        (["--input", "force", "--vary", "mass=-10%"], 2, "cannot vary by"),
        (["--input", "force", "--vary", "mass=10"], 2, "10 would be 1000 %: did you mean 10%?"),
        (["--input", "force", "--vary", "mass=1000%"], 2, "mass = 1.0 cannot vary by +-1000 % of it: did you mean 10 % (0.1)?"),
        (["--input", "force", "--tolerance", "5"], 2, "5 would be 500 %: did you mean 5%?"),
        (["--input", "force", "--nominal", "1"], 2, "1 would be 100 %: did you mean 1%?"),
        (["--input", "force", "--margin", "10"], 2, "10 would be 1000 %: did you mean 10%?"),
        (["--input", "force", "--kind", "zvf"], 2, "there is no shaper or profile 'zvf'"),
        (["--input", "force", "--set", "mass=heavy"], 2, "heavy"),
        (["--input", "force", "--max-delay", "-1"], 2, "-1 is outside its domain: at least 0"),
    ],
)
def test_wrong_usage_is_told_and_nothing_written(fmus, tmp_path, arguments, code, words):
    done = tuned(fmus / "MassSpringDamper.fmu", *arguments, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert words in " ".join(done.stderr.replace("│", " ").split()), done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_files_that_are_no_plants(tmp_path):
    (tmp_path / "broken.fmu").write_bytes(b"no archive")
    (tmp_path / "empty.csv").write_text("time,x\n")
    for name in ("broken.fmu", "missing.fmu", "missing.ssp", "empty.csv", "missing.csv"):
        done = tuned(name, "--input", "force", cwd=tmp_path)
        assert done.returncode == (2 if "missing" in name else 1), (name, done.stderr)
        assert "error: " in done.stderr.lower()
        assert "Traceback" not in done.stderr


def test_a_margin_is_taken_where_nothing_varies():
    assert requirements_for({}).frequency_margin == 0.1
    assert requirements_for({"mass": 0.1}).frequency_margin == 0.0
    assert requirements_for({}, tolerance=0.005).nominal_tolerance == 0.005
