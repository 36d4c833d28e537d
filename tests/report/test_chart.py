"""The chart that pages carry, in a browser: lines with times of their own, two axes, symbols, logarithms, downloads, print."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from browser import Browser, browser, needs_chromium

from shaper_fmu.page.chart import chart_script, chart_style

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
        assert chromium.console == []


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
