"""The report of a tuning and its numbers as JSON, read back: against the tuning itself, closed forms, and an InputShaper FMU."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report_pages import figures_of
from spring_with_unit import spring_with_unit

from shaper_fmu import System
from shaper_fmu.page.blocks import Block, Heading, Table, Text, page_text, write_report
from shaper_fmu.page.figures import Figure, Line, Panels
from shaper_fmu.report.tune.choice import apart
from shaper_fmu.report.tune.evidence import amplitude_spectrum
from shaper_fmu.report.tune.modes import percent, with_deviation
from shaper_fmu.report.tune.opening import VERDICTS, decision_text, runner_up
from shaper_fmu.report.tune.report import short_number, tuning_blocks
from shaper_fmu.tune.choice.requirements import Move, Requirements
from shaper_fmu.tune.identify.measured_table import Table as Samples
from shaper_fmu.tune.meter import without_seconds
from shaper_fmu.tune.tuning import Tuning
from shaper_fmu.tune.tuning_json import SCHEMA, tuning_numbers, write_json
from shaper_fmu.tune.tuning_measured import tune_measured
from shaper_fmu.tune.tuning_plant import tune_plant

SECTIONS = [
    "Recommendation", "Modes", "Spectrum", "Ring-down and fit", "Sensitivity", "Trade-off", "Before and after", "Alternatives",
    "Verification", "What it cost",
]  # fmt: skip
FEW = Requirements(kinds=("zv", "zvd", "ei"))


@pytest.fixture(scope="module")
def spring(fmus) -> Tuning:
    """A mass and a spring whose mass varies."""
    return varied_spring(fmus)


def varied_spring(fmus) -> Tuning:
    requirements = replace(FEW, kinds=("zv", "zvd", "ei", "si"))
    return tune_plant(fmus / "MassSpringDamper.fmu", "force", ["position"], spread={"mass": 0.1}, requirements=requirements)


@pytest.fixture(scope="module")
def misfit(fmus) -> Tuning:
    """Nothing is as quick as asked for."""
    requirements = Requirements(kinds=("zv", "zvd"), longest_delay=0.35)
    return tune_plant(fmus / "MassSpringDamper.fmu", "force", ["position"], spread={"mass": 0.3}, requirements=requirements)


@pytest.fixture(scope="module")
def measured() -> Tuning:
    """Two modes of a formula and white noise; y3 has much less of them than the others."""
    t = np.arange(1000) * 0.01
    noise = np.random.default_rng(5).standard_normal((4, len(t)))
    slow, fast = (np.exp(-z * w * t) * np.cos(math.sqrt(1.0 - z * z) * w * t) for w, z in ((6.0, 0.02), (20.0, 0.01)))
    parts = {"y1": (1.0, 0.3), "y2": (2.0, -0.5), "y3": (0.01, 0.01)}
    columns = [a * slow + b * fast + 0.01 * a * e for (a, b), e in zip(parts.values(), noise, strict=False)]
    table = Samples({"time": t, **dict(zip(parts, columns, strict=True))}, dict.fromkeys(parts, "mm"))
    return tune_measured(table, excitation_end=0.0, requirements=replace(FEW, frequency_margin=0.05))


def v(amplitudes: list[float], delays: list[float], w: float, zeta: float) -> float:
    """Singer and Seering 1990, equation 4, for impulses that add up to 1."""
    a, t = np.array(amplitudes), np.array(delays)
    grown, phase = a * np.exp(zeta * w * t), w * math.sqrt(1.0 - zeta * zeta) * t
    return math.exp(-zeta * w * t[-1]) * math.hypot(grown @ np.cos(phase), grown @ np.sin(phase))


def headings(blocks: list[Block]) -> list[str]:
    return [block.text for block in blocks if isinstance(block, Heading)]


def table(blocks: list[Block], begin: str) -> Table:
    return next(block for block in blocks if isinstance(block, Table) and block.title.startswith(begin))


def figure(blocks: list[Block], key: str) -> Figure:
    return next(block for block in blocks if isinstance(block, Figure) and block.key == key)


def line(of: Figure, begin: str) -> Line:
    return next(one for one in of.lines if one.name.startswith(begin))


def read_strictly(path: Path) -> dict:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def test_the_page_has_all_sections_and_pictures(spring, tmp_path):
    blocks = tuning_blocks(spring)
    assert headings(blocks) == SECTIONS
    written = write_report(tmp_path / "report.html", "Tuning", blocks)
    keys = [block.key for block in blocks if isinstance(block, Figure | Panels)]
    assert keys == [
        "decision", "spectrum_1", "ring_down_1", "sensitivity_1", "trade_off", "command", "response_nominal_1", "response_worst_1",
    ]  # fmt: skip
    assert [path.name for path in written] == ["report.html", *(f"report_{key}.png" for key in keys)]
    assert all(path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n") for path in written[1:])
    page = written[0].read_text(encoding="utf-8")
    assert list(figures_of(page)) == ["decision_response", "decision_sensitivity", *keys[1:]]
    assert len(page.encode()) < 1_000_000
    assert VERDICTS["tuned"] in page
    assert spring.summary[1:] in page


def test_numbers_of_the_page_are_those_of_the_tuning(spring):
    blocks, best, seen = tuning_blocks(spring), spring.choice.recommended, spring.verification
    shaper = dict(table(blocks, "The shaper").rows)
    assert shaper["shaper"] == best.name
    assert float(shaper["delay"].removesuffix(" s")) == pytest.approx(best.delay, rel=5e-4)
    assert shaper["worst case, proven over the ranges"].startswith(percent(best.worst_case))
    assert shaper["nominally, proven"] == percent(best.nominal)
    assert shaper["on the plant, nominal"] == percent(seen.nominal.share)
    assert shaper["on the plant, worst"] == percent(seen.worst.share)
    assert shaper["tolerance"] == "5 %"
    assert shaper["varied: mass"] == "± 10 %"
    # w = sqrt(100 / 1), zeta = 1 / (2 sqrt(100)): the FMU's own start values
    (mode,) = table(blocks, "Modes").rows
    assert mode[1].startswith("10 ±")
    assert float(mode[2]) == pytest.approx(10.0 / (2.0 * math.pi), rel=5e-4)
    assert mode[3].startswith("0.05 ±")
    low, high = math.sqrt(100 / 1.1), math.sqrt(100 / 0.9)
    hertz = f"{low / (2.0 * math.pi):.4g} to {high / (2.0 * math.pi):.4g} Hz"
    assert mode[4] == f"{low:.4g} to {high:.4g} rad/s ({hertz}), 0.0477 to 0.0527"
    assert len(table(blocks, "Operating points").rows) == 3
    assert [row[0] for row in table(blocks, "Shapers on the front").rows] == [
        one.name + (" (recommended)" if one is best else "") for one in spring.choice.front
    ]
    points = table(blocks, "Points simulated").rows
    assert len(points) == len(seen.points)
    assert (points[0][0], points[0][1]) == (f"{seen.worst.values['mass']:.4g}", percent(seen.worst.share))


def test_the_page_opens_with_what_decides(spring):
    """One sentence: shaper, delay, tolerance, before and after in the plant's units, the runner-up; a picture of two panels."""
    blocks, best, seen = tuning_blocks(spring), spring.choice.recommended, spring.verification
    assert isinstance(blocks[1], Text)
    sentence = blocks[1].text
    assert sentence.startswith(VERDICTS["tuned"])
    assert (
        f"{best.name}: {best.delay:.4g} s of delay, at most {percent(best.worst_case)} of the unshaped vibration (tolerance 5 %)"
        in sentence
    )
    before, after = seen.worst.before[0], seen.worst.after[0]
    assert f"on the plant at worst position ± {before:.4g} m before and ± {after:.4g} m after" in sentence
    # a lightly damped step of 1 N on 100 N/m: it swings by 0.01 m at most around its rest
    assert 0.008 < before < 0.01
    other = runner_up(spring.choice)
    assert other is not None
    assert other is not best
    assert f"the runner-up {other.name}, {other.delay:.4g} s and" in sentence
    assert isinstance(blocks[2], Panels)
    response, sensitivity = blocks[2].figures
    assert [one.name for one in response.lines] == ["unshaped", "shaped"]
    ((low, high),) = sensitivity.bands
    assert (low, high) == pytest.approx([one / (2.0 * math.pi) for one in spring.choice.boxes[0].frequencies])
    assert sensitivity.levels[0][0] == 5.0
    inside = sensitivity.lines[0].y[(sensitivity.lines[0].x >= low) & (sensitivity.lines[0].x <= high)]
    assert inside.max() <= 100.0 * best.bounds[0] * (1.0 + 1e-9)
    assert all(block.folded for block in blocks if isinstance(block, Table))


