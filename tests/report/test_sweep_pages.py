"""The pages of sweeps' reports: well-formed, self-contained, of bounded size, and drawn by a browser."""

from __future__ import annotations

import json
import math
import re
import shutil
import sqlite3
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from browser import browser, needs_chromium
from lxml import etree
from report_pages import figures_of, undrawn
from sweep_stores import DAMPED, HEAD, HOSTILE, RANDOM, ROPE, SMALL, packed_crane, query, shares, swept

from shaper_fmu.page.blocks import Text
from shaper_fmu.page.figures import Figure, Map
from shaper_fmu.report.sweep.curves import thinned
from shaper_fmu.report.sweep.data import Axis, SweepData
from shaper_fmu.report.sweep.levels import judged
from shaper_fmu.report.sweep.maps import MOST_LINES, shown_grid
from shaper_fmu.report.sweep.report import read_store, sweep_blocks, write_sweep_report
from shaper_fmu.report.sweep.yields import yield_of
from shaper_fmu.ssp.archive import load_ssp
from shaper_fmu.sweep.engine import provenance_of, with_nominals
from shaper_fmu.sweep.runs import Outcome
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import read_study


@pytest.fixture(scope="module")
def crane(fmus, tmp_path_factory) -> Path:
    """A folder with the crane's system."""
    return packed_crane(tmp_path_factory.mktemp("report"), fmus)


@pytest.fixture(scope="module")
def sampled(crane) -> Path:
    return swept(crane, "sampled", HEAD + SMALL + RANDOM)


@pytest.fixture(scope="module")
def hostile(crane) -> Path:
    return swept(crane, "hostile", HEAD.replace("step = 0.02", "step = 0.1") + HOSTILE)


@pytest.fixture(scope="module")
def pages(sampled, hostile, tmp_path_factory) -> dict[str, list[Path]]:
    """The reports of two stores: the page first, then its pictures. Between them they have all that a page can have."""
    folder = tmp_path_factory.mktemp("pages")
    stores = {"sampled": sampled, "hostile": hostile}
    return {name: write_sweep_report(store, folder / f"{name}.html") for name, store in stores.items()}


