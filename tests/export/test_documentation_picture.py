"""The documentation pages: docstrings set as paragraphs, lists and equations, and the picture of what a component does."""

from __future__ import annotations

import builtins
import inspect
import itertools
import math

import matplotlib
import pytest
from conftest import gain_component
from lxml import etree

from shaper_fmu.component import NO_EVENT, Component, Input, Output, Parameter, time_tolerance
from shaper_fmu.errors import ArgumentError
from shaper_fmu.export.documentation import docstring_blocks, documentation_page, live_command, marked_up
from shaper_fmu.export.picture import INTERVALS, STEP_AT, Recording, behaviour_picture, record
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.live.page import plants_of
from shaper_fmu.registry import components, find_component

every_component = pytest.mark.parametrize("name", components())
SVG = "{http://www.w3.org/2000/svg}"


def picture_of(component: type[Component]) -> etree._Element:
    picture = behaviour_picture(component)
    assert picture is not None
    return etree.fromstring(picture.svg)


def texts(svg: etree._Element) -> list[str]:
    return ["".join(element.itertext()).strip() for element in svg.iter(f"{SVG}text")]


@every_component
def test_every_component_has_a_small_picture_with_title_axes_and_legend(name):
    component = components()[name]
    picture = behaviour_picture(component)
    assert picture is not None
    assert len(picture.svg.encode()) <= 60_000
    shown = texts(etree.fromstring(picture.svg))
    assert {f"{name}: outputs over time", "time [s]"} <= set(shown)
    outputs = [v for v in component.variables.values() if v.causality == "output" and v.name != "next_event_time"]
    for variable in outputs:
        assert set(variable.scalar_names) <= set(shown)
        if variable.kind is not bool:
            assert (f"[{variable.display_unit or variable.unit}]" if variable.unit else "no unit") in shown
    assert "next_event_time" not in shown


@every_component
def test_pages_are_the_same_to_the_byte_whatever_the_users_style(name):
    component = components()[name]
    salt = matplotlib.rcParams["svg.hashsalt"]
    before = documentation_page(component)
    with matplotlib.rc_context({"lines.linewidth": 7.0, "axes.grid": True, "svg.fonttype": "path", "font.size": 20.0}):
        assert documentation_page(component) == before
    assert matplotlib.rcParams["svg.hashsalt"] == salt


@every_component
def test_a_page_holds_its_picture_as_one_element_without_foreign_parts(name):
    page = etree.HTML(documentation_page(components()[name]))
    pictures = page.findall(".//figure/svg")
    assert len(pictures) == 1
    assert len(page.findall(".//figcaption")) == 1
    assert page.find(".//metadata") is None
    assert page.find(".//image") is None
    references = [value for e in page.iter() for key, value in e.attrib.items() if key.endswith(("href", "src"))]
    assert all(value.startswith("#") for value in references)
    ids = [e.get("id") for e in page.iter() if e.get("id")]
    assert len(ids) == len(set(ids))


def recorded(component: type[Component], span: float, size: float = 0.5) -> tuple[Recording, list[float]]:
    recording = record(component, span, size)
    assert all(len(values) == len(recording.times) for values in recording.series.values())
    return recording, recording.times


def test_a_recording_is_the_step_response():
    """Of an undamped oscillator the closed form is x = (F/k) (1 - cos(wn (t - t0))); here with damping c = 1, m = 1, k = 100."""
    recording, times = recorded(components()["MassSpringDamper"], 2.0)
    start = 2.0 * STEP_AT / INTERVALS
    decay, damped = 0.5, math.sqrt(100.0 - 0.25)
    for t, position in zip(times, recording.series["position"], strict=True):
        s = max(0.0, t - start)
        expected = 0.005 * (1.0 - math.exp(-decay * s) * (math.cos(damped * s) + decay / damped * math.sin(damped * s)))
        assert position == pytest.approx(expected, abs=1e-12)
    assert recording.steps == {"force": 0.5}
    assert recording.series["force"][0] == 0.0
    assert recording.series["force"][-1] == 0.5


def test_a_recording_has_both_sides_of_a_jump_at_its_time():
    """A ZV shaper of wn = 10 rad/s without damping: two impulses of one half, pi/10 apart (Smith 1958)."""
    recording, times = recorded(components()["InputShaper"], 0.5)
    start = 0.5 * STEP_AT / INTERVALS
    points = list(zip(times, recording.series["shaped"], strict=True))
    jumps = [(a[0], b[0], b[1] - a[1]) for a, b in itertools.pairwise(points) if a[1] != b[1]]
    assert [left == right for left, right, _ in jumps] == [True, True]
    assert [left for left, _, _ in jumps] == pytest.approx([start, start + math.pi / 10.0])
    assert [size for _, _, size in jumps] == pytest.approx([0.25, 0.25])


def test_inputs_step_by_halves_so_that_they_do_not_cancel():
    recording, _ = recorded(components()["PositionController"], 1.0)
    assert recording.steps == {"reference": 0.5, "position": 0.25, "velocity": 0.125}