def test_numbers_of_the_page_have_readable_digits(spring, misfit, measured):
    """No number of a table or a text has more than seven digits after its first one that is not 0."""
    for tuning in (spring, misfit, measured):
        for block in tuning_blocks(tuning):
            texts = (
                [block.text]
                if isinstance(block, Text)
                else [x for row in block.rows for x in row]
                if isinstance(block, Table)
                else []
            )
            for text in texts:
                assert not re.search(r"[1-9]\d*\.?\d{8,}|1e\+?300", text), text


def test_start_values_on_the_page_are_all_there(spring):
    """With four digits: the files have the others."""
    expected = {}
    for name, value in spring.candidate.start_values().items():
        expected |= (
            {f"{name}[{i}]": short_number(x) for i, x in enumerate(value, 1)}
            if isinstance(value, list)
            else {name: short_number(value)}
        )
    assert dict(table(tuning_blocks(spring), "Start values of the InputShaper").rows) == expected


def test_curves_of_the_page(spring):
    blocks, choice = tuning_blocks(spring), spring.choice
    best = choice.recommended
    curve = line(figure(blocks, "sensitivity_1"), best.name)
    for w, level in zip(curve.x[::50], curve.y[::50], strict=True):
        assert level == pytest.approx(100.0 * v(best.sequence.amplitudes, best.sequence.delays, w, 0.05), rel=1e-9, abs=1e-12)
    low, high = choice.boxes[0].frequencies
    inside = curve.y[(curve.x >= low) & (curve.x <= high)]
    assert 0.9 * choice.requirements.tolerance < inside.max() / 100.0 <= best.bounds[0]
    assert {low, high} <= {value for value, _ in figure(blocks, "sensitivity_1").marks}
    front = line(figure(blocks, "trade_off"), "the front")
    assert front.y.tolist() == [one.delay for one in choice.front]
    assert front.x == pytest.approx([max(1e-3, 100.0 * one.worst_case) for one in choice.front])
    assert figure(blocks, "trade_off").levels[0][0] == choice.floor
    command = line(figure(blocks, "command"), "shaped")
    assert sorted(set(command.y)) == pytest.approx([0.0, *np.cumsum(best.sequence.amplitudes)])
    # a step of 1 N moves a spring of 100 N/m by 0.01 m; unshaped it overshoots by exp(-pi zeta / sqrt(1 - zeta^2))
    shown = figure(blocks, "response_nominal_1")
    overshoot = math.exp(-math.pi * 0.05 / math.sqrt(1.0 - 0.0025))
    assert line(shown, "unshaped").y.max() == pytest.approx(0.01 * (1.0 + overshoot), rel=2e-3)
    assert line(shown, "shaped").y[-1] == pytest.approx(0.01, rel=1e-3)