class Page(HTMLParser):
    """Checks that elements are closed as they were opened, and collects what a page would load, and its texts."""

    VOID = frozenset({"meta", "img", "br", "link", "input", "path", "rect", "line", "circle", "use", "stop"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.loaded: list[str] = []
        self.attributes: set[str] = set()
        self.identifiers: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.identifiers += [value for name, value in attrs if name == "id" and value]
        self.loaded += [v for k, v in attrs if k in ("src", "srcset", "data", "poster") and v]
        self.loaded += [v for k, v in attrs if k in ("href", "xlink:href") and v and not v.startswith("#") and tag != "a"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


NAMES = ["sampled", "hostile"]


@pytest.mark.parametrize("name", NAMES)
def test_pages_are_well_formed_and_load_nothing(pages, name):
    text = pages[name][0].read_text()
    page = Page()
    page.feed(text)
    page.close()
    assert page.open == []
    assert page.loaded == []
    assert page.tags.isdisjoint({"img", "b", "iframe", "link", "object"})
    assert len(set(page.identifiers)) == len(page.identifiers)
    assert len(text.encode()) < 1_000_000
    assert "default-src 'none'" in text  # so a browser would refuse to load anything
    assert "<title>Crane &lt;b&gt;&amp; rope&lt;/b&gt;</title>" in text


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_png_and_an_svg(pages, name):
    page, *pictures = pages[name]
    figures = figures_of(page.read_text())
    assert [path.name for path in pictures] == [f"{name}_{key}.{kind}" for key in figures for kind in ("png", "svg")]
    for path in pictures:
        content = path.read_bytes()
        if path.suffix == ".png":
            assert content.startswith(b"\x89PNG\r\n\x1a\n")
        else:
            assert etree.fromstring(content).tag == "{http://www.w3.org/2000/svg}svg"


@needs_chromium
@pytest.mark.parametrize("name", NAMES)
def test_a_browser_draws_every_figure_without_complaint(pages, name, tmp_path):
    """Opened by chromium: no message on the console (also none of the page's own policy), all figures drawn, nothing injected."""
    page = pages[name][0]
    assert len(figures_of(page.read_text())) > 4
    with browser(tmp_path) as chromium:
        chromium.open(page.as_uri())
        chromium.until("!document.querySelector('.chart-data:not(.chart + .chart-data)')")
        assert undrawn(chromium) == []
        assert (chromium.console, chromium.requests) == ([], [])
        drawn = Page()
        drawn.feed(chromium.run("document.documentElement.outerHTML"))
    assert drawn.tags.isdisjoint({"img", "iframe", "b"})
    assert "onerror" not in drawn.attributes


def test_the_page_says_where_its_numbers_come_from(pages, crane, sampled):
    text = pages["sampled"][0].read_text()
    provenance = json.loads(query(sampled, "SELECT value FROM study WHERE key = 'provenance'")[0][0])
    assert provenance["system"] in text
    assert all(digest in text for digest in provenance["fmus"].values())
    assert "random, 150 points, seed 3" in text
    assert "600 of 600 runs done, 0 failed." in text


def test_remarks_are_told(crane, tmp_path):
    store = tmp_path / "noted.sqlite"
    shutil.copy(swept(crane, "noted", HEAD + SMALL + ROPE.replace("points = 9", "points = 2")), store)
    with sqlite3.connect(store) as database:
        database.execute("INSERT INTO study VALUES ('note instances', 'every run had <fresh> instances')")
    database.close()
    blocks = sweep_blocks(read_store(store))
    assert Text("Note: every run had <fresh> instances.") in blocks


def test_a_store_without_results_has_a_report(crane, tmp_path):
    text = HEAD + SMALL + ROPE
    (crane / "planned.toml").write_text(text)
    study = read_study(crane / "planned.toml")
    loaded = load_ssp(study.system_path)
    with Store(tmp_path / "s.sqlite", with_nominals(study, loaded.system), provenance_of(loaded)) as store:
        store.enter([Outcome(0, None, "no <reason>", 0.1)])
    page = write_sweep_report(tmp_path / "s.sqlite", tmp_path / "s.html")
    assert [path.name for path in page] == ["s.html"]
    words = page[0].read_text()
    assert "0 of 36 runs done, 1 failed." in words
    assert "35 are still to be done" in words
    assert "no &lt;reason&gt;" in words


def large_store(crane: Path, path: Path, text: str) -> SweepData:
    """A store whose runs have made-up metrics: for its size."""
    (crane / "large.toml").write_text(text)
    study = read_study(crane / "large.toml")
    loaded = load_ssp(study.system_path)
    values = np.random.default_rng(0).random(study.count)
    with Store(path, with_nominals(study, loaded.system), provenance_of(loaded)) as store:
        store.enter([Outcome(i, (float(value),), None, 0.0) for i, value in enumerate(values)])
    return read_store(path)


def numbers_in(block: object) -> int:
    if isinstance(block, Figure):
        return sum(len(line.x) for line in block.lines)
    return sum(values.size for _, values in block.panels) if isinstance(block, Map) else 0


@pytest.mark.parametrize("varied", [RANDOM.replace("150", "20000"), ROPE.replace("9", "301") + DAMPED.replace("5", "41")])
def test_large_stores_are_drawn_with_some_thousand_points(crane, tmp_path, varied):
    pair = re.sub(r"\n(ZVD|EI) = .*", "", SMALL)
    data = large_store(crane, tmp_path / "s.sqlite", HEAD + pair + varied)
    assert len(data.ids) > 20_000
    blocks = sweep_blocks(data)
    drawn = [numbers_in(block) for block in blocks if isinstance(block, Figure | Map)]
    assert 1000 < max(drawn) <= 8000
    if data.sampled:
        values = shares(tmp_path / "s.sqlite", "ZV")[:, 1]
        found = yield_of(data, judged(data, "residual_swing"), "ZV")
        assert found is not None
        assert (found.within, found.total) == ((values <= 0.05).sum(), 20000)
    else:
        grid = shown_grid(data.axes[0])
        assert len(grid) <= MOST_LINES + 1
        assert {6.0, 8.0, 10.0} <= set(grid)


def test_thinned_curves_keep_their_peaks():
    x = np.linspace(0.0, 1.0, 50_001)
    y = np.where(np.abs(x - 0.7312) < 1e-5, 5.0, np.sin(30.0 * x))
    found_x, found_y = thinned(x, y)
    assert len(found_x) <= 2000
    assert np.all(np.diff(found_x) > 0.0)
    assert (found_x[0], found_x[-1], found_y.max(), found_y.min()) == (x[0], x[-1], 5.0, y.min())


def test_frequencies_are_in_hz_too():
    """2 pi rad/s are 1 Hz; a rate of turning, and all else, has its own unit alone."""
    axis = Axis("shaper.natural_frequency[1]", "rad/s", 1.0, 2.0 * math.pi)
    assert axis.shown(2.0 * math.pi) == "6.28319 rad/s, 1 Hz"
    assert Axis("hub.rate", "rad/s", 1.0, 1.0).shown(1.0) == "1 rad/s"
    assert Axis("crane.rope", "m", 1.0, 1.0).shown(8.0) == "8 m"
