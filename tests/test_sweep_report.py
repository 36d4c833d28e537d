"""The report of a sweep: its numbers against the store, read with SQL, and against formulas; its page in a browser."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sqlite3
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from scipy import stats

from shaper_fmu.analysis import vibration
from shaper_fmu.analysis.response import command_end, residual_amplitude
from shaper_fmu.report.figures import Figure, Map
from shaper_fmu.report.page import Heading, Table, Text
from shaper_fmu.report.sweep_curves import insensitivity, insensitivity_table, robustness_figures, robustness_table, thinned
from shaper_fmu.report.sweep_data import SweepData
from shaper_fmu.report.sweep_levels import judged
from shaper_fmu.report.sweep_maps import MOST_LINES, metric_map, shown_grid
from shaper_fmu.report.sweep_origin import failure_blocks
from shaper_fmu.report.sweep_pareto import candidates, durations
from shaper_fmu.report.sweep_report import read_store, summary_tables, sweep_blocks, write_sweep_report
from shaper_fmu.report.sweep_responses import Reruns, worst_index
from shaper_fmu.report.sweep_yield import distribution_figures, ranking_table, yield_of, yield_table
from shaper_fmu.shapers.design import shaper
from shaper_fmu.ssp.archive import load_ssp, pack_ssp
from shaper_fmu.sweep.engine import provenance_of, run_study, with_nominals
from shaper_fmu.sweep.store import Outcome, Store
from shaper_fmu.sweep.study import read_study

SYSTEMS = Path(__file__).parents[1] / "ssp"
LENGTH, DAMPING = "crane.initial_rope_length", "crane.damping_ratio"
W = math.sqrt(9.81 / 8.0)
"""What the crane's shaper is designed for [rad/s]: a rope of 8 m."""

HEAD = """
name = "Crane <b>& rope</b>"
system = "crane.ssp"
stop_time = 24.0
step = 0.02
reference = "unshaped"

[metrics.residual_swing]
kind = "residual"
output = "crane.swing_angle"
command = "shaper.shaped_mean"
"""
SMALL = """
[compare]
unshaped = { "shaper.shaper" = "none", "profile.distance" = 0.01 }
ZV = { "shaper.shaper" = "zv", "profile.distance" = 0.01 }
ZVD = { "shaper.shaper" = "zvd", "profile.distance" = 0.01 }
EI = { "shaper.shaper" = "ei", "profile.distance" = 0.01 }
"""
ROPE = f"""
[vary."{LENGTH}"]
nominal = 8.0
low = 6.0
high = 10.0
points = 9
"""
DAMPED = f"""
[vary."{DAMPING}"]
low = 0.0
high = 0.08
points = 5
"""
REFINED = """
[refine]
metric = "residual_swing"
level = 0.05
width = 0.01
"""
RANDOM = f"""
[plan]
kind = "random"
samples = 150
seed = 3

[vary."{LENGTH}"]
nominal = 8.0
distribution = "normal"
deviation = 0.4

[vary."{DAMPING}"]
low = 0.0
high = 0.05
"""
HOSTILE = f"""
[compare]
unshaped = {{ "shaper.shaper" = "none" }}
'<img src="x" onerror="console.error(1)"></script> $x_1$ %{{y}}' = {{ "crane.hoist_speed" = 0.35 }}
"_ZVD & more" = {{ "shaper.shaper" = "zvd" }}

[vary."{LENGTH}"]
nominal = 9.0
low = 6.0
high = 11.0
points = 31

[vary."{DAMPING}"]
low = 0.0
high = 0.05
points = 3
"""


@pytest.fixture(scope="module")
def crane(fmus, tmp_path_factory) -> Path:
    """A folder with the crane's system."""
    folder = tmp_path_factory.mktemp("report")
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    return folder


def swept(folder: Path, name: str, text: str) -> Path:
    """The store of a study, swept in this process."""
    (folder / f"{name}.toml").write_text(text)
    run_study(read_study(folder / f"{name}.toml"), folder / f"{name}.sqlite")
    return folder / f"{name}.sqlite"


@pytest.fixture(scope="module")
def refined(crane) -> Path:
    return swept(crane, "refined", HEAD + SMALL + ROPE + REFINED)


@pytest.fixture(scope="module")
def plane(crane) -> Path:
    return swept(crane, "plane", HEAD + SMALL + ROPE + DAMPED)


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


def query(store: Path, text: str, *values: object) -> list[tuple]:
    database = sqlite3.connect(store)
    try:
        return database.execute(text, values).fetchall()
    finally:
        database.close()