def test_response_and_fit_are_the_same_without_noise(spring):
    blocks = tuning_blocks(spring)
    for key in ("spectrum_1", "ring_down_1"):
        seen, fit = figure(blocks, key).lines
        assert seen.x.tolist() == fit.x.tolist()
        assert fit.y == pytest.approx(seen.y, abs=1e-6 * np.ptp(seen.y))
    ((frequency, text),) = figure(blocks, "spectrum_1").marks
    assert (frequency, text) == (pytest.approx(10.0 * math.sqrt(1.0 - 0.0025) / (2.0 * math.pi), rel=1e-6), "mode 1")
    assert float(table(blocks, "What the fit leaves").rows[0][3]) < 1e-6


def test_the_spectrum_of_a_sine_has_its_amplitude_at_its_frequency():
    """And decays away from it, as half of a Hann window does, by 6 dB per octave."""
    step, count = 0.01, 2048
    frequency = 160 / (8 * count * step)  # one of those at which it is looked
    wave = 3.0 * np.cos(2.0 * math.pi * frequency * step * np.arange(count))
    f, amplitude = amplitude_spectrum(wave[:, None], step)
    peak = int(np.argmax(amplitude[:, 0]))
    assert f[peak] == pytest.approx(frequency, rel=1e-3)
    assert amplitude[peak, 0] == pytest.approx(3.0, rel=2e-2)
    far = [float(amplitude[np.argmin(np.abs(f - frequency - d)), 0]) for d in (5.0, 10.0)]
    assert far[0] / far[1] == pytest.approx(2.0, rel=0.1)


