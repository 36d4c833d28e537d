"""The chart that pages carry, in a browser: lines with times of their own, two axes, symbols, logarithms, downloads, print."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from browser import Browser, browser, needs_chromium

from shaper_fmu.page.chart import chart_script, chart_style
from shaper_fmu.page.figures import Figure

pytestmark = needs_chromium
OPTIONS = """{ title: "two", x: "time [s]", y: "position [m]", right: "swing [rad]", logX: true, lines: [
  { name: "slide" }, { name: 'swing "of" it', right: true }, { name: "measured", symbols: true }] }"""


@pytest.fixture(scope="module")
def chart(tmp_path_factory):
    """A page with one chart, in a browser."""
    folder: Path = tmp_path_factory.mktemp("chart")
    page = folder / "chart.html"
    page.write_text(
        f"<!DOCTYPE html><html class='with-dark'><head><meta charset='utf-8'><style>{chart_style()}</style></head><body><div id='c'></div>"
        f"<script>{chart_script()}</script><script>var chart = new Chart(document.getElementById('c'), {OPTIONS});"
        "chart.draw([[1, 2, 4], [1, 3, 10], [2, 5]], [[0.5, 1, 0], [-0.1, 0.1, 0], [0.9, 0.2]],"
        "{ levels: [[0.7, 'limit']], marks: [[3, 'event']], bands: [[1, 2]] });</script></body></html>"
    )
    with browser(folder) as chromium:
        chromium.open(page.as_uri(), width=700, height=500)
        chromium.until("chart.plot.data[0].length === 6")
        yield chromium
        assert [said for said in chromium.console if "willReadFrequently" not in said] == []  # that is of the tests


def test_lines_with_times_of_their_own_share_an_axis(chart: Browser):
    """uPlot wants one row of times: all of them, rising, with nothing where a line has no value."""
    assert chart.run("chart.plot.data[0]") == [1, 2, 3, 4, 5, 10]
    rows = chart.run("chart.plot.data.slice(1).map((row) => row.map((y) => y === undefined ? null : y))")
    assert rows == [[0.5, 1, None, 0, None, None], [-0.1, None, 0.1, None, None, 0], [None, 0.9, None, None, 0.2, None]]
    left, right = chart.run("['y', 'right'].map((key) => [chart.plot.scales[key].min, chart.plot.scales[key].max])")
    assert left == pytest.approx([0.0, 1.06])  # with 0 and a little room; the swing is not of this axis
    assert right == pytest.approx([-0.112, 0.112])


def test_the_horizontal_axis_is_logarithmic(chart: Browser):
    places = chart.run("[1, 10].map((x) => chart.plot.valToPos(x, 'x'))")
    middle = chart.run(f"chart.plot.valToPos({math.sqrt(10.0)}, 'x')")
    assert middle == pytest.approx(0.5 * sum(places), abs=1.5)


def test_the_table_has_every_value(chart: Browser):
    text = chart.run("new Promise((done) => { chart.save = (blob) => blob.text().then(done); chart.saveTable(); })")
    assert text.splitlines() == [
        '"time [s]","slide","swing ""of"" it","measured"', "1,0.5,-0.1,", "2,1,,0.9", "3,,0.1,", "4,0,,", "5,,,0.2", "10,,0,",
    ]  # fmt: skip


def test_the_picture_is_a_png_of_the_lines_that_are_shown(chart: Browser):
    size = "new Promise((done) => { chart.save = (blob, ending) => blob.arrayBuffer().then((b) => done([ending, [...new Uint8Array(b).slice(0, 4)], b.byteLength])); chart.savePicture(); })"
    ending, magic, length = chart.run(size)
    assert (ending, magic) == ("png", [0x89, 0x50, 0x4E, 0x47])
    assert length > 3000
    chart.run("chart.plot.setSeries(1, { show: false }); chart.plot.setSeries(2, { show: false })")
    assert chart.run(size)[2] < length
    chart.run("chart.plot.setSeries(1, { show: true }); chart.plot.setSeries(2, { show: true })")


def test_lines_differ_without_colours(chart: Browser):
    """Each line's sample beside its name, with the colours taken away."""
    samples = chart.run("[...document.querySelectorAll('.u-legend svg')].map((s) => s.innerHTML.replace(/var\\([^)]*\\)/g, ''))")
    assert len(set(samples)) == 3


