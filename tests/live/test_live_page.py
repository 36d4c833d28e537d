"""The live page in a browser: it loads without a network, every control does what it says, by mouse, keyboard and finger."""

from __future__ import annotations

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from browser import Browser, browser, needs_chromium
from command_line import typed

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.design.shapers import shaper
from shaper_fmu.live.firmwares import kind_of
from shaper_fmu.live.page import write_live_page
from shaper_fmu.machines.settings import FIRMWARE

pytestmark = needs_chromium
OWN = '''\
"""A drive of one's own."""

from shaper_fmu.component import Component, Input, Output, Parameter, State


class Drive(Component):
    """First order: T v' + v = u."""

    setpoint = Input("m/s", "speed wanted")
    time_constant = Parameter(0.2, "s", "time constant", min=0.0, exclusive=True)
    speed = Output("m/s", "speed")

    def step(self, t, h):
        n = 4
        for _ in range(n):
            self.speed += h / n * (self.setpoint - self.speed) / self.time_constant
'''


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    return write_live_page(tmp_path_factory.mktemp("page") / "live.html")


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


def opened(chromium: Browser, page: Path, hash_: str = "", **window) -> Browser:
    chromium.open(page.as_uri() + hash_, **window)
    chromium.until("globalThis.live !== undefined && live.result !== undefined")
    return chromium


def state(chromium: Browser) -> dict:
    return chromium.run("live.state")


PICTURES = "['impulses', 'sensitivity', 'command', 'response'].map((key) => JSON.stringify(live.charts[key].plot.data) + JSON.stringify(live.charts[key].extras))"


def numbers_of(kept: dict) -> list[float]:
    """All numbers of a state."""
    return [x for value in kept.values() for x in (value if isinstance(value, list) else [value]) if isinstance(x, int | float)]


def pictures(chromium: Browser) -> dict[str, str]:
    return dict(zip(("impulses", "sensitivity", "command", "response"), chromium.run(PICTURES), strict=True))


def select(chromium: Browser, name: str, value: str) -> None:
    """As a user does: the choice, then the browser's event."""
    element = f"document.getElementById({json.dumps(name)})"
    chromium.run(f"{element}.value = {json.dumps(value)}; {element}.dispatchEvent(new Event('change', {{ bubbles: true }}))")
    assert chromium.run(f"{element}.value") == value


def changed(chromium: Browser, before: dict[str, str]) -> set[str]:
    return {key for key, drawn in pictures(chromium).items() if drawn != before[key]}


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [1400, 400])
def test_it_loads_from_a_file_without_complaint_or_network(chromium, page, width, dark):
    opened(chromium, page, width=width, height=900, dark=dark, touch=width == 400)
    assert chromium.console == []
    assert chromium.requests == []
    assert chromium.run("document.documentElement.scrollWidth - innerWidth") == 0
    assert chromium.run("getComputedStyle(document.body).backgroundColor") == ("rgb(21, 24, 28)" if dark else "rgb(255, 255, 255)")
    drawn = "[...document.querySelectorAll('.chart canvas')].map((c) => new Set(c.getContext('2d').getImageData(0, 0, c.width, c.height).data).size)"
    assert all(colours > 20 for colours in chromium.run(drawn))
    assert len(chromium.run(drawn)) == 4


def test_it_names_nothing_to_load(page):
    loaded: list[str] = []

    class Page(HTMLParser):
        def handle_starttag(self, tag, attrs):
            loaded.extend(value for name, value in attrs if name in ("src", "href", "srcset", "data") and value)

    Page().feed(page.read_text())
    assert loaded == []
    assert "default-src 'none'" in page.read_text()


SLIDERS = {
    "size": {"command", "response"},
    "tolerance": {"sensitivity"},
    "frequency-1": {"impulses", "sensitivity", "command", "response"},
    "damping-1": {"impulses", "sensitivity", "command", "response"},
    "plant-0": {"response", "sensitivity"},
    "plant-1": {"response"},
    "plant-2": {"response", "sensitivity"},
}
"""What each slider changes, at the start: a ZVD shaper, a step, a mass."""


@pytest.mark.parametrize("key", SLIDERS)
def test_a_slider_moved_by_keys_changes_what_it_should(chromium, page, key):
    opened(chromium, page)
    before, was = pictures(chromium), state(chromium)
    chromium.run(f"document.getElementById('slider-{key}').focus()")
    for _ in range(3):
        chromium.key("ArrowRight")
    assert changed(chromium, before) == SLIDERS[key]
    assert state(chromium) != was
    assert float(chromium.run(f"document.getElementById('slider-{key}-number').value")) in numbers_of(state(chromium))