def shares(store: Path, case: str) -> np.ndarray:
    """Each point of a case, and its residual as a share of the unshaped one, by SQL; shape (n, 3)."""
    return np.array(
        query(
            store,
            f'SELECT c."{LENGTH}", c.residual_swing / u.residual_swing, c.residual_swing FROM run c JOIN run u '
            f'ON c."{LENGTH}" = u."{LENGTH}" WHERE c.compared = ? AND u.compared = "unshaped" AND c.status = "done"',
            case,
        )
    )


def first_number(text: str) -> float:
    found = re.search(r"-?\d+\.?\d*(e[-+]\d+)?", text)
    assert found, text
    return float(found[0])


def test_the_robustness_table_is_what_the_store_holds(refined):
    table = robustness_table(read_store(refined), "residual_swing", 0)
    assert table.head == ["case", "6 m (-25 %)", "8 m (nominal)", "10 m (+25 %)"]
    assert [row[0] for row in table.rows] == ["unshaped", "ZV", "ZVD", "EI"]
    for case, *cells in table.rows:
        stored = {length: (share, value) for length, share, value in shares(refined, case)}
        for length, cell in zip((6.0, 8.0, 10.0), cells, strict=True):
            share, value = stored[length]
            assert cell.startswith(f"{math.degrees(value):.4g} deg")
            assert cell.endswith(f"({100.0 * share:.3g} %)") == (case != "unshaped")


@pytest.mark.parametrize("case", ["ZV", "ZVD"])
def test_the_insensitivity_is_the_formulas(refined, case):
    """A small swing's frequency goes with 1 / sqrt(length). The table is off by what `shaped_mean` does to the residual,
    (w h)^2 / 16 and the like: 2e-4 of V at most, through the curve's slope, and by straight lines over 0.01 m at most."""
    data = read_store(refined)
    design = shaper(case.lower(), W)
    band = vibration.tolerated_band(design, W)
    assert band is not None
    assert band[1] - band[0] == pytest.approx(
        {"ZV": 4 / math.pi * math.asin(0.05), "ZVD": 4 / math.pi * math.asin(math.sqrt(0.05))}[case]
    )
    expected = [8.0 / band[1] ** 2, 8.0 / band[0] ** 2]  # the shorter rope swings faster
    found = insensitivity(data, judged(data, "residual_swing"), case, 0)
    assert found is not None
    row = next(row for row in insensitivity_table(data, "residual_swing", 0).rows if row[0] == case)  # type: ignore[union-attr]
    low = max(expected[0], 6.0)
    assert found.low == pytest.approx(low, abs=6e-3)
    assert (found.open_low, found.open_high) == (expected[0] < 6.0, expected[1] > 10.0)
    assert first_number(row[1].removeprefix("beyond ")) == pytest.approx(found.low, rel=1e-5)
    if case == "ZV":
        assert found.high == pytest.approx(expected[1], abs=6e-3)
        assert found.spacing <= 0.01  # refined
        assert float(row[3]) == pytest.approx((found.high - found.low) / 8.0, abs=5e-5)
        # I = 0.0637 of the frequency, twice as much of the length, for small changes
        assert (found.high - found.low) / 8.0 == pytest.approx(2.0 * vibration.insensitivity(design, W), rel=0.01)
    else:
        assert row[2].startswith("beyond 10 m")
        assert row[3].startswith("at least ")


def test_beyond_the_level_at_the_nominal_value_there_is_no_band(refined):
    data = read_store(refined)
    nominal = dict(shares(refined, "EI")[:, :2])[8.0]
    found = insensitivity(data, judged(data, "residual_swing"), "EI", 0)
    assert (found is None) == (nominal > 0.05)  # V of EI is the tolerated one at its design frequency


def test_the_curves_are_the_store_refined_points_too(refined):
    data = read_store(refined)
    absolute, relative = robustness_figures(data, "residual_swing", 0)
    assert [line.name for line in relative.lines] == ["ZV", "ZVD", "EI"]
    assert relative.levels == [(5.0, "5 % of unshaped")]
    assert (absolute.x_label, absolute.y_label) == (f"{LENGTH} [m]", "residual swing [deg]")
    for line in relative.lines:
        expected = shares(refined, line.name)
        expected = expected[np.argsort(expected[:, 0])]
        assert len(expected) > 9 or line.name == "EI"
        np.testing.assert_array_equal(line.x, expected[:, 0])
        np.testing.assert_allclose(line.y, 100.0 * expected[:, 1], rtol=1e-15)
        drawn = next(one for one in absolute.lines if one.name == line.name)
        np.testing.assert_allclose(drawn.y, np.degrees(expected[:, 2]), rtol=1e-14)