@pytest.mark.parametrize("dark", [False, True])
def test_colours_stand_out_from_the_paper(chart: Browser, dark):
    """WCAG 2.1, 1.4.11: a contrast of 3 for graphics."""
    paper = (0x15, 0x18, 0x1C) if dark else (255, 255, 255)

    def luminance(rgb: tuple[int, ...]) -> float:
        linear = [c / 255 / 12.92 if c / 255 <= 0.04045 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in rgb]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for colour in chart.run(f"CHART_COLOURS.{'dark' if dark else 'light'}"):
        rgb = tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))
        low, high = sorted((luminance(rgb), luminance(paper)))
        assert (high + 0.05) / (low + 0.05) > 3.0, colour


def drawn_alone(chromium: Browser, lines: str, data: str, extras: str = "{}") -> None:
    """Another chart of the page, as `other`."""
    options = f"{{ title: 'other', x: 'x', y: 'y', whole: true, height: 200, lines: {lines} }}"
    chromium.run(
        "globalThis.other?.element.remove(); globalThis.other = new Chart(document.body.appendChild(document.createElement('div')), "
        f"{options}); other.draw({data}, {extras}); new Promise((done) => setTimeout(done, 60))"
    )


def ink(chromium: Browser, x: float, y: float, reach: int = 3) -> bool:
    """Whether something coloured is drawn near a place of the other chart: not grey, as its grid is."""
    return chromium.run(
        f"(() => {{ const u = other.plot; const [a, b] = [u.valToPos({x}, 'x', true), u.valToPos({y}, 'y', true)];"
        f"const d = u.ctx.getImageData(a - {reach}, b - {reach}, {2 * reach + 1}, {2 * reach + 1}).data;"
        "for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 200 && Math.max(d[i], d[i + 1], d[i + 2]) - Math.min(d[i], d[i + 1], d[i + 2]) > 60) return true;"
        "return false; })()"
    )


def test_a_jump_stays_upright_beside_a_line_with_other_times(chart: Browser):
    """A line that has a time twice jumps there; the other one has values between."""
    drawn_alone(
        chart,
        "[{ name: 'jump' }, { name: 'ramp' }]",
        "[[0, 1, 1, 2], [0, 0.5, 1, 1.5, 2]], [[0, 0, 1, 1], [0.2, 0.2, 0.2, 0.2, 0.2]]",
    )
    assert chart.run("other.plot.data[0]") == [0, 0.5, 1, 1, 1.5, 2]
    assert ink(chart, 1.0, 0.6)  # on the jump
    assert not ink(chart, 1.25, 0.6)
    assert not ink(chart, 0.75, 0.75)


def test_a_gap_is_not_bridged(chart: Browser):
    """Also where another line has values beside the gap."""
    drawn_alone(
        chart,
        "[{ name: 'gap' }, { name: 'other' }]",
        "[[0, 1, 2, 3, 4], [0, 0.9, 1.1, 2.9, 4]], [[1, 1, null, 1, 1], [0.3, 0.3, 0.3, 0.3, 0.3]]",
    )
    assert ink(chart, 0.5, 1.0)
    assert ink(chart, 3.5, 1.0)
    assert not ink(chart, 1.6, 1.0)
    assert not ink(chart, 2.5, 1.0)


def test_a_line_that_goes_back_is_drawn_as_it_goes(chart: Browser):
    """A square of side 2: its points in another order would have a diagonal."""
    drawn_alone(chart, "[{ name: 'square' }, { name: 'none' }]", "[[1, 3, 3, 1, 1], [1, 3]], [[1, 1, 3, 3, 1], [null, null]]")
    for x, y in ((2.0, 1.0), (3.0, 2.0), (2.0, 3.0), (1.0, 2.0)):
        assert ink(chart, x, y), (x, y)
    assert not ink(chart, 2.0, 2.0)


def test_more_lines_than_colours_still_differ(chart: Browser):
    lines = ", ".join(f"{{ name: 'line {i}' }}" for i in range(20))
    drawn_alone(chart, f"[{lines}]", f"[0, 1], [{', '.join(['[0, 1]'] * 20)}]")
    samples = chart.run("[...other.element.querySelectorAll('.u-legend svg')].map((s) => s.innerHTML)")
    assert len(set(samples)) == 20


