"""Tables as instruments, spreadsheets and 3D printers write them: units in names, headers and none, spectra, clipped values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from command_line import typed

from shaper_fmu.analysis.identification import IdentificationError, free_response
from shaper_fmu.analysis.identification.clipping import check_clipping
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_parts import identify_ring_downs
from shaper_fmu.tune.identify.measured_table import Table, read_table
from shaper_fmu.tune.tuning_measured import tune_measured

HERTZ, ZETA = 8.0, 0.02
W = 2.0 * math.pi * HERTZ
POLE = complex(-ZETA * W, W * math.sqrt(1.0 - ZETA**2))
T = np.arange(0.0, 2.0, 0.002)
X = np.real(np.exp(POLE * T))


def written(path, header: str, factor: float, separator: str = ",") -> None:
    rows = [separator.join((repr(a), repr(b))) for a, b in zip(np.round(T * factor, 9).tolist(), X.tolist(), strict=True)]
    path.write_text("\n".join([*([header] if header else []), *rows]) + "\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("time_ms,x", 1e3), ("Time/ms,x", 1e3), ("t [us],x", 1e6), ("t(ms),x", 1e3), ("Time (s),x", 1.0), ("TIME_S,x", 1.0),
        ("time_us,x", 1e6), ("timestamp_ns,x", 1e9), ("time in ms,x", 1e3), ("millis,x", 1e3), ("t_ms,x", 1e3), ("Time [µs],x", 1e6),
        ("#time,accel_x", 1.0), ("# time_ms,accel_x", 1e3), ("t/min,x", 1.0 / 60.0), ("Zeit/ms,x", 1e3), ("time,x\n(ms),(mV)", 1e3),
        ("% t,x", 1.0), ("time,x", 1.0),
    ],
)  # fmt: skip
def test_the_unit_of_time_is_read_from_the_header(tmp_path, header, factor):
    written(tmp_path / "r.csv", header, factor)
    found = identify_measured(tmp_path / "r.csv")
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=1e-6)
    assert not {one.code for one in found.findings} & {"time_unit", "assumed_time", "no_header"}


def test_the_columns_of_a_printers_accelerometer(tmp_path):
    rows = "\n".join(f"{1234.5 + t:.6f},{9.0 * x:.6f},{100.0 * x:.6f},{9800.0 + x:.6f}" for t, x in zip(T, X, strict=True))
    (tmp_path / "raw_data_x.csv").write_text(f"#time,accel_x,accel_y,accel_z\n{rows}\n")
    table = read_table(tmp_path / "raw_data_x.csv")
    assert table.names == ["time", "accel_x", "accel_y", "accel_z"]
    assert len(table["time"]) == len(T)
    found = identify_measured(table, ["accel_y"])
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=1e-4)


def test_blanks_and_more_comments(tmp_path):
    written(tmp_path / "r.txt", "# a recorder\n# t_ms x", 1e3, "   ")
    table = read_table(tmp_path / "r.txt")
    assert table.names == ["t_ms", "x"]
    assert len(table["x"]) == len(T)


def test_a_table_without_a_header_loses_no_row(tmp_path):
    written(tmp_path / "bare.csv", "", 1.0)
    table = read_table(tmp_path / "bare.csv")
    assert table.names == ["column1", "column2"]
    assert table["column2"].tolist() == X.tolist()
    found = identify_measured(table)
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=1e-6)
    texts = {one.code: one.text for one in found.findings}
    assert texts["no_header"] == "bare.csv has no header: its columns are called column1 to column2"
    assert "the first one, 'column1', is taken as the time in s" in texts["assumed_time"]


def test_whole_numbers_without_a_unit_are_told(tmp_path):
    written(tmp_path / "r.csv", "time,x", 1e3)
    assert "time_unit" in [one.code for one in identify_measured(tmp_path / "r.csv").findings]
    right = identify_measured(tmp_path / "r.csv", time_unit="ms")
    assert [mode.pole for mode in right.identification.modes] == pytest.approx([POLE], rel=1e-6)
    assert "time_unit" not in [one.code for one in right.findings]
    done = typed("tune", "r.csv", "--time-unit", "ms", "--no-report", cwd=tmp_path)
    assert f"{HERTZ:.0f} " in done.stdout or f"{HERTZ:.1f}" in done.stdout
    assert "for modes found: " in done.stdout
    with pytest.raises(IdentificationError, match="is in 'weeks'"):
        identify_measured(tmp_path / "r.csv", time_unit="weeks")


@pytest.mark.parametrize("name", ["freq", "Frequency [Hz]", "f/Hz", "freq_hz", "Hz", "omega"])
def test_a_spectrum_is_refused(tmp_path, name):
    rows = "\n".join(f"{f},{1.0 / (1.0 + (f - 40.0) ** 2)},1.0" for f in range(1, 200))
    (tmp_path / "psd.csv").write_text(f"{name},psd_x,psd_y\n{rows}\n")
    with pytest.raises(
        IdentificationError, match=r"no response over time: its first column is .*, so that psd_x, psd_y seem to be a spectrum"
    ):
        identify_measured(tmp_path / "psd.csv")


def test_what_holds_is_said_for_measured_data():
    found = tune_measured(Table({"time": T, "x": X + 1e-3 * np.random.default_rng(1).standard_normal(len(T))}), excitation_end=0.0)
    assert found.verdict == "for_modes_found"
    assert "This holds for the modes found in the table" in found.summary
    assert "proven" not in found.summary.replace("(proven)", "")


def swing(rng: np.random.Generator, samples: float) -> np.ndarray:
    """A ring-down of little damping, or of two modes, of peak 1."""
    t = np.arange(0.0, 20.0, 1.0 / samples)
    zeta = np.exp(rng.uniform(math.log(5e-4), math.log(0.01)))
    y = np.exp(-zeta * 2.0 * np.pi * t) * np.cos(2.0 * np.pi * t + rng.uniform(0.0, 2.0 * np.pi))
    y = y + rng.choice([0.0, 0.3]) * np.exp(-0.3 * t) * np.cos(2.7 * 2.0 * np.pi * t + rng.uniform(0.0, 2.0 * np.pi))
    return y / np.abs(y).max()


def is_clipped(values: np.ndarray, quantum: float) -> bool:
    try:
        check_clipping(free_response(values, 0.01, None, quantum / math.sqrt(12.0)))
    except IdentificationError as error:
        return "is clipped" in str(error)
    return False


def tops(values: np.ndarray, limit: float) -> int:
    """How often values stay beyond a limit for four samples and more."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (values > limit).astype(int), [0]])))
    return int(np.count_nonzero((edges[1::2] - edges[::2] >= 4) & (edges[::2] > 0)))


