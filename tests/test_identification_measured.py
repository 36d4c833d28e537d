"""Measured responses: tables as instruments write them, uneven samples, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.analysis.identification import IdentificationError
from shaper_fmu.tune.measured import identify_measured
from shaper_fmu.tune.measured_table import Table, read_table

POLE = complex(-0.3, 8.0)


def vibration(t: np.ndarray) -> np.ndarray:
    """A ring-down from t = 1 s on, before that the rising command of the excitation."""
    return np.where(t < 1.0, t, 1.0 + 0.2 * np.exp(POLE.real * (t - 1.0)) * np.sin(POLE.imag * (t - 1.0)))


def table(t: np.ndarray, **columns: np.ndarray) -> Table:
    return Table({"time": t, "x": vibration(t), **columns})


T = np.arange(0.0, 12.0, 0.01)


def assert_found(found, rel: float = 1e-9) -> None:
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=rel)


def test_a_csv_file_with_units_and_the_end_of_the_excitation(tmp_path):
    path = tmp_path / "ring.csv"
    rows = [f"{1000.0 * t!r},{x!r},{7.0!r}" for t, x in zip(T.tolist(), vibration(T).tolist(), strict=True)]
    path.write_text("Time [ms],position [mm],temperature (degC)\n" + "\n".join(rows) + "\n")
    found = identify_measured(path, ["position"], excitation_end=1.0)
    assert_found(found)
    assert (found.outputs, found.units, found.findings) == (("position",), ("mm",), ())
    assert found.time[0] == pytest.approx(1.01)
    assert found.identification.step == pytest.approx(0.01, rel=1e-12)
    residue = found.identification.modes[0].residues[0, 0] * np.exp(-POLE * 0.01)
    assert residue == pytest.approx(-0.2j, abs=1e-9)


def test_semicolons_and_decimal_commas(tmp_path):
    path = tmp_path / "ring.csv"
    rows = [f"{t!r};{x!r}".replace(".", ",") for t, x in zip(T.tolist(), vibration(T).tolist(), strict=True)]
    path.write_text("\ufefft;x\n" + "\n".join(rows) + "\n\n", encoding="utf-8")
    assert_found(identify_measured(path, excitation_end=1.0))


def test_parquet_gives_the_same(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"time": T, "x": vibration(T)}), tmp_path / "ring.parquet")
    found = identify_measured(tmp_path / "ring.parquet", excitation_end=1.0)
    assert found.response.tolist() == identify_measured(table(T), excitation_end=1.0).response.tolist()
    (tmp_path / "bad.parquet").write_text("no table")
    with pytest.raises(IdentificationError, match=r"bad\.parquet"):
        read_table(tmp_path / "bad.parquet")


def test_the_excitation_ends_with_the_inputs_last_change():
    found = identify_measured(table(T, force=np.where(T < 1.0, 1.0, 0.0)), input="force")
    assert_found(found)
    assert found.excitation_end == pytest.approx(1.0)
    assert found.outputs == ("x",)


def test_without_an_end_it_is_free_from_its_largest_deviation_on():
    """That is the first quarter of the period after the end, or the beginning of the record here: both are told."""
    t = T[T >= 1.0]
    found = identify_measured(table(t))
    assert_found(found)
    assert found.findings[0].code == "assumed_free"
    assert 1.0 < found.excitation_end < 1.0 + 2.0 * math.pi / POLE.imag


def test_uneven_samples_are_interpolated_and_it_is_said():
    """Times that wander by a tenth of the step: cubic splines err by (w h)^4 / 384 or so."""
    rng = np.random.default_rng(0)
    t = T + 0.002 * rng.uniform(-0.5, 0.5, len(T))
    found = identify_measured(table(t), excitation_end=1.0)
    assert found.findings[0].code == "resampled"
    assert_found(found, 1e-5)


def test_rounded_times_are_even():
    t = np.round(T, 4) + 0.0
    assert identify_measured(table(t), excitation_end=1.0).findings == ()
    assert_found(identify_measured(Table({"t": np.round(T + 1e-5, 4), "x": vibration(T)}), excitation_end=1.0), 1e-5)


def test_measured_noise_is_told_as_uncertainty():
    noise = 0.002 * np.random.default_rng(1).standard_normal(len(T))
    found = identify_measured(Table({"time": T, "x": vibration(T) + noise}), excitation_end=1.0).identification
    (mode,) = found.modes
    assert found.noise[0, 0] == pytest.approx(0.002, rel=0.1)
    assert abs(mode.natural_frequency - abs(POLE)) < 4.0 * mode.natural_frequency_std < 0.02


@pytest.mark.parametrize(
    ("made", "options", "words"),
    [
        (table(T), {"outputs": ["y"]}, "no column 'y'"),
        (table(T), {"time": "tmie"}, "Did you mean 'time'"),
        (table(T), {"excitation_end": 20.0}, "nothing is left after the end of the excitation at 20 s"),
        (table(T), {"units": {"time": "furlong"}}, "is in 'furlong'; s, ms, us and min"),
        (table(np.where(T[50] == T, T[48], T)), {}, "time does not increase from row 50 on"),
        (table(np.where(T > 5.0, T + 1.0, T)), {"excitation_end": 1.0}, "samples are missing: from 5 s to 6.01 s"),
        (Table({"time": T}), {}, "no column of a response"),
        (table(T[:120]), {"excitation_end": 1.0}, "19 samples are too few|too few"),
        (table(T[:160]), {"excitation_end": 1.0}, "too short"),
    ],
)
def test_what_is_refused(made, options, words):
    with pytest.raises(IdentificationError, match=words):
        identify_measured(made, **options)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("t,x\n", "there is no row of numbers"),
        ("t,x\n0,1\n1,one\n", "line 3: 'one' is no number"),
        ("t,x\n0,1\n1\n", "line 3: 1 values, where the header has 2"),
        ("t,x,x\n0,1,2\n", "two columns 'x'"),
    ],
)
def test_files_that_make_no_sense(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(IdentificationError, match=words):
        read_table(path)
    with pytest.raises(IdentificationError, match=r"none\.csv: No such file"):
        read_table(tmp_path / "none.csv")