def test_points_have_shapes_and_tell_both_values(chart: Browser):
    shapes = ("circle", "square", "diamond", "triangle-up", "cross")
    lines = ", ".join(f"{{ name: '{shape}', symbols: '{shape}', style: 0 }}" for shape in shapes)
    xs, ys = ", ".join(f"[{i + 1}, {i + 1}]" for i in range(5)), ", ".join("[1, 2]" for _ in shapes)
    drawn_alone(chart, f"[{lines}]", f"[{xs}], [{ys}]")
    samples = chart.run("[...other.element.querySelectorAll('.u-legend svg')].map((s) => s.innerHTML)")
    assert len(set(samples)) == 5  # without a difference of colours
    chart.run("other.plot.setCursor({ left: other.plot.valToPos(2, 'x') + 3, top: other.plot.valToPos(2, 'y') - 3 })")
    values = chart.run("[...other.element.querySelectorAll('.u-legend .u-value')].map((e) => e.textContent)")
    assert values[1:] == ["–", "2 at 2", "–", "–", "–"]


def test_levels_and_marks_are_in_sight(chart: Browser):
    drawn_alone(chart, "[{ name: 'line' }]", "[1, 2], [0.1, 0.2]", "{ levels: [[0.5, 'limit']], marks: [[3, 'event']] }")
    bottom, top, right = chart.run("[other.plot.scales.y.min, other.plot.scales.y.max, other.plot.scales.x.max]")
    assert (bottom, right) == (0.0, pytest.approx(3.0))
    assert top > 0.5


def test_dragging_zooms_both_ways_and_escape_shows_all(chart: Browser):
    drawn_alone(chart, "[{ name: 'line' }]", "[0, 1, 2, 3, 4], [0, 4, 1, 4, 2]")
    ends = "[other.plot.scales.x.min, other.plot.scales.x.max, other.plot.scales.y.min, other.plot.scales.y.max]"
    whole = chart.run(ends)
    chart.run("other.element.className += ' other'")
    x, y, width, height = chart.box(".other .u-over")
    chart.drag((x + 0.25 * width, y + 0.2 * height), (x + 0.75 * width, y + 0.8 * height))
    assert chart.run(ends)[:2] == pytest.approx([1.0, 3.0], abs=0.05)
    low, high = whole[2:]
    assert chart.run(ends)[2:] == pytest.approx([low + 0.2 * (high - low), low + 0.8 * (high - low)], abs=0.05)
    chart.run("other.element.querySelector('.u-over').focus()")
    chart.key("Escape")
    assert chart.run(ends) == pytest.approx(whole)


def test_frequencies_have_ticks_in_both_units(chart: Browser):
    """1 Hz is 2 pi rad/s: each tick above is at the place of its number in the unit below, and the numbers are round."""
    chart.run(
        "both = new Chart(document.body.appendChild(document.createElement('div')), { x: 'natural frequency [rad/s]', y: 'V',"
        "beside: ['Hz', 0.5 / Math.PI], lines: [{ name: 'left' }] }); both.draw([2, 10, 18], [[0.8, 0, 0.6]])"
    )
    chart.until("both.plot.axes[2]._values?.length > 1")
    ticks, places = chart.run("[both.plot.axes[2]._values, both.plot.axes[2]._splits]")
    assert [float(text.removesuffix(" Hz")) for text in ticks] == pytest.approx([place / (2.0 * math.pi) for place in places])
    assert all(text.removesuffix(" Hz") in {"0.5", "1", "1.5", "2", "2.5"} for text in ticks)
    assert chart.run("both.plot.axes[2].scale") == "x"
    chart.run("both.plot.setCursor({ left: both.plot.valToPos(10, 'x'), top: 5 })")
    chart.until("both.element.querySelector('.u-legend').textContent.includes('10 rad/s (1.5915 Hz)')")


@pytest.mark.parametrize(("numbers", "room"), [(["0", "1"], 58), (["\u22120.00015", "0"], 14 + 7.5 * 8)])
def test_the_axis_has_room_for_its_numbers(chart: Browser, numbers, room):
    assert chart.run(f"chartRoom(null, {numbers})") == room


@pytest.mark.parametrize(
    ("label", "beside"),
    [
        ("natural frequency [rad/s]", ("Hz", 1.0 / (2.0 * math.pi))),
        ("frequency [Hz]", ("rad/s", 2.0 * math.pi)),
        ("speed of the hub [rad/s]", None),
        ("actual / design frequency", None),
    ],
)
def test_which_axes_have_a_second_unit(label, beside):
    assert Figure("f", "F", label, "V", []).beside() == (beside and (beside[0], pytest.approx(beside[1])))
