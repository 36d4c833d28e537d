"""A sweep's runs as tables: every digit, no half-written file, flat memory."""

from __future__ import annotations

import csv
import math
import sqlite3
import sys
import tracemalloc
from pathlib import Path

import pytest

from shaper_fmu.errors import ShaperFmuError, StudyError
from shaper_fmu.ssp.archive import pack_ssp
from shaper_fmu.sweep.engine import run_study
from shaper_fmu.sweep.export import to_xarray, write_csv, write_parquet
from shaper_fmu.sweep.runs import Run
from shaper_fmu.sweep.store import Store
from shaper_fmu.sweep.study import Study, read_study

SYSTEMS = Path(__file__).parents[2] / "ssp"

STUDY = """
name = "small"
system = "crane.ssp"
stop_time = 15.0
step = 0.05

[vary."crane.initial_rope_length"]
low = 6.0
high = 10.0
points = 3

[vary."shaper.shaper"]
values = ["zv", "zvd"]

[compare]
still = {}
hoisted = { "crane.hoist_speed" = 0.45 }

[metrics.peak_swing]
kind = "peak"
output = "crane.swing_angle"

[metrics.swing_at_the_end]
kind = "final"
output = "crane.swing_angle"
"""
LENGTH = "crane.initial_rope_length"


def study_in(folder: Path, text: str) -> Study:
    (folder / "study.toml").write_text(text)
    return read_study(folder / "study.toml")


@pytest.fixture(scope="module")
def swept(fmus, tmp_path_factory) -> Path:
    """A store: hoisting 0.45 m/s for 15 s takes 6.75 m of rope, which 6 m do not have: two runs fail."""
    folder = tmp_path_factory.mktemp("swept")
    pack_ssp(SYSTEMS / "overhead_crane", fmus, folder / "crane.ssp")
    assert run_study(study_in(folder, STUDY), folder / "s.sqlite") == {"done": 10, "failed": 2}
    return folder / "s.sqlite"


def expected(run: Run) -> list:
    return [
        run.id, run.compared, run.varied[LENGTH], run.varied["shaper.shaper"],
        run.metrics.get("peak_swing"), run.metrics.get("swing_at_the_end"), run.status, run.reason, run.seconds, run.attempts,
    ]  # fmt: skip


HEAD = [
    "run", "case", LENGTH, "shaper.shaper", "peak_swing", "swing_at_the_end", "status", "reason", "seconds", "attempts",
]  # fmt: skip


def test_csv_has_every_run_with_all_digits(swept, tmp_path):
    told: list[tuple[float, float]] = []
    with Store(swept) as store:
        assert write_csv(store, tmp_path / "r.csv", lambda done, total: told.append((done, total))) == 12
        runs = store.runs()
    head, *rows = csv.reader((tmp_path / "r.csv").read_text().splitlines())
    assert head == HEAD
    for row, run in zip(rows, runs, strict=True):
        assert row == ["" if value is None else repr(value) if isinstance(value, float) else str(value) for value in expected(run)]
    assert sum("leaves no rope" in row[7] for row in rows) == 2
    assert told == [(0, 12), (12, 12)]


def test_parquet_has_the_same_to_the_bit(swept, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    with Store(swept) as store:
        assert write_parquet(store, tmp_path / "r.parquet") == 12
        runs = store.runs()
    table = parquet.read_table(tmp_path / "r.parquet")
    assert table.column_names == HEAD
    assert [str(kind) for kind in table.schema.types] == [
        "int64", "string", "double", "string", "double", "double", "string", "string", "double", "int64",
    ]  # fmt: skip
    assert [list(row.values()) for row in table.to_pylist()] == [expected(run) for run in runs]


def test_a_writer_that_fails_leaves_the_old_table_and_no_draft(swept, tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "s.sqlite").write_bytes(swept.read_bytes())
    with sqlite3.connect(tmp_path / "s.sqlite") as database:
        database.execute("UPDATE run SET peak_swing = 'large' WHERE id = 4")
    database.close()
    (tmp_path / "r.parquet").write_text("the old one")
    with (
        Store(tmp_path / "s.sqlite") as store,
        pytest.raises(StudyError, match=r"the store is damaged: run 4 is done, and has .*large"),
    ):
        write_parquet(store, tmp_path / "r.parquet")
    assert (tmp_path / "r.parquet").read_text() == "the old one"
    assert not [path for path in tmp_path.iterdir() if "draft" in path.name]


def test_parquet_without_its_package_is_an_error_that_tells_what_to_do(swept, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)  # as where it is not installed
    with Store(swept) as store, pytest.raises(ShaperFmuError, match=r"pip install 'shaper-fmu\[parquet\]'"):
        write_parquet(store, tmp_path / "r.parquet")


def test_memory_does_not_grow_with_the_runs(tmp_path):
    """The store gives pages of 10 000 runs: 36 000 need no more than 20 000."""
    peaks = []
    for points in (100, 180):
        text = STUDY.replace("points = 3", f"points = {points}")
        text = text.replace('shaper.shaper"]\nvalues = ["zv", "zvd"]', 'crane.damping_ratio"]\nlow = 0.0\nhigh = 0.1\npoints = 100')
        with Store(tmp_path / f"{points}.sqlite", study_in(tmp_path, text), {}) as store:
            tracemalloc.start()
            assert write_csv(store, tmp_path / "r.csv") == 2 * 100 * points
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < 1.2 * peaks[0]


def test_a_grid_is_an_xarray_dataset(swept):
    pytest.importorskip("xarray")
    with Store(swept) as store:
        runs, data = store.runs(), to_xarray(store)
    assert data.sizes == {"case": 2, LENGTH: 3, "shaper.shaper": 2}
    assert list(data.coords[LENGTH].values) == [6.0, 8.0, 10.0]
    for run in runs:
        cell = data.sel({"case": run.compared, **run.varied})
        assert cell["status"].item() == run.status
        assert cell["seconds"].item() == run.seconds
        for metric in ("peak_swing", "swing_at_the_end"):
            value = cell[metric].item()
            assert value == run.metrics[metric] if run.metrics else math.isnan(value)


def test_what_is_no_grid_is_no_dataset(tmp_path):
    pytest.importorskip("xarray")
    text = STUDY.replace('[vary."shaper.shaper"]\nvalues = ["zv", "zvd"]', '[plan]\nkind = "sobol"\nsamples = 4')
    with Store(tmp_path / "s.sqlite", study_in(tmp_path, text), {}) as store, pytest.raises(StudyError, match="this plan is sobol"):
        to_xarray(store)


def test_points_between_those_of_the_grid_are_left_out(swept, tmp_path):
    pytest.importorskip("xarray")
    with Store(tmp_path / "s.sqlite", study_in(tmp_path, STUDY), {}) as store:
        store.add([("still", (7.0, "zv"))])
        assert to_xarray(store).sizes[LENGTH] == 3
        assert write_csv(store, tmp_path / "r.csv") == 13