def test_maps_are_the_store_on_its_grid(plane):
    data = read_store(plane)
    found = metric_map(data, "residual_swing", 0, 1)
    assert found is not None
    assert (found.x_label, found.y_label, found.levels[0]) == (f"{LENGTH} [m]", DAMPING, (5.0, "5 %"))
    assert [name for name, _ in found.panels] == ["ZV", "ZVD", "EI"]
    assert found.points == [(8.0, 0.0)]
    rows = query(plane, f'SELECT compared, "{LENGTH}", "{DAMPING}", residual_swing FROM run')
    stored = {(case, x, y): value for case, x, y, value in rows}
    for case, values in found.panels:
        expected = [[100.0 * stored[case, x, y] / stored["unshaped", x, y] for x in found.x] for y in found.y]
        np.testing.assert_allclose(values, expected, rtol=1e-14)


def test_the_slices_of_two_varied_values_are_at_the_others_nominal_one(plane):
    data = read_store(plane)
    lines = {line.name: line for line in robustness_figures(data, "residual_swing", 1)[0].lines}
    rows = query(plane, f'SELECT "{DAMPING}", residual_swing FROM run WHERE compared = "ZV" AND "{LENGTH}" = 8.0 ORDER BY 1')
    np.testing.assert_array_equal(lines["ZV"].x, [row[0] for row in rows])
    np.testing.assert_allclose(lines["ZV"].y, np.degrees([row[1] for row in rows]), rtol=1e-15)
    assert len(summary_tables(data)) == 2


def test_durations_are_the_shapers_and_dominated_cases_are_found(plane):
    data = read_store(plane)
    with Reruns(data, ["shaper.duration"]) as reruns:
        found, words = durations(data, reruns.nominal())
    assert words == "shaper.duration"
    expected = {case: shaper(case.lower(), W).duration for case in ("ZV", "ZVD", "EI")} | {"unshaped": 0.0}
    # the system gives the frequency to seven digits or more
    assert found == pytest.approx(expected, rel=1e-6)
    worst = dict(query(plane, "SELECT compared, max(residual_swing) FROM run GROUP BY compared"))
    shown = {one.case: one for one in candidates(data, "residual_swing", found)}
    for case, one in shown.items():
        assert one.worst == worst[case]
        better = [c for c in worst if found[c] <= found[case] and worst[c] <= worst[case] and c != case]
        assert one.best == (not better)
    assert {one.best for one in shown.values()} == {True, False}
    assert candidates(data, "residual_swing", {**found, "ZV": math.nan})[1].case != "ZV"


def test_without_such_a_parameter_the_duration_is_the_end_of_the_command(plane, monkeypatch):
    monkeypatch.setattr("shaper_fmu.report.sweep_pareto.duration_variable", lambda system: None)
    data = read_store(plane)
    with Reruns(data, []) as reruns:
        nominal = reruns.nominal()
        found, words = durations(data, nominal)
    assert words == "end of shaper.shaped_mean"
    # the profile's 8 s, and then the shaper's duration, to the end of a step of 0.02 s
    for case in ("ZV", "ZVD"):
        assert 0.0 <= found[case] - found["unshaped"] - shaper(case.lower(), W).duration + 0.02 <= 0.04


def test_the_worst_responses_have_the_stored_metric(plane):
    data = read_store(plane)
    with Reruns(data, []) as reruns:
        for case in data.cases:
            i = worst_index(data, "residual_swing", case)
            assert i is not None
            results = reruns.results(data.run(i))
            assert not isinstance(results, str)
            end = command_end(results.time, results["shaper.shaped_mean"])
            swing = residual_amplitude(results.time, results["crane.swing_angle"], end)
            stored = query(plane, "SELECT max(residual_swing) FROM run WHERE compared = ?", case)[0][0]
            # the stored one sees the steps from the very end of the command on, this one from the step in which it ends
            assert swing == pytest.approx(stored, rel=2e-4)