def test_a_profile_has_its_sliders(chromium, page):
    opened(chromium, page)
    select(chromium, "command", "cycloid")
    for key, expected in (("size", {"command", "response"}), ("duration", {"command", "response", "sensitivity"})):
        before = pictures(chromium)
        chromium.run(f"document.getElementById('slider-{key}').focus()")
        chromium.key("ArrowLeft")
        assert changed(chromium, before) == expected
    select(chromium, "command", "pulses:carrier")
    before = pictures(chromium)
    chromium.run("document.getElementById('slider-carrier').focus()")
    for _ in range(20):
        chromium.key("ArrowRight")
    assert changed(chromium, before) == {"command", "response", "sensitivity"}


def test_choices_change_what_they_should(chromium, page):
    opened(chromium, page)
    for name, value, expected in (
        ("shaper", "ei", {"impulses", "sensitivity", "command", "response"}),
        ("command", "cycloid", {"sensitivity", "command", "response"}),
        ("modes", "2", {"impulses", "sensitivity", "command", "response"}),
        ("output", "1", {"response"}),
        ("plant", "OverheadCrane", {"sensitivity", "command", "response"}),
    ):
        before = pictures(chromium)
        select(chromium, name, value)
        assert changed(chromium, before) == expected, name
    assert chromium.run("document.querySelectorAll('#mode-sliders .slider').length") == 4
    chromium.run("document.getElementById('believe').click()")
    assert state(chromium)["frequency"] == [pytest.approx((9.81 / 5.0) ** 0.5, rel=1e-5)]
    assert chromium.console == []


def test_a_slider_is_dragged_with_the_mouse_and_with_a_finger(chromium, page):
    opened(chromium, page, width=400, height=850, touch=True)
    x, y, width, height = chromium.box("#slider-frequency-1")
    middle = y + height / 2
    was = state(chromium)["frequency"][0]
    chromium.touch((x + width * 0.5, middle), (x + width * 0.8, middle))
    assert state(chromium)["frequency"][0] > 2.0 * was
    opened(chromium, page)
    x, y, width, height = chromium.box("#slider-frequency-1")
    chromium.drag((x + width * 0.5, y + height / 2), (x + width * 0.2, y + height / 2))
    assert state(chromium)["frequency"][0] < 0.5 * was
    assert len(chromium.run("live.took")) > 3  # redrawn on the way, not at its end alone


def test_a_chart_zooms_shows_values_and_hides_lines_by_keys_and_mouse(chromium, page):
    opened(chromium, page)
    scale = "(({ min, max }) => [min, max])(live.charts.response.plot.scales.x)"
    whole = chromium.run(scale)
    x, y, width, height = chromium.box("#chart-response .u-over")
    chromium.drag((x + width * 0.2, y + height / 2), (x + width * 0.6, y + height / 2))
    zoomed = chromium.run(scale)
    assert whole[0] < zoomed[0] < zoomed[1] < whole[1]
    chromium.run("document.getElementById('slider-damping-1').focus()")
    chromium.key("ArrowRight")
    assert chromium.run(scale) == zoomed  # a zoom stays while a slider moves
    chromium.run("document.querySelector('#chart-response .u-over').focus()")
    chromium.key("Escape")
    assert chromium.run(scale) == whole
    chromium.key("ArrowRight")
    chromium.until("/\\d/.test(document.querySelector('#chart-response .u-legend .u-value').textContent)")
    chromium.run("document.querySelectorAll('#chart-response .u-legend th')[2].focus()")
    chromium.key("Enter")
    assert chromium.run("live.charts.response.plot.series.map((s) => s.show)") == [True, True, False]


def test_everything_is_reached_by_the_tab_key(chromium, page):
    opened(chromium, page)
    reached = []
    for _ in range(60):
        chromium.key("Tab")
        reached.append(
            chromium.run("document.activeElement.id || document.activeElement.className || document.activeElement.textContent")
        )
    wanted = {
        "presets",
        "reset",
        "link",
        "copy-as",
        "copy",
        "command",
        "shaper",
        "modes",
        "believe",
        "plant",
        "output",
        "slider-frequency-1",
        "u-over",
    }
    assert wanted <= set(reached)
    assert reached.count("u-over") == 4


def test_a_link_holds_the_state(chromium, page):
    opened(chromium, page)
    select(chromium, "shaper", "ei")
    select(chromium, "modes", "2")
    select(chromium, "command", "two_part")
    select(chromium, "plant", "FlexibleBeam")
    chromium.run("live.keepHash()")
    link, kept = chromium.run("location.hash"), state(chromium)
    shown = chromium.run("document.getElementById('numbers').textContent")
    opened(chromium, page, link)
    assert state(chromium) == kept
    assert chromium.run("document.getElementById('numbers').textContent") == shown
    assert chromium.run("document.getElementById('said').textContent") == ""


