"""The numbers that the live page shows are those of Python: designs, residual vibration, simulated responses, the papers' examples."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path

import numpy as np
import pytest
from browser import Browser, browser, needs_chromium
from live_states import random_state, remaining, simulated

from shaper_fmu.design.floor import shortest_duration
from shaper_fmu.design.lp.layout import Band
from shaper_fmu.design.profiles import profile
from shaper_fmu.design.pulses import pulses
from shaper_fmu.design.shapers import shaper
from shaper_fmu.design.specified_bands import design
from shaper_fmu.live.floor_table import TABLE
from shaper_fmu.live.page import page_data, plants_of, write_live_page
from shaper_fmu.live.presets import PARTIAL, PWM, S_CURVE, TWO_PART

pytestmark = needs_chromium
NEAR = 1e-9
SHOWN = """(() => {
  const shown = Object.fromEntries([...document.querySelectorAll("#numbers div")].map((tile) => [tile.id.slice(7), tile.querySelector("dd").dataset.value]));
  const r = live.result, list = (values) => Array.from(values);
  return { shown, problem: document.getElementById("problem").hidden ? "" : document.getElementById("problem").textContent,
    stop: r.times.stop, end: r.times.end, sourceEnd: r.times.sourceEnd, delay: r.design.delay, amplitude: r.design.amplitude, truth: r.truth,
    frequency: r.curves.frequency, shaper: r.curves.shaper, whole: r.curves.whole, left: r.left,
    command: list(r.shaped.command), response: list(r.shaped.response), plain: list(r.unshaped.response) };
})()"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A browser with the page."""
    folder = tmp_path_factory.mktemp("live")
    path = write_live_page(folder / "live.html")
    with browser(folder) as chromium:
        chromium.open(path.as_uri())
        chromium.until("globalThis.live && live.result")
        yield chromium


def shown(opened: Browser, state: dict) -> dict:
    opened.run(f"live.take({{ state: {json.dumps(state)}, wrong: [] }})")
    found = opened.run(SHOWN)
    assert found["problem"] == ""
    return found


def command_vibration(state: dict, w: float, zeta: float) -> float:
    """V of the command alone, by Python's design."""
    if state["command"] == "step":
        return 1.0
    mode = state["frequency"][0], state["damping"][0]
    if state["command"].startswith("pulses:"):
        kind = state["command"][7:]
        page_timed = {"carrier", "carrier_polished", "minimax"}
        timed = {"duration": state["duration"]} if kind in page_timed else {}
        return pulses(kind, *mode, frequency_ratio=state["carrier"], **timed).residual_vibration(w, zeta)
    more = {}
    if state["command"] == "s_curve_modes":
        for i, which in enumerate(("second", "third"), 1):
            if len(state["frequency"]) > i:
                more |= {f"{which}_natural_frequency": state["frequency"][i], f"{which}_damping_ratio": state["damping"][i]}
    return profile(state["command"], state["size"], state["duration"], *mode, **more).residual_vibration(w, zeta)


@pytest.mark.representatives(seed=[6, 7])
@pytest.mark.parametrize("seed", range(30))
def test_random_settings_show_what_python_computes(opened, seed):
    plants = plants_of()
    rng = random.Random(seed)
    state = random_state(rng, plants, opened.run("({ commands: live.page.commands, shapers: live.page.shapers })"))
    plant, found = plants[state["plant"]], shown(opened, state)
    own = state["own"]
    sequence = shaper(state["shaper"], state["frequency"], state["damping"], vibration_tolerance=state["tolerance"], **own)
    first = state["frequency"][0], state["damping"][0]
    assert found["delay"] == pytest.approx(sequence.delays, abs=NEAR)
    assert found["amplitude"] == pytest.approx(sequence.amplitudes, abs=NEAR)
    assert float(found["shown"]["delay"]) == pytest.approx(sequence.duration, abs=NEAR)
    width = sequence.insensitivity(*first, state["tolerance"])
    assert float(found["shown"]["insensitivity"]) == pytest.approx(width, abs=NEAR)
    for i in range(0, len(found["frequency"]), 20):
        w = found["frequency"][i]
        alone = sequence.residual_vibration(w, first[1])
        assert found["shaper"][i] == pytest.approx(alone, abs=NEAR)
        assert found["whole"][i] == pytest.approx(alone * command_vibration(state, w, first[1]), abs=NEAR)
    modes = [(w, zeta) for w, zeta in zip(state["frequency"], state["damping"], strict=True)]
    for name, which in (("believed", modes), ("residual", found["truth"])):
        worst = [sequence.residual_vibration(w, zeta) * command_vibration(state, w, zeta) for w, zeta in which]
        if worst:
            assert float(found["shown"][name]) == pytest.approx(max(worst), abs=NEAR)
    commands, responses = simulated(state, plant, found["stop"], shaped=True)
    scale = max(1.0, *map(abs, responses))
    assert found["command"] == pytest.approx(commands, abs=NEAR * max(1.0, *map(abs, commands)))
    assert found["response"] == pytest.approx(responses, abs=NEAR * scale)
    assert float(found["shown"]["remains"]) == pytest.approx(remaining(responses, found["stop"], found["end"]), abs=NEAR * scale)
    if seed % 5 == 0:
        plain = simulated(state, plant, found["stop"], shaped=False)[1]
        assert found["plain"] == pytest.approx(plain, abs=NEAR * max(1.0, *map(abs, plain)))