def test_spectra_of_modes_far_apart_are_drawn_over_a_logarithmic_axis():
    """To every peak, with some thousand points at most."""
    t = np.arange(40_000) * 1e-3
    far = [(2.0 * math.pi * f, a) for f, a in ((0.5, 1.0), (40.0, 0.3))]
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    values = sum((a * np.exp(-0.005 * w * t) * np.cos(w * t) for w, a in far), noise)
    tuning = tune_measured(Samples({"t": t, "x": values}), excitation_end=0.0, requirements=replace(FEW, kinds=("zv",)))
    shown = figure(tuning_blocks(tuning), "spectrum_1")
    assert shown.log_x
    assert [value for value, _ in shown.marks] == pytest.approx([0.5, 40.0], rel=1e-3)
    seen = line(shown, "response")
    assert len(seen.x) <= 1602
    assert np.all(np.diff(seen.x) > 0.0)
    assert seen.y.max() == pytest.approx(0.0, abs=1e-9)
    for low, high, expected in ((0.3, 0.7, 0.5), (30.0, 50.0, 40.0)):
        near = (seen.x > low) & (seen.x < high)
        assert seen.x[near][np.argmax(seen.y[near])] == pytest.approx(expected, rel=1e-2)


def test_json_is_strict_and_has_the_numbers(spring, tmp_path):
    path = write_json(tmp_path / "tuning.json", spring)
    found, choice = read_strictly(path), spring.choice
    assert found == tuning_numbers(spring)
    assert [one.name for one in tmp_path.iterdir()] == ["tuning.json"]  # no draft is left
    assert (found["schema"], found["verdict"], found["good"]) == (SCHEMA, "tuned", True)
    assert (found["input"], found["input_unit"], found["outputs"], found["units"]) == ("force", "N", ["position"], ["m"])
    assert found["wish"]["longest_delay"] is None  # no limit
    assert found["command"] == {"kind": "step", "rest": 0.0, "amplitude": 1.0, "times": [0.0], "values": [1.0]}
    (mode,) = found["modes"]
    assert mode["natural_frequency"] == spring.plant.ranges[0].natural_frequency.nominal
    assert mode["natural_frequency_range"] == pytest.approx([10.0 / math.sqrt(1.1), 10.0 / math.sqrt(0.9)], rel=1e-6)
    # of x(t) = (1 - exp(..) (cos + ..)) / k the residue is -(1 - j zeta / sqrt(1 - zeta^2)) / k, at the step's beginning
    real, imaginary = mode["residues"]["position"]
    assert complex(real, imaginary) == pytest.approx(-0.01 * (1.0 - 0.05j / math.sqrt(1.0 - 0.0025)), rel=1e-6)
    assert [one["start_values"]["mass"] for one in found["operating_points"]] == pytest.approx([1.0, 0.9, 1.1])
    assert found["choice"]["floor"] == choice.floor
    assert [one["name"] for one in found["choice"]["candidates"]] == [one.name for one in choice.candidates]
    assert found["choice"]["recommended"] == found["choice"]["candidates"][choice.candidates.index(choice.recommended)]
    assert [found["choice"]["candidates"][i]["delay"] for i in found["choice"]["front"]] == [one.delay for one in choice.front]
    assert found["verification"]["worst"]["share"] == spring.verification.worst.share
    assert len(found["verification"]["points"]) == len(spring.verification.points)


