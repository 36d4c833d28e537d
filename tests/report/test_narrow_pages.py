"""Pages on phones: no word is broken, nothing but tables of numbers is wider than the screen; panels, and an axis on the right."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu.page.blocks import Table, write_report
from shaper_fmu.page.figures import Figure, Line, Map, Panels

CHROMIUM = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)
ROW = [
    "The residual vibration stays below the tolerated one even for the shortest move that was tried",
    "62.1, 27.5, 2.3, 4.1, 0.5 % at 0.8, 1.25, 1.75, 2.25, 4.25 periods of the first mode",
    "reproduced (labels exchanged)",
    "There is residual vibration at all five, but by the paper's own threshold it is insignificant at three of these.",
]
MEASURE = """<script>
const broken = [], table = document.querySelector(".left-aligned");
for (const cell of table.querySelectorAll("td")) {
  const text = cell.firstChild;
  for (const word of text.data.matchAll(/\\S+/g)) {
    const range = document.createRange();
    range.setStart(text, word.index);
    range.setEnd(text, word.index + word[0].length);
    if (range.getClientRects().length > 1 && !word[0].includes("-")) broken.push(word[0]);
  }
}
document.body.dataset.broken = broken.join(" ");
document.body.dataset.map = document.getElementById("map").clientWidth;
document.body.dataset.wider = document.documentElement.scrollWidth - innerWidth;
</script></body>"""


def figure(key: str, right: bool = False) -> Figure:
    x = np.linspace(0.0, 1.0, 11)
    lines = [Line("slide", x, x), Line("swing of the pendulum with a long name", x, 0.1 * x, right=right)]
    return Figure(
        key, f"({key}) a rather long title of a figure that does not fit", "time [s]", "share", lines, right_label="rad" * right
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> list[Path]:
    blocks = [
        Table("Claims", ["claim", "found", "verdict", "why"], [ROW], left_aligned=True),
        Table("Numbers", [""] + 12 * ["wide"], [["row"] + 12 * ["12.345678"]]),
        Panels("both", "Fig. 3", [figure("a"), figure("b")]),
        figure("right", right=True),
        Map(
            "map",
            "Map",
            "w/wn",
            "zeta",
            "V [%]",
            np.arange(3.0),
            np.arange(2.0),
            [(f"panel {i} of the map", np.ones((2, 3))) for i in range(3)],
        ),
    ]
    return write_report(tmp_path_factory.mktemp("narrow") / "page.html", "Narrow", blocks)


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: the page was not opened in a browser")
@pytest.mark.parametrize("width", [500, 720, 1200])
def test_no_word_is_broken(written, width, tmp_path):
    """As a browser lays the page out: a word on two lines has two rectangles. 500 is the least width of chromium's windows."""
    page = tmp_path / "page.html"
    page.write_text(written[0].read_text().replace("</body>", MEASURE))
    options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--dump-dom"]
    options += ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--virtual-time-budget=5000"]
    options += [f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900"]
    done = subprocess.run(
        [str(CHROMIUM), *options, page.as_uri()],
        capture_output=True,
        text=True,
        timeout=900,
        env={**os.environ, "HOME": str(tmp_path)},
    )
    assert re.findall(r'data-broken="([^"]*)"', done.stdout) == [""]
    (map_width,) = re.findall(r'data-map="([^"]*)"', done.stdout)
    assert int(map_width) >= 640  # narrower, the titles of three panels cover each other; it scrolls
    (wider,) = re.findall(r'data-wider="([^"]*)"', done.stdout)
    assert int(wider) <= 0


def test_panels_are_one_picture_and_each_is_drawn(written):
    assert [path.name for path in written] == ["page.html", "page_both.png", "page_right.png", "page_map.png"]
    assert re.findall(r'Plotly\.newPlot\(\s*"([^"]+)"', written[0].read_text()) == ["a", "b", "right", "map"]


def test_a_line_of_the_right_axis_is_on_it(written):
    page = written[0].read_text()
    text = page[page.index('id="right"') : page.index('id="map"')]
    assert text.count('"yaxis":"y2"') == 1
    assert '"yaxis2":{"title":{"text":"rad"}' in text