def test_zvd_for_10_rad_per_s_and_5_percent(opened):
    """Singer and Seering 1990: K = exp(-pi zeta / sqrt(1 - zeta^2)), impulses 1, 2K, K^2 over (1 + K)^2, half a damped period apart."""
    opened.run("document.getElementById('reset').click()")
    found = opened.run(SHOWN)
    root = math.sqrt(1.0 - 0.05**2)
    k, half = math.exp(-math.pi * 0.05 / root), math.pi / (10.0 * root)
    assert found["delay"] == pytest.approx([0.0, half, 2.0 * half], abs=1e-12)
    assert found["amplitude"] == pytest.approx([x / (1.0 + k) ** 2 for x in (1.0, 2.0 * k, k * k)], abs=1e-12)
    assert max(abs(y - 1.0) for t, y in zip(np.linspace(0, 4, 2001), found["response"], strict=True) if t > 2.0 * half) < 1e-12


def preset(opened: Browser, title: str, words: str) -> dict:
    opened.run(
        f"(() => {{ const select = document.getElementById('presets'), all = live.page.presets;"
        f" select.value = all.findIndex((one) => one.title === {json.dumps(f'{title}, {words}')}); select.onchange(); }})()"
    )
    found = opened.run(SHOWN)
    assert found["problem"] == ""
    return found


@pytest.mark.thorough
def test_examples_of_the_pulses_are_those_of_reproduce(opened):
    """The claims' measure is relative to a step at the same time; ZV: jumps at 0 and 0.1374 s, to 0.5698 (eqs. (7) and (8))."""
    from shaper_fmu.reproduce.pwm.runs import CASES, LONG_CASE, SHORT_CASE, train_bench, vibration

    with train_bench() as bench:
        for words, case, ratio in (("0.1374 s", LONG_CASE, 12.0), ("0.1222 s", SHORT_CASE, 13.0)):
            expected = 0.01 * vibration(bench, {**CASES[case], "train.frequency_ratio": ratio})
            assert float(preset(opened, PWM, words)["shown"]["residual"]) == pytest.approx(expected, abs=1e-8)
    found = preset(opened, PWM, "ZV")
    assert [round(t, 4) for t in found["delay"]] == [0.0, 0.1374]
    assert round(found["amplitude"][0], 4) == 0.5698


@pytest.mark.thorough
def test_examples_of_the_s_curve_are_those_of_reproduce(opened):
    """reproduce's runs hold the acceleration over 2880 steps a period, which costs up to 0.004 %."""
    from shaper_fmu.reproduce.s_curve.runs import BeamBench

    with BeamBench() as bench:
        for kind in ("s_curve", "polynomial_345"):
            expected = bench.residuals(kind, 0.8).relative[0]
            assert float(preset(opened, S_CURVE, kind)["shown"]["believed"]) == pytest.approx(expected, abs=4e-5)


@pytest.mark.thorough
def test_examples_in_two_parts_are_those_of_reproduce(opened):
    """reproduce's runs hold the command over 2000 steps: 1e-4 of V, and 1e-6 at the designed frequency."""
    from shaper_fmu.reproduce.two_part.runs import COMMANDS, NATURAL_FREQUENCY, oscillator, vibration

    with oscillator() as bench:
        for name in COMMANDS:
            found = preset(opened, TWO_PART, name)
            assert float(found["shown"]["residual"]) == pytest.approx(vibration(bench, name), abs=2e-6)
            i = int(np.argmin(np.abs(np.array(found["frequency"]) - 1.1 * NATURAL_FREQUENCY)))
            ratio = found["frequency"][i] / NATURAL_FREQUENCY
            assert found["whole"][i] == pytest.approx(vibration(bench, name, ratio), abs=3e-4)