def test_impulses_in_the_json_leave_what_it_says(spring):
    found = tuning_numbers(spring)
    box = found["modes"][0]["box"]
    low, high = box["natural_frequency"]
    w = np.linspace(low, high, 201)
    for one in found["choice"]["candidates"]:
        amplitudes, delays = one["impulses"]["amplitude"], one["impulses"]["delay"]
        left = max(v(amplitudes, delays, x, zeta) for x in w for zeta in box["damping_ratio"])
        assert left <= one["bounds"][0] * (1.0 + 1e-9)
        assert left >= 0.999 * one["bounds"][0] - 1e-6
        assert v(amplitudes, delays, *one["at"][0]) == pytest.approx(one["bounds"][0], rel=1e-4, abs=1e-6)
        assert one["delay"] == pytest.approx(delays[-1], rel=1e-12)


def test_an_input_shaper_with_these_start_values_has_these_impulses(fmus, spring, misfit):
    """A step through the FMU: its levels between the impulses are their sums, and it jumps at no other time."""
    for tuning in (spring, misfit):
        numbers = tuning_numbers(tuning)
        for one in [numbers["choice"]["nearest"], numbers["choice"]["candidates"][numbers["choice"]["front"][-1]]]:
            system = System()
            system.add("shaper", fmus / "InputShaper.fmu", one["start_values"])
            system.drive("shaper.command", np.array([[0.0, 1.0]]))
            delays, sums = one["impulses"]["delay"], np.cumsum(one["impulses"]["amplitude"])
            step = (delays[-1] or 1.0) / 512.37
            found = system.simulate(600.0 * step, step, record=["shaper.shaped", "shaper.duration"])
            away = np.abs(found.time[:, None] - delays).min(axis=1) > 1e-9
            expected = sums[np.searchsorted(delays, found.time[away], side="right") - 1]
            assert found["shaper.shaped"][away] == pytest.approx(expected, abs=1e-12)
            assert found["shaper.duration"][0] == pytest.approx(one["delay"], rel=1e-12, abs=1e-15)


def test_the_same_numbers_each_time(fmus, spring, tmp_path):
    again = varied_spring(fmus)
    """But for wall times: steps and runs are equal."""
    first, second = (replace(one, efforts=without_seconds(one.efforts)) for one in (spring, again))
    assert write_json(tmp_path / "a.json", first).read_bytes() == write_json(tmp_path / "b.json", second).read_bytes()
    assert page_text("Tuning", tuning_blocks(first)) == page_text("Tuning", tuning_blocks(second))


def test_where_nothing_vibrates(fmus, tmp_path):
    """Above critical damping, 2 sqrt(100 * 1) = 20 N s/m."""
    tuning = tune_plant(fmus / "MassSpringDamper.fmu", "force", ["position"], start_values={"damping": 25.0}, requirements=FEW)
    blocks = tuning_blocks(tuning)
    assert headings(blocks) == [*SECTIONS[:4], "What it cost"]
    assert Text("There is no mode of vibration.") in blocks
    # s^2 + 25 s + 100
    assert sorted(row[1] for row in table(blocks, "Other poles").rows) == ["-20", "-5"]
    page = write_report(tmp_path / "report.html", "Tuning", blocks)[0].read_text(encoding="utf-8")
    assert VERDICTS["no_vibration"] in page
    found = read_strictly(write_json(tmp_path / "tuning.json", tuning))
    assert (found["verdict"], found["modes"], found["choice"], found["verification"]) == ("no_vibration", [], None, None)
    assert sorted(one["pole"][0] for one in found["other_poles"]) == pytest.approx([-20.0, -5.0], rel=1e-6)