def test_a_link_holds_every_example(chromium, page):
    opened(chromium, page)
    count = chromium.run("live.page.presets.length")
    assert count > 8
    for i in range(count):
        select(chromium, "presets", str(i))
        again = chromium.run("stateOf(hashOf(live.state), live.page)")
        assert again == {"state": state(chromium), "wrong": []}


def test_a_link_that_is_wrong_says_so(chromium, page):
    opened(chromium, page, "#shaper=zvv&modes=10,2&plant=Rocket&tolerance=7&size=0.5")
    said = chromium.run("document.getElementById('said').textContent")
    for words in ("shaper zvv", "modes 10,2", "plant Rocket", "tolerance 7"):
        assert words in said
    assert state(chromium)["size"] == 0.5
    assert state(chromium)["shaper"] == "zvd"


def test_what_is_not_possible_is_said_and_the_former_picture_stays(chromium, page):
    """A cycloid with a cruise leaves a mode at rest only if it takes longer than its period, here 2 pi / 5 s."""
    opened(chromium, page)
    before = pictures(chromium)
    chromium.run("live.change({ command: 'cycloid_cruise', frequency: [5], damping: [0] }, true)")
    assert "duration" in chromium.run("document.getElementById('problem').textContent")
    assert not chromium.run("document.getElementById('problem').hidden")
    assert pictures(chromium) == before
    chromium.run("live.change({ duration: 3 }, true)")
    assert chromium.run("document.getElementById('problem').hidden")


def copied(chromium: Browser, kind: str) -> str:
    select(chromium, "copy-as", kind)
    return chromium.run("live.copyText()")