def test_yield_and_percentiles_are_those_of_the_store(sampled):
    data = read_store(sampled)
    judgement = judged(data, "residual_swing")
    rows = {row[0]: row for row in yield_table(data, "residual_swing").rows}
    assert list(rows) == ["ZV", "ZVD", "EI"]
    for case, row in rows.items():
        values = shares(sampled, case)[:, 1]
        within, total = int((values <= 0.05).sum()), len(values)
        assert total == 150
        found = yield_of(data, judgement, case)
        assert found is not None
        assert (found.within, found.total) == (within, total)
        # Clopper and Pearson 1934, by quantiles of the beta distribution
        low = stats.beta.ppf(0.025, within, total - within + 1) if within else 0.0
        high = stats.beta.ppf(0.975, within + 1, total - within) if within < total else 1.0
        assert (found.low, found.high) == pytest.approx((low, high), abs=1e-12)
        assert row[3] == f"{100 * within / total:.1f} % below 5 % of unshaped, 95 % interval {100 * low:.1f} .. {100 * high:.1f} %"
        for cell, percent in zip(row[4:], (5, 50, 95, 99, 100), strict=True):
            rank = math.ceil(percent / 100 * total)  # the least value that so many do not exceed
            assert cell == f"{100.0 * np.sort(values)[rank - 1]:.4g} %"


def test_a_run_that_failed_is_not_within_the_level(crane):
    failing = SMALL.replace('ZVD = { "shaper.shaper" = "zvd"', 'ZVD = { "crane.hoist_speed" = 0.35, "shaper.shaper" = "zvd"')
    plan = RANDOM.replace("samples = 150", "samples = 40").replace("deviation = 0.4", "deviation = 0.8")
    store = swept(crane, "failing", HEAD + failing + plan)
    data = read_store(store)
    failed = query(store, "SELECT count(*) FROM run WHERE compared = 'ZVD' AND status = 'failed'")[0][0]
    assert 0 < failed < 40  # hoisting 0.35 m/s for 24 s needs 8.4 m of rope
    found = yield_of(data, judged(data, "residual_swing"), "ZVD")
    assert found is not None
    assert found.total == 40
    assert found.within <= 40 - failed
    row = next(row for row in yield_table(data, "residual_swing").rows if row[0] == "ZVD")
    assert row[1:3] == [str(40 - failed), str(failed)]


def test_the_ranking_is_spearmans(sampled):
    data = read_store(sampled)
    rows = ranking_table(data, "residual_swing").rows
    stored = np.array(
        query(
            sampled,
            f'SELECT c."{LENGTH}", c."{DAMPING}", c.residual_swing / u.residual_swing FROM run c JOIN run u '
            f'ON c."{LENGTH}" = u."{LENGTH}" WHERE c.compared = "ZV" AND u.compared = "unshaped"',
        )
    )
    expected = {
        name: (stats.spearmanr(stored[:, i], stored[:, 2])[0], stats.spearmanr(abs(stored[:, i] - nominal), stored[:, 2])[0])
        for i, (name, nominal) in enumerate(((LENGTH, 8.0), (DAMPING, 0.0)))
    }
    shown = {row[2]: (row[3], row[4]) for row in rows[:2]}
    assert shown == {name: (f"{a:+.3f}", f"{b:+.3f}") for name, (a, b) in expected.items()}
    strength = [max(map(abs, expected[row[2]])) for row in rows[:2]]
    assert strength == sorted(strength, reverse=True)


def test_distributions_hold_all_runs(sampled):
    data = read_store(sampled)
    histogram, cumulative = distribution_figures(data, "residual_swing")
    for bins, steps in zip(histogram.lines, cumulative.lines, strict=True):
        values = 100.0 * np.sort(shares(sampled, bins.name)[:, 1])
        assert bins.y[1:-1:2].sum() == pytest.approx(100.0)
        at = np.interp(values, steps.x[1::2], steps.y[1::2])
        np.testing.assert_allclose(at, (np.arange(150) + 1) / 1.5, rtol=1e-12)
    assert histogram.marks == [(5.0, "5 % of unshaped")]


def test_failures_are_grouped_and_the_first_are_listed(hostile):
    data = read_store(hostile)
    kinds, listed = failure_blocks(data)
    assert isinstance(kinds, Table)
    assert isinstance(listed, Table)
    failed = query(hostile, "SELECT id, reason FROM run WHERE status = 'failed' ORDER BY id")
    assert len(failed) > 50
    assert listed.title == f"Failed runs, the first 50 of {len(failed)}"
    assert [row[0] for row in listed.rows] == [str(number) for number, _ in failed[:50]]
    assert len(kinds.rows) < 5  # times and lengths differ, the reason does not
    assert sum(int(row[0]) for row in kinds.rows) == len(failed)
    assert kinds.rows[0][1:] == [str(failed[0][0]), failed[0][1]]


def headings(blocks: list) -> list[str]:
    return [block.text for block in blocks if isinstance(block, Heading)]


