"""Every kind of page is below 1 MB, loads nothing, has the same bytes twice, and shows names of others as text."""

from __future__ import annotations

from pathlib import Path

import pytest
from browser import browser, needs_chromium
from command_line import typed
from report_pages import figures_of, undrawn

from shaper_fmu.page.blocks import Heading, Table, Text, page_text
from shaper_fmu.page.figures import Figure, Line, Map, Panels
from shaper_fmu.reproduce import NAMES

SSP = Path(__file__).parents[2] / "ssp"
MOST = 1_000_000
HOSTILE = "</script><script>document.title = 'taken'</script><img src=x onerror=document.title='taken'>"
PAGES = {
    "shaper": ("design", "ei", "-w", "5", "--plot", "page.html"),
    "profile": ("design", "s_curve", "-w", "5", "--distance", "1", "--duration", "2", "--plot", "page.html"),
    "pulses": ("design", "carrier", "-w", "5", "--duration", "2", "--plot", "page.html"),
    "fastest": ("design", "fastest", "-w", "5", "--distance", "1", "--max-acceleration", "4", "--plot", "page.html"),
    "run": ("run", str(SSP / "overhead_crane"), "--report", "page.html"),
}
"""A command for each kind of page; those of sweeps and tunings are in test_sweep_pages.py and test_tune_report.py."""


@pytest.mark.parametrize("kind", PAGES)
def test_a_page_is_small_and_the_same_twice(kind, tmp_path, fmus):
    found = []
    for _ in range(2):
        done = typed(*PAGES[kind], cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        found.append((tmp_path / "page.html").read_bytes())
    assert found[0] == found[1]
    assert len(found[0]) < MOST
    assert figures_of(found[0].decode())


def test_the_page_of_a_choice_of_modes_is_small(tmp_path):
    """`design --modes`: of a response with two modes in three outputs."""
    mode = "[[modes]]\nnatural_frequency = {}\ndamping_ratio = 0.02\nresidue = [[0.4, 0.1], [0.2, 0.0], [{}, 0.1]]\n"
    text = "\n".join(['outputs = ["x1", "x2", "x3"]\nfinal = [1.0, 1.0, 1.0]\n', mode.format(5.0, 0.3), mode.format(14.0, -0.1)])
    (tmp_path / "modes.toml").write_text(text)
    done = typed("design", "zv", "--modes", "modes.toml", "--plot", "page.html", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = tmp_path / "page.html"
    assert page.stat().st_size < MOST
    assert figures_of(page.read_text())


@pytest.mark.thorough
@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("pwm", "partial-modes")])  # those where they are written
def test_the_pages_of_reproduce_are_small(name, tmp_path):
    done = typed("reproduce", name, "--output", ".", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    page = tmp_path / f"reproduce_{name}.html"
    assert page.stat().st_size < MOST
    assert figures_of(page.read_text())


@needs_chromium
def test_names_of_others_are_text(tmp_path):
    """In titles, labels, lines, levels, marks, panels, tables and headings: nothing of it becomes an element or runs."""
    x, grid = [0.0, 1.0], [[0.0, 1.0], [1.0, 2.0]]
    import numpy as np

    figure = Figure("one", HOSTILE, HOSTILE, HOSTILE, [Line(HOSTILE, np.array(x), np.array(x))], [(0.5, HOSTILE)], [(0.5, HOSTILE)])
    map_ = Map("map", HOSTILE, HOSTILE, HOSTILE, HOSTILE, np.array(x), np.array(x), [(HOSTILE, np.array(grid))], [(1.0, HOSTILE)])
    blocks = [Heading(HOSTILE), Text(HOSTILE), Table(HOSTILE, [HOSTILE], [[HOSTILE]], left_aligned=True), figure, map_]
    page = tmp_path / "page.html"
    page.write_text(page_text("names", [*blocks, Panels("both", HOSTILE, [Figure("two", HOSTILE, "", "", figure.lines)])]))
    with browser(tmp_path) as chromium:
        chromium.open(page.as_uri())
        assert undrawn(chromium) == []
        assert chromium.run("document.title") == "names"
        assert chromium.run("document.querySelectorAll('img').length") == 0
        assert HOSTILE in chromium.run("document.querySelector('h2').textContent")
        assert HOSTILE in chromium.run("document.querySelector('.u-legend').textContent")
        assert (chromium.console, chromium.requests) == ([], [])