@pytest.mark.thorough
def test_examples_of_three_masses_are_those_of_reproduce(opened):
    """The shaper's impulses, and the response: reproduce couples with order 2 and errs by 1e-6 m; the page acts 8,000 times in 10 s."""
    from shaper_fmu.reproduce.partial_modes.machine import SET_A
    from shaper_fmu.reproduce.partial_modes.runs import PRINTED, Bench

    with Bench() as bench:
        for words, kept in (("mode 1 and 2", (0, 1)), ("mode 1", (0,)), ("mode 2", (1,))):
            case = bench.run(SET_A, tuple(PRINTED[k] for k in kept))
            found = preset(opened, PARTIAL, words)
            assert float(found["shown"]["delay"]) == pytest.approx(case.duration, abs=1e-9)
            time = np.linspace(0.0, found["stop"], len(found["response"]))
            expected = np.interp(time, case.time, case.positions[2])
            assert np.abs(np.array(found["response"]) - expected).max() < 4e-3


def test_the_floor_of_the_page_is_that_of_python(opened):
    """Between the table's points by straight lines: within 3 % where it is steep, as here at EI shapers, which lie on the floor."""
    table = json.loads(TABLE.read_text())
    rng = random.Random(4)
    for _ in range(4):
        i, j = rng.randrange(len(table["tolerances"])), rng.randrange(len(table["insensitivities"]))
        expected = shortest_duration(table["insensitivities"][j], table["tolerances"][i])
        assert table["durations"][i][j] == pytest.approx(expected, abs=1e-5)
    for kind, tolerance in (("ei", 0.05), ("zvd", 0.05), ("two_hump_ei", 0.07), ("zvdd", 0.022)):
        state = opened.run("startState(live.page)") | {"shaper": kind, "tolerance": tolerance, "damping": [0.0]}
        sequence = shaper(kind, 10.0, 0.0, vibration_tolerance=tolerance)
        expected = (
            sequence.duration * 10.0 / (2.0 * math.pi) / shortest_duration(sequence.insensitivity(10.0, 0.0, tolerance), tolerance)
        )
        assert float(shown(opened, state)["shown"]["floor"]) == pytest.approx(expected - 1.0, abs=0.03)


def test_the_distance_to_the_floor_of_several_modes_is_an_upper_bound(opened):
    """That from the longest floor of one mode, and at least that from the floor of all bands together (a linear programme)."""
    for kind, modes in (("zvd", (10.0, 23.0)), ("ei", (6.0, 17.0)), ("zv", (10.0, 14.0))):
        state = opened.run("startState(live.page)") | {"shaper": kind, "frequency": [*modes], "damping": [0.0, 0.0]}
        sequence, found = shaper(kind, [*modes]), float(shown(opened, state)["shown"]["floor"])
        widths = [sequence.insensitivity(w, 0.0, 0.05) for w in modes]
        assert opened.run("live.result.curves.widths") == pytest.approx(widths, abs=NEAR)
        singles = [2.0 * math.pi / w * shortest_duration(width, 0.05) for w, width in zip(modes, widths, strict=True)]
        assert found == pytest.approx(sequence.duration / max(singles) - 1.0, abs=0.03)
        bands = [Band(w * (1.0 - 0.5 * width), w * (1.0 + 0.5 * width), 0.05) for w, width in zip(modes, widths, strict=True)]
        assert found > sequence.duration / design(bands).duration - 1.0 - 0.03
        assert "at most" in opened.run("document.querySelector('#number-floor dd').textContent")


def test_all_choices_are_there():
    """All profiles but those that have to be designed by optimisation first, all pulse trains and all shapers but custom ones."""
    from shaper_fmu.kinds.profiles import PROFILES
    from shaper_fmu.kinds.pulses import PULSES
    from shaper_fmu.kinds.shapers import Shaper

    plants = plants_of()
    page = page_data(plants, "MassSpringDamper")
    step, profiles, trains = ([value for value, _ in group["items"]] for group in page["commands"])
    assert [*step, *profiles] == [name for name in PROFILES if name != "fastest"]
    assert trains == [f"pulses:{name}" for name in PULSES]
    assert {value for value, _ in page["shapers"]} == {item.name for item in Shaper if item.name != "custom"}
    assert list(plants) == ["MassSpringDamper", "OverheadCrane", "FlexibleBeam", "ThreeMassChain"]


def test_the_page_is_small(tmp_path):
    path: Path = write_live_page(tmp_path / "live.html")
    assert path.stat().st_size < 1_000_000