def test_sections_depend_on_the_study(refined, plane, sampled, hostile):
    common = ["Duration against robustness", "Time responses", "Study and provenance"]
    assert headings(sweep_blocks(read_store(refined))) == ["Summary", "Robustness", *common]
    assert headings(sweep_blocks(read_store(plane))) == ["Summary", "Robustness", "Maps", *common]
    assert headings(sweep_blocks(read_store(sampled))) == ["Summary", "Yield", *common]
    assert "Failed runs" in headings(sweep_blocks(read_store(hostile)))


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


def test_texts_and_logarithmic_values(crane, tmp_path):
    compared = '\n[compare.all]\n"profile.distance" = 0.01\n'
    varied = '\n[vary."shaper.shaper"]\nvalues = ["none", "zv", "zvd"]\n'
    text = HEAD.replace('reference = "unshaped"', "") + compared + varied + ROPE + 'spacing = "log"\n'
    store = swept(crane, "texts", text)
    data = read_store(store)
    blocks = sweep_blocks(data)
    own = load_ssp(crane / "crane.ssp").system
    number = own.start_values["shaper"].get("shaper") or own.fmus["shaper"].variables["shaper"].start
    nominal = {1: "none", 2: "zv", 3: "zvd"}[int(number)]  # the enumeration's items
    table = robustness_table(data, "residual_swing", 0)
    assert table.head == ["case", *(f"{name} (nominal)" if name == nominal else name for name in ("none", "zv", "zvd"))]
    rows = dict(query(store, f'SELECT "shaper.shaper", residual_swing FROM run WHERE "{LENGTH}" = 8.0'))
    assert table.rows == [["all", *(f"{math.degrees(rows[name]):.4g} deg" for name in ("none", "zv", "zvd"))]]
    figure = next(block for block in blocks if isinstance(block, Figure) and block.key.startswith("robustness"))
    assert figure.log_x
    largest = query(store, "SELECT max(residual_swing) FROM run")[0][0]
    assert figure.levels[0][0] == pytest.approx(math.degrees(0.05 * largest))
    assert not any(isinstance(block, Map) for block in blocks)


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


@pytest.mark.parametrize("varied", [RANDOM.replace("150", "40000"), ROPE.replace("9", "301") + DAMPED.replace("5", "101")])
def test_large_stores_are_drawn_with_some_thousand_points(crane, tmp_path, varied):
    pair = re.sub(r"\n(ZVD|EI) = .*", "", SMALL)
    data = large_store(crane, tmp_path / "s.sqlite", HEAD + pair + varied)
    assert len(data.ids) > 50_000
    blocks = sweep_blocks(data)
    drawn = [numbers_in(block) for block in blocks if isinstance(block, Figure | Map)]
    assert 1000 < max(drawn) <= 8000
    if data.sampled:
        values = shares(tmp_path / "s.sqlite", "ZV")[:, 1]
        found = yield_of(data, judged(data, "residual_swing"), "ZV")
        assert found is not None
        assert (found.within, found.total) == ((values <= 0.05).sum(), 40000)
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
    assert "default-src 'none'" in text  # so a browser would refuse to load anything
    assert "<title>Crane &lt;b&gt;&amp; rope&lt;/b&gt;</title>" in text


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_png_and_an_svg(pages, name):
    page, *pictures = pages[name]
    figures = re.findall(r"Plotly\.newPlot\(\s*\"([^\"]+)\"", page.read_text())
    assert [path.name for path in pictures] == [f"{name}_{key}.{kind}" for key in figures for kind in ("png", "svg")]
    for path in pictures:
        content = path.read_bytes()
        if path.suffix == ".png":
            assert content.startswith(b"\x89PNG\r\n\x1a\n")
        else:
            assert etree.fromstring(content).tag == "{http://www.w3.org/2000/svg}svg"


CHROMIUM = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here: the pages were not opened in a browser")
@pytest.mark.parametrize("name", NAMES)
def test_a_browser_draws_every_figure_without_complaint(pages, name, tmp_path):
    """Opened by chromium: no message on the console (also none of the page's own policy), all figures drawn, nothing injected."""
    page = pages[name][0]
    options = [
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--enable-logging=stderr",
        "--dump-dom",
    ]
    options += ["--virtual-time-budget=5000", f"--user-data-dir={tmp_path / 'profile'}"]
    environment = {**os.environ, "HOME": str(tmp_path)}
    done = subprocess.run([str(CHROMIUM), *options, page.as_uri()], capture_output=True, text=True, timeout=120, env=environment)
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line.upper()] == []
    drawn = Page()
    drawn.feed(done.stdout)
    figures = re.findall(r"Plotly\.newPlot\(\s*\"([^\"]+)\"", page.read_text())
    assert len(figures) > 4
    assert done.stdout.count('class="plot-container') == len(figures)
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