def test_a_quantised_peak_is_not_clipped_and_a_noisy_plateau_is():
    """Sensors of 8 to 12 bits, noise of 0 to 0.4 %, 12 to 200 samples a period; clipped at 0.8 of the peak before or after the noise."""
    rng = np.random.default_rng(5)
    refused, found = 0, {"before": 0, "after": 0}
    count, clipped = 150, 0
    for number in range(count):
        y = swing(rng, rng.choice([12, 20, 50, 200]))
        noise = rng.choice([0.0, 1e-3, 4e-3]) * rng.standard_normal(len(y))
        q = 2.0 / 2.0 ** rng.choice([8, 10, 12])

        def seen(values: np.ndarray, step: float = q if number % 2 else 0.0) -> bool:
            return is_clipped(step * np.round(values / step) if step else values, step)

        refused += seen(y + noise)
        if max(tops(y, 0.8), tops(-y, 0.8)) >= 2:
            clipped += 1
            found["before"] += seen(np.clip(y, -0.8, 0.8) + noise)
            found["after"] += seen(np.clip(y + noise, -0.8, 0.8))
    print(
        f"clipping: {refused} of {count} sound records refused; of {clipped} clipped {found['before']} and {found['after']} found"
    )
    assert refused == 0
    assert min(found.values()) >= 0.9 * clipped > 50


def test_an_encoders_good_ring_down_is_tuned():
    """12 bits, a damping ratio of 0.1 %: refused as clipped before."""
    t = np.arange(0.0, 4.0, 1e-3)
    y = np.exp(-0.001 * W * t) * np.cos(W * t)
    q = 2.0 / 4096
    found = tune_measured(Table({"time": t, "x": q * np.round(y / q)}), excitation_end=0.0)
    assert found.good, found.summary
    assert found.measured is not None
    (mode,) = found.measured.identification.modes
    assert mode.natural_frequency == pytest.approx(W, rel=1e-4)


def test_with_an_assumed_unit_of_time_nothing_is_proven(tmp_path):
    """Sample numbers, or milliseconds without a unit, are not seconds: all frequencies would be wrong."""
    for header in ("time,x", "sample,x"):
        written(tmp_path / "r.csv", header, 1e3)
        done = typed("tune", "r.csv", "--no-report", cwd=tmp_path)
        assert done.returncode == 1
        assert "not proven: " in done.stdout
        assert "tell the unit (--time-unit)" in done.stdout


def test_a_temperature_is_not_the_time(tmp_path):
    rows = "\n".join(f"{1e3 * t:.6f},{x!r},{25.0 - t}" for t, x in zip(T.tolist(), X.tolist(), strict=True))
    (tmp_path / "r.csv").write_text(f"time_ms,x,T\n{rows}\n")
    found = identify_measured(tmp_path / "r.csv", ["x"])
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=1e-6)


@pytest.mark.parametrize("rows", [1, 2])
@pytest.mark.filterwarnings("error")
def test_too_few_rows_are_told(tmp_path, rows):
    (tmp_path / "r.csv").write_text("t,x\n" + "".join(f"{k},1.0\n" for k in range(rows)))
    with pytest.raises(IdentificationError, match="one row of" if rows == 1 else "2 rows of"):
        identify_ring_downs(tmp_path / "r.csv")


def test_a_constant_column_does_not_move(tmp_path):
    (tmp_path / "r.csv").write_text("t,x\n" + "".join(f"{0.01 * k},1.0\n" for k in range(500)))
    with pytest.raises(IdentificationError, match="nothing moves"):
        identify_ring_downs(tmp_path / "r.csv")