def test_an_unstable_plant(fmus, tmp_path):
    """s^3 + s^2 + 150 s + 400 has a pair of roots on the right."""
    system = System("loop")
    system.add("plant", fmus / "MassSpringDamper.fmu")
    system.add("controller", fmus / "PositionController.fmu", proportional_gain=50.0, derivative_gain=0.0, integral_gain=400.0)
    system.connect("controller.force", "plant.force")
    system.connect("plant.position", "controller.position")
    system.connect("plant.velocity", "controller.velocity")
    tuning = tune_plant(system, "controller.reference", ["plant.position"], requirements=FEW)
    blocks = tuning_blocks(tuning)
    assert headings(blocks) == [*SECTIONS[:4], "What it cost"]
    pole = max(np.roots([1.0, 1.0, 150.0, 400.0]), key=lambda s: (s.real, s.imag))
    assert figure(blocks, "spectrum_1").marks == [(pytest.approx(pole.imag / (2.0 * math.pi), rel=1e-5), "unstable")]
    page = write_report(tmp_path / "report.html", "Tuning", blocks)[0].read_text(encoding="utf-8")
    assert VERDICTS["unstable"] in page
    assert read_strictly(write_json(tmp_path / "tuning.json", tuning))["verdict"] == "unstable"


def test_where_nothing_fits_the_nearest_is_shown(misfit, tmp_path):
    blocks, nearest = tuning_blocks(misfit), misfit.choice.nearest
    assert headings(blocks) == [one for one in SECTIONS if one not in ("Before and after", "Verification")]
    assert blocks[1] == Text(f"{VERDICTS['nothing_fits']} {decision_text(misfit)}")
    shaper = dict(table(blocks, "The shaper").rows)
    assert (shaper["shaper (nearest)"], shaper["longest delay"]) == (nearest.name, "0.35 s")
    assert line(figure(blocks, "trade_off"), f"{nearest.name} (nearest)").y.tolist() == [nearest.delay]
    assert (0.35, "longest delay 0.35 s") in figure(blocks, "trade_off").levels
    assert all(row[-1] == "no" for row in table(blocks, "Shapers on the front").rows)
    found = read_strictly(write_json(tmp_path / "tuning.json", misfit))
    assert (found["verdict"], found["choice"]["recommended"], found["wish"]["longest_delay"]) == ("nothing_fits", None, 0.35)
    assert found["choice"]["nearest"]["name"] == nearest.name


def test_measured_data(measured, tmp_path):
    blocks = tuning_blocks(measured)
    assert headings(blocks) == [one for one in SECTIONS if one not in ("Before and after", "Verification", "What it cost")]
    assert blocks[1] == Text(f"{VERDICTS['for_modes_found']} {decision_text(measured)}")
    modes = table(blocks, "Modes").rows
    assert [float(row[1].partition(" ")[0]) for row in modes] == pytest.approx([6.0, 20.0], rel=2e-3)
    keys = [block.key for block in blocks if isinstance(block, Figure)]
    assert [key for key in keys if key.startswith("sensitivity")] == ["sensitivity_1", "sensitivity_2"]
    # white noise of 1 % of the slow mode's amplitude
    left = {row[0]: row[2] for row in table(blocks, "What the fit leaves").rows}
    assert float(left["y2"].removesuffix(" mm")) == pytest.approx(0.02, rel=0.1)
    some = [block for block in blocks if not isinstance(block, Figure) or block.key.endswith("_2")]
    assert len(write_report(tmp_path / "report.html", "Tuning", some)) == 1 + 4  # what decides, spectrum, ring-down, sensitivity
    found = read_strictly(write_json(tmp_path / "tuning.json", measured))
    assert (found["command"], found["verification"], found["operating_points"]) == (None, None, [])
    # the first sample after the end of the excitation is at 0.01 s; Re(residue exp(pole t)) is the mode from there on
    slow = found["modes"][0]
    moved = complex(*slow["residues"]["y2"]) * np.exp(-0.01 * complex(*slow["pole"]))
    assert moved == pytest.approx(2.0, rel=1e-2)
    assert found["measured"]["fit"]["residual"]["y2"] == pytest.approx(0.02, rel=0.1)