class Fragile(Component):
    """Stands inputs up to a limit."""

    level = Input("", "level")
    limit = Parameter(0.2, "", "what it stands")
    root = Output("", "root of what is left")

    def step(self, t, h):
        self.root = math.sqrt(self.limit - self.level)


def test_a_smaller_step_is_tried_where_the_kernel_refuses_a_larger_one():
    picture = behaviour_picture(Fragile)
    assert picture is not None
    assert "level to 0.1." in picture.caption


def test_without_a_run_there_is_a_page_without_a_picture():
    delicate = type("Delicate", (Fragile,), {"limit": Parameter(0.0, "", "what it stands")})
    assert behaviour_picture(delicate) is None
    page = documentation_page(delicate)
    assert "<figure>" not in page
    assert "Behaviour" not in page


def test_without_matplotlib_there_is_a_page_without_a_picture(monkeypatch):
    present = builtins.__import__

    def absent(name, *arguments, **options):
        if name.partition(".")[0] == "matplotlib":
            raise ImportError(name)
        return present(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", absent)
    page = documentation_page(components()["MassSpringDamper"])
    monkeypatch.undo()
    assert "<figure>" not in page
    assert documentation_page(components()["MassSpringDamper"]).count("<figure>") == 1


class Clock(Component):
    """A fast square wave: changes its sign every millisecond."""

    angle = Output("rad", "a turn each second", display_unit="deg")
    wave = Output("V", "square wave")
    next_event_time = Output("s", "next change of sign", start=NO_EVENT)

    def step(self, t, h):
        now = t + h + time_tolerance(self, t, h)
        passed = math.floor(now * 1000.0)
        self.angle = 2.0 * math.pi * (t + h)
        self.wave = 1.0 if passed % 2 == 0 else -1.0
        self.next_event_time = (passed + 1) / 1000.0


def test_the_time_is_cut_where_there_would_be_too_much_to_see():
    """At most 24 reversals fit in: 24 ms of the wave, and the next round number."""
    svg = picture_of(Clock)
    ticks = [float(text) for text in texts(svg) if text.replace(".", "").isdigit()]
    assert 0.02 in ticks
    assert "[deg]" in texts(svg)
    assert "[V]" in texts(svg)


def test_a_list_in_a_docstring_becomes_a_list():
    text = inspect.cleandoc("""
        What it does, in
        two lines.

        - one;
        - two, which goes
          on here;
        - three.

            y = x

        The end:
        - also without an empty line.
        """)
    assert docstring_blocks(text) == [
        ("text", ["What it does, in two lines."]),
        ("list", ["one;", "two, which goes on here;", "three."]),
        ("display", ["y = x"]),
        ("text", ["The end:"]),
        ("list", ["also without an empty line."]),
    ]


@pytest.mark.parametrize(("name", "choice"), [("MotionProfile", "profile"), ("InputShaper", "shaper"), ("PulseTrain", "design")])
def test_the_methods_are_a_list_on_the_page(name, choice):
    component = components()[name]
    page = etree.HTML(documentation_page(component))
    items = ["".join(item.itertext()).split(":")[0] for item in page.findall(".//ul/li")]
    assert sorted(items) == sorted(component.variables[choice].kind.__members__)  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize(
    ("line", "equations"),
    [
        ("Mass on a spring: m x'' + c x' + k x = F, from rest.", ["m x'' + c x' + k x = F"]),
        ("l' = -hoist_speed, with w0 = sqrt(g / l0) of the rope.", ["l' = -hoist_speed", "w0 = sqrt(g / l0)"]),
        ("so a + b cos theta = 0 holds in a while", ["a + b cos theta = 0"]),
        ("No equation is here, a < b or not.", []),
        ("ends in x =", []),
    ],
)
def test_equations_are_set_apart_from_words(line, equations):
    shown = etree.HTML(f"<p>{marked_up(line)}</p>")
    assert ["".join(e.itertext()) for e in shown.iter("span")] == equations
    assert "".join(shown.itertext()) == line


def test_names_between_backticks_and_special_characters():
    assert str(marked_up("from `start` if x<y & z")) == 'from <span class="name">start</span> if x&lt;y &amp; z'


def test_the_page_tells_how_to_see_it_move(tmp_path):
    """What it tells is what `live` takes: plants_of refuses what cannot be a plant."""
    for name, component in components().items():
        command = live_command(component)
        assert (f"<code>{command}</code>" in documentation_page(component)) == bool(command)
        if command.startswith("shaper-fmu live --plant "):
            assert name in plants_of([find_component(command.split()[-1])])
        elif command:
            with pytest.raises(ArgumentError, match="is a part of the page itself"):
                plants_of([component])
        else:
            with pytest.raises(ArgumentError, match="has no real input"):
                plants_of([component])
    assert live_command(gain_component(tmp_path, 2.0)) == "shaper-fmu live --plant gain.py"
    assert live_command(with_start_values(find_component("InputShaper"), {"shaper": "zvd"}, "Zvd")) == "shaper-fmu live"
