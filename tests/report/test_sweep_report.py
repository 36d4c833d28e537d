"""The report of a sweep: its numbers against the store, read with SQL, and against formulas."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from sweep_stores import DAMPED, DAMPING, HEAD, HOSTILE, LENGTH, RANDOM, REFINED, ROPE, SMALL, packed_crane, query, shares, swept

from shaper_fmu.analysis import vibration
from shaper_fmu.analysis.response import command_end, residual_amplitude
from shaper_fmu.design.shapers import shaper
from shaper_fmu.page.blocks import Heading, Table
from shaper_fmu.page.figures import Figure, Map
from shaper_fmu.report.sweep.curves import insensitivity, insensitivity_table, robustness_figures, robustness_table
from shaper_fmu.report.sweep.levels import judged
from shaper_fmu.report.sweep.maps import metric_map
from shaper_fmu.report.sweep.origin import failure_blocks
from shaper_fmu.report.sweep.pareto import candidates, durations
from shaper_fmu.report.sweep.report import read_store, summary_tables, sweep_blocks
from shaper_fmu.report.sweep.responses import Reruns, worst_index
from shaper_fmu.report.sweep.yields import distribution_figures, ranking_table, yield_of, yield_table
from shaper_fmu.ssp.archive import load_ssp

W = math.sqrt(9.81 / 8.0)
"""What the crane's shaper is designed for [rad/s]: a rope of 8 m."""


@pytest.fixture(scope="module")
def crane(fmus, tmp_path_factory) -> Path:
    """A folder with the crane's system."""
    return packed_crane(tmp_path_factory.mktemp("report"), fmus)


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
    monkeypatch.setattr("shaper_fmu.report.sweep.pareto.duration_variable", lambda system: None)
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
    strength = [float(np.abs(np.array(expected[row[2]])).max()) for row in rows[:2]]
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


def test_texts_and_logarithmic_values(crane, tmp_path):
    compared = '\n[compare.all]\n"profile.distance" = 0.01\n'
    varied = '\n[vary."shaper.shaper"]\nvalues = ["none", "zv", "zvd"]\n'
    text = HEAD.replace('reference = "unshaped"', "") + compared + varied + ROPE + 'spacing = "log"\n'
    store = swept(crane, "texts", text)
    data = read_store(store)
    blocks = sweep_blocks(data)
    own = load_ssp(crane / "crane.ssp").system
    number = own.start_values["shaper"].get("shaper") or own.fmus["shaper"].variables["shaper"].start
    nominal = {1: "none", 2: "zv", 3: "zvd"}[int(str(number))]  # the enumeration's items
    table = robustness_table(data, "residual_swing", 0)
    assert table.head == ["case", *(f"{name} (nominal)" if name == nominal else name for name in ("none", "zv", "zvd"))]
    rows = dict(query(store, f'SELECT "shaper.shaper", residual_swing FROM run WHERE "{LENGTH}" = 8.0'))
    assert table.rows == [["all", *(f"{math.degrees(rows[name]):.4g} deg" for name in ("none", "zv", "zvd"))]]
    figure = next(block for block in blocks if isinstance(block, Figure) and block.key.startswith("robustness"))
    assert figure.log_x
    largest = query(store, "SELECT max(residual_swing) FROM run")[0][0]
    assert figure.levels[0][0] == pytest.approx(math.degrees(0.05 * largest))
    assert not any(isinstance(block, Map) for block in blocks)