def test_of_many_outputs_those_that_vibrate_most_are_shown():
    """In the order of the table: of 13 in mm the last two swing least, and the only one in rad is shown."""
    t = np.arange(400) * 0.02
    wave = np.exp(-0.1 * t) * np.cos(6.0 * t)
    sizes = {**{f"y{k}": 1.0 + 0.1 * (14 - k) for k in range(1, 14)}, "angle": 1e-4}
    noise = np.random.default_rng(2).standard_normal((len(t), len(sizes)))
    units = {name: "rad" if name == "angle" else "mm" for name in sizes}
    columns = {name: size * (wave + 0.01 * e) for (name, size), e in zip(sizes.items(), noise.T, strict=True)}
    tuning = tune_measured(Samples({"time": t, **columns}, units), requirements=FEW)
    blocks = tuning_blocks(tuning)
    shown = [row[0] for row in table(blocks, "What the fit leaves").rows]
    assert shown == [*(f"y{k}" for k in range(1, 12)), "angle"]
    assert sum(isinstance(block, Figure) and block.key.startswith("spectrum") for block in blocks) == 12
    assert any(isinstance(block, Text) and block.text.startswith("Of 14 outputs the 12 are shown") for block in blocks)


def test_a_profile_of_a_move(fmus, tmp_path):
    """Its start values are a MotionProfile's; the FMU ends the move at its duration."""
    requirements = Requirements(move=Move(1.0, max_acceleration=30.0), kinds=("trapezoid", "cycloid"))
    tuning = tune_plant(spring_with_unit(tmp_path, "m"), "force", ["position"], requirements=requirements)
    assert tuning.candidate is not None
    law = tuning.candidate.profile
    assert law is not None
    found = tuning_numbers(tuning)["choice"]["recommended"]
    assert found["profile"] == law.start_values()
    assert "max_velocity" not in found["profile"]  # no limit
    rows = dict(table(tuning_blocks(tuning), "Start values of the MotionProfile").rows)
    assert float(rows["duration"]) == pytest.approx(law.duration, rel=5e-4)
    system = System()
    system.add("profile", fmus / "MotionProfile.fmu", found["profile"])
    times = system.simulate(1.1 * law.duration, law.duration / 100.0, record=["profile.position"])
    assert times["profile.position"] == pytest.approx(law.position(times.time), abs=1e-9)
    assert json.dumps(tuning_numbers(tuning), allow_nan=False)


@pytest.mark.parametrize(
    ("value", "deviation", "text"),
    [(10.0, 0.012, "10.000 ± 0.012"), (0.05, 0.0004, "0.05000 ± 0.00040"), (10.0, 0.0, "10"), (10.0, 5e-9, "10 ± 5e-09"), (1.23456789, 1e-8, "1.235 ± 1e-08"), (123.0, 25.0, "123 ± 25")],
)  # fmt: skip
def test_deviations_are_told_to_two_digits(value, deviation, text):
    assert with_deviation(value, deviation) == text


def test_marks_that_would_overlap_share_a_label():
    ends = [(9.0, "9"), (10.0, "nominal"), (11.0, "11")]
    assert apart(ends, 10.0) == [(9.0, "9"), (11.0, "11")]
    assert apart(ends, 5.0) == ends
    assert apart(ends, 100.0) == [(9.0, ""), (11.0, "9 to 11")]
    assert apart([(9.0, "9"), (9.0, "nominal"), (9.0, "9")], 10.0) == [(9.0, "9 rad/s")]