@pytest.mark.parametrize("command", ["step", "cycloid", "pulses:carrier"])
def test_what_is_copied_is_understood(chromium, page, command, tmp_path, capsys):
    opened(chromium, page, f"#command={command}&shaper=ei&modes=8,0.05;21,0.02&tolerance=0.04")
    duration = chromium.run("live.result.design.duration")
    exec(compile(copied(chromium, "python"), "copied", "exec"), {})
    assert float(capsys.readouterr().out.split()[0]) == pytest.approx(duration, abs=1e-12)
    for line in copied(chromium, "command").splitlines():
        done = typed(*line.split()[1:], cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert f"{duration:.4f}"[:5] in typed(*copied(chromium, "command").splitlines()[0].split()[1:], cwd=tmp_path).stdout
    rows = [line.split(",") for line in copied(chromium, "csv").splitlines()[1:]]
    assert [float(row[0]) for row in rows] == chromium.run("live.result.design.delay")
    assert sum(float(row[1]) for row in rows) == pytest.approx(1.0, abs=1e-12)


def test_the_parameter_set_gives_the_same_shaper(chromium, page):
    from shaper_fmu.ssp.files import Files
    from shaper_fmu.ssp.findings import Findings
    from shaper_fmu.ssp.read import read_parameter_set

    opened(chromium, page, "#shaper=two_hump_ei&modes=8,0.05;21,0.02&tolerance=0.04")
    found = Files({"live.ssv": copied(chromium, "ssv").encode()}, Findings()).read("live.ssv", read_parameter_set)
    assert found is not None
    plain = InputShaper()
    for one in found.parameters:
        plain.set(one.name, one.value if one.type == "Enumeration" else float(one.value or "nan"))
    plain.initialize(0.0)
    assert plain.duration == pytest.approx(chromium.run("live.result.design.duration"), abs=1e-12)


@pytest.mark.parametrize("name", FIRMWARE)
def test_settings_of_firmwares_are_those_that_tune_writes(chromium, page, name):
    """The lines by `machines`; and of zv, zvd and mzv the firmware makes the impulses that the page shows (Marlin's within its roundings)."""
    firmware, hertz, text = FIRMWARE[name], 31.415926, ""
    opened(chromium, page)
    for one in firmware.shapers:
        kind = kind_of(one)
        heavy = 0.22 if "hump" in kind else 0.45  # which the page's own still takes
        for w, zeta in ((2.0 * math.pi * hertz, 0.1), (2.0 * math.pi * 25.0, 0.0213), (300.0, heavy)):
            chromium.run(f"live.change({{ shaper: '{kind}', frequency: [{w!r}], damping: [{zeta}] }}, true)")
            text = copied(chromium, name)
            setting = firmware.setting(one, w / (2.0 * math.pi), zeta)
            assert setting is not None
            lines = [line for line in text.splitlines() if not line.startswith(firmware.comment)]
            assert lines == firmware.lines("x", setting).splitlines()
            assert ("the nearest is" in text) == (setting.damping_ratio != zeta)
            if kind in ("zv", "zvd", "mzv") and setting.damping_ratio == zeta and zeta < 0.2 and not name.startswith("marlin"):
                assert list(setting.sequence.delays) == pytest.approx(chromium.run("live.result.design.delay"), rel=1e-5, abs=1e-9)
    assert f"tune --for {name}" in text


def test_what_a_firmware_cannot_is_said(chromium, page):
    opened(chromium, page, "#shaper=zvddd&modes=8,0.05;21,0.02&tolerance=0.04")
    assert copied(chromium, "klipper") == "# Klipper has no shaper zvddd; it has zv, mzv, zvd, ei, two_hump_ei, three_hump_ei.\n"
    assert copied(chromium, "reprapfirmware") == "; RepRapFirmware takes 7.2 to 1000 Hz, not 1.27324 Hz.\n"
    select(chromium, "shaper", "ei")
    text = copied(chromium, "kalico")
    assert "# For the first mode alone: its shaper is for one mode of one axis." in text
    assert "# Kalico's EI shapers are for a tolerance of 5 %." in text


@pytest.mark.parametrize(
    ("kind", "name", "value"), [("sna_zv", "negative_amplitude", 0.3), ("miszv", "equal_impulses", 5)], ids=["sna_zv", "miszv"]
)
def test_a_shapers_own_parameter_has_a_slider_and_is_copied(chromium, page, kind, name, value, tmp_path, capsys):
    opened(chromium, page, f"#shaper={kind}&modes=8,0.05")
    assert chromium.run("document.querySelectorAll('#shaper-sliders .slider').length") == 1
    before = pictures(chromium)
    number = f"document.getElementById('slider-{name}-number')"
    chromium.run(f"{number}.value = {value}; {number}.dispatchEvent(new Event('input'))")
    assert changed(chromium, before) == {"impulses", "sensitivity", "command", "response"}
    expected = shaper(kind, 8.0, 0.05, **{name: value})
    assert chromium.run("live.result.design.delay") == pytest.approx(expected.delays, abs=1e-12)
    assert chromium.run("live.result.design.amplitude") == pytest.approx(expected.amplitudes, abs=1e-12)
    exec(compile(copied(chromium, "python"), "copied", "exec"), {})
    assert float(capsys.readouterr().out.split()[0]) == pytest.approx(expected.duration, abs=1e-12)
    done = typed(*copied(chromium, "command").split()[1:], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"{expected.duration:.4f}"[:5] in done.stdout
    assert f'name="{name}"' in copied(chromium, "ssv")
    again = chromium.run("stateOf(hashOf(live.state), live.page)")
    assert again == {"state": state(chromium), "wrong": []}
    assert state(chromium)["own"] == {name: value}
    opened(chromium, page, f"#shaper={kind}&{name}=99")
    assert f"{name} 99" in chromium.run("document.getElementById('said').textContent")
    select(chromium, "shaper", "zvd")
    assert chromium.run("document.querySelectorAll('#shaper-sliders .slider').length") == 0


def test_a_component_of_ones_own_is_a_plant(chromium, tmp_path):
    """T v' + v = u: after a long time at the command's end the speed is the command's."""
    (tmp_path / "drive.py").write_text(OWN)
    done = typed("live", "--plant", "drive.py", "--output", "own.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.search(r"own\.html: \d{3} kB", done.stdout.replace("\n", ""))
    opened(chromium, tmp_path / "own.html")
    assert state(chromium)["plant"] == "Drive"
    assert chromium.run("document.querySelector('#plant-sliders label').textContent") == "time constant"
    assert chromium.run("live.result.shaped.response.at(-1)") == pytest.approx(1.0, abs=1e-6)
    before = pictures(chromium)
    chromium.run("document.getElementById('slider-plant-0').focus()")
    chromium.key("ArrowRight")
    assert changed(chromium, before) == {"response"}
    assert chromium.console == []


def test_what_has_no_slider_is_named():
    """HydraulicPendulum has more parameters than there are sliders, and its start values are what the page computes with."""
    from shaper_fmu.live.plants import plant_of
    from shaper_fmu.registry import find_component

    plant = plant_of(find_component("HydraulicPendulum"))
    known = {v.name for v in plant.component.variables.values() if v.causality == "parameter"}
    assert len(plant.sliders) == 12 < len(known)
    assert all(name in plant.note for name in known - {slider.name for slider in plant.sliders})


def test_wrong_plants_and_outputs_are_refused(tmp_path):
    for name in ("drive.py", "other.py"):
        (tmp_path / name).write_text(OWN)
    for arguments, words in (
        (("--plant", "MassSpringDampr"), "MassSpringDamper"),
        (("--plant", "OperatorPanel"), "no real input"),
        (("--plant", "InputShaper"), "part of the page itself"),
        (("--plant", "drive.py", "--plant", "other.py"), "two plants are called Drive"),
        (("--plant", "missing.py"), "missing.py"),
        (("--output", "live.txt"), "live.txt"),
    ):
        done = typed("live", *arguments, cwd=tmp_path)
        assert done.returncode == 2
        assert words in done.stderr.replace("\n", " ")
