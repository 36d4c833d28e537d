"""Measured responses: tables as instruments write them, uneven samples, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.analysis.identification import CONTRADICTING, IdentificationError
from shaper_fmu.master.results import Results
from shaper_fmu.tune.identify.measured import identify_measured
from shaper_fmu.tune.identify.measured_table import Table, read_table

POLE = complex(-0.3, 8.0)


def vibration(t: np.ndarray) -> np.ndarray:
    """A ring-down from t = 1 s on, before that the rising command of the excitation."""
    return np.where(t < 1.0, t, 1.0 + 0.2 * np.exp(POLE.real * (t - 1.0)) * np.sin(POLE.imag * (t - 1.0)))


def moved(noise: float, h: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """q'' + 0.6 q' + |POLE|^2 q = sin(2 pi (t - 2)) from 2 s to 3 s, at rest before; noise of this share of the ringing's amplitude.

    Its residues are integrals of exp(-POLE t) over the excitation: a sum of two exponentials.
    """
    t = np.arange(0.0, 15.0, h)
    until = np.clip(t - 2.0, 0.0, 1.0)
    drive = [2j * np.pi, -2j * np.pi]
    part = sum(k * (np.exp((s - POLE) * until) - 1.0) / (s - POLE) / 2j for k, s in zip((1.0, -1.0), drive, strict=True))
    x = np.imag(np.exp(POLE * np.maximum(0.0, t - 2.0)) * part) / POLE.imag
    return t, x + noise * np.abs(x[t > 3.0]).max() * np.random.default_rng(3).standard_normal(len(t))


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


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_apostrophes_against_formulas_are_no_part_of_names(tmp_path, separator):
    """Tables of our runs are read with the names that they were written of; an apostrophe that guards nothing is part of its name."""
    names = ["=cmd.x", "-x", "+y", "@z", "'=q", "'plain", " =w", "x"]
    Results(T[:3], {name: T[:3] * k for k, name in enumerate(names)}).to_csv(tmp_path / "run.csv")
    (tmp_path / "run.csv").write_text((tmp_path / "run.csv").read_text().replace(",", separator))
    found = read_table(tmp_path / "run.csv")
    assert found.names == ["time", *(name.strip() for name in names)]
    assert all(found[name.strip()].tolist() == (T[:3] * k).tolist() for k, name in enumerate(names))


def test_an_apostrophe_against_formulas_before_a_name_with_a_unit(tmp_path):
    (tmp_path / "r.csv").write_text("t [s],'-x [mm]\n0,1\n")
    assert read_table(tmp_path / "r.csv").units == {"t": "s", "-x": "mm"}


def test_the_excitation_ends_with_the_inputs_last_change():
    found = identify_measured(table(T, force=np.where(T < 1.0, 1.0, 0.0)), input="force")
    assert_found(found)
    assert found.excitation_end == pytest.approx(1.0)
    assert found.outputs == ("x",)


def test_a_record_that_is_free_throughout_needs_no_end():
    """The ring-down alone, from the end of the excitation on, and from amid the ringing."""
    for begin in (1.0, 2.37):
        found = identify_measured(table(T[begin <= T]))
        assert_found(found)
        assert [finding.code for finding in found.findings] == ["found_free"]
        assert found.excitation_end == pytest.approx(begin, abs=0.011)


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_without_an_end_it_is_found_where_the_modes_stay(noise):
    """A rest of 2 s, a move (a mode driven by the acceleration of a cycloid, of a second), and the ringing: about from its end on.

    In noise the cycloid's last part may pass for a mode that dies out at once; the mode itself is right, and it is said to be a guess.
    """
    t, x = moved(noise=noise)
    found = identify_measured(Table({"time": t, "x": x}))
    assert (2.9 if not noise else 2.6) <= found.excitation_end <= 3.3
    nearest = min((mode.pole for mode in found.identification.modes), key=lambda pole: abs(pole - POLE))
    assert nearest == pytest.approx(POLE, rel=1e-9 if not noise else 3e-3)
    assert noise or len(found.identification.modes) == 1
    assert found.findings[0].code == "assumed_free"


@pytest.mark.thorough
@pytest.mark.parametrize("noise", [0.002, 0.003, 0.004])
def test_an_end_that_is_told_too_early_is_contradicted(noise):
    """Where it is not (the move may look like modes that die out at once), the mode itself is right, so that nothing wrong is proven."""
    contradicted = 0
    t, x = moved(noise=noise)
    for early in (2.0, 2.2, 2.4, 2.6):
        found = identify_measured(Table({"time": t, "x": x}), excitation_end=early)
        against = bool({finding.code for finding in found.findings} & set(CONTRADICTING))
        contradicted += against
        assert against or min(abs(mode.pole - POLE) for mode in found.identification.modes) < 3e-3 * abs(POLE)
    assert contradicted >= 2  # of 4; of 40 with noise of 0.003, 38 were
    right = identify_measured(Table({"time": t, "x": x}), excitation_end=3.0)
    assert not {finding.code for finding in right.findings} & set(CONTRADICTING)


@pytest.mark.parametrize("kept_up", ["hum", "cycle"])
def test_a_motion_that_does_not_fade_proves_nothing(kept_up):
    """A hum of 15 rad/s beside the ringing, or a limit cycle alone: no shaper changes them. A mode of little damping fades."""
    ringing = 0.0 if kept_up == "cycle" else np.exp(POLE.real * T) * np.sin(POLE.imag * T)
    x = ringing + 0.3 * np.sin(15.0 * T) + 1e-3 * np.random.default_rng(1).standard_normal(len(T))
    found = identify_measured(Table({"time": T, "x": x}), excitation_end=0.0)
    told = [finding.text for finding in found.findings if finding.code == "not_decaying"]
    assert len(told) == 1
    assert "the motion at 15 rad/s does not decay over the record" in told[0]
    assert "not_decaying" in CONTRADICTING
    faint = np.exp(-0.005 * 15.0 * T) * np.sin(15.0 * T) + 1e-3 * np.random.default_rng(2).standard_normal(len(T))
    ringing_down = identify_measured(Table({"time": T, "x": faint}), excitation_end=0.0)
    assert "not_decaying" not in [finding.code for finding in ringing_down.findings]


def test_a_column_of_the_excitation_that_is_no_number_is_told():
    force = np.where(T < 1.0, 1.0, 0.0)
    force[7] = np.nan
    with pytest.raises(IdentificationError, match="force is not a finite number at row 8: nan"):
        identify_measured(table(T, force=force), input="force")


@pytest.mark.thorough
def test_a_record_that_does_not_tell_is_refused():
    t, x = moved(noise=0.003)
    with pytest.raises(IdentificationError, match="Give the end of the excitation"):
        identify_measured(Table({"time": t[t < 3.0], "x": x[t < 3.0]}))
    with pytest.raises(IdentificationError, match="is not a finite number"):
        identify_measured(Table({"time": t, "x": x}), excitation_end=math.nan)


def test_a_measured_input_may_be_noisy_but_must_come_to_rest():
    t, x = moved(noise=0.003)
    rng = np.random.default_rng(1)
    force = np.where((t >= 2.0) & (t < 3.0), np.sin(2.0 * np.pi * (t - 2.0)), 0.0)
    noisy = force + 0.01 * rng.standard_normal(len(t))
    found = identify_measured(Table({"time": t, "x": x, "force": noisy}), input="force")
    assert found.excitation_end == pytest.approx(3.0, abs=0.03)
    with pytest.raises(IdentificationError, match="does not come to rest"):
        identify_measured(Table({"time": t, "x": x, "force": noisy - 5.0 * x}), input="force")
    constant = identify_measured(Table({"time": t, "x": x, "force": np.ones(len(t))}), input="force")
    assert [finding.code for finding in constant.findings[:2]] == ["input_constant", "assumed_free"]


def test_values_in_steps_are_no_contradiction():
    """A sensor of a hundred steps over the ringing: what the fit leaves is no more than the steps."""
    t, x = moved(noise=0.0)
    size = float(np.ptp(x[t > 3.0])) / 100.0
    found = identify_measured(Table({"time": t, "x": size * np.round(x / size)}), excitation_end=3.0)
    assert not {finding.code for finding in found.findings} & set(CONTRADICTING)
    assert [mode.pole for mode in found.identification.modes] == pytest.approx([POLE], rel=3e-3)


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
        (table(T), {"units": {"time": "furlong"}}, "is in 'furlong'; s, ms, us, ns, min and h"),
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
        ("t,x\n0,1\n1,one\n", "line 3: 'one' is not a number"),
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


def modes_of(hertz: list[float], zeta: float = 0.01, duration: float = 12.0, h: float = 0.002) -> tuple[Table, np.ndarray]:
    """A ring-down of modes whose amplitudes are 1, 1/2, 1/3, ...; and their poles."""
    t, w = np.arange(0.0, duration, h), 2.0 * math.pi * np.array(hertz)
    poles = w * complex(-zeta, math.sqrt(1.0 - zeta * zeta))
    phases = np.random.default_rng(10).uniform(0.0, 2.0 * math.pi, len(w))
    motion = (np.exp(np.outer(t, poles) + 1j * phases) / np.arange(1, len(w) + 1)).real.sum(axis=1)
    return Table({"time": t, "x": motion}), poles


@pytest.mark.parametrize(
    "hertz",
    [
        [1.0, 2.0, 3.0, 4.0, 5.0],  # each a sum of two others, and damped as such sums are
        [1.1, 1.9, 2.8, 4.1, 5.6, 7.7],
        pytest.param([1.1, 1.9, 2.8, 4.1, 5.6, 7.7, 10.3, 13.9, 18.2, 24.0], marks=pytest.mark.thorough),
        pytest.param([2.0, 5.0, 8.0, 10.0, 15.0, 23.0, 31.0, 38.0, 46.0, 55.0], marks=pytest.mark.thorough),
    ],
)
def test_modes_at_sums_of_others_are_modes(hertz):
    """Frequencies that people choose are round numbers: 4.1 = 1.1 + 1.1 + 1.9 is by chance, and the part is too large for a harmonic."""
    given, poles = modes_of(hertz)
    found = identify_measured(given)
    assert [mode.pole for mode in found.identification.modes] == pytest.approx(poles.tolist(), rel=1e-6)
    assert [one.code for one in found.findings] == ["found_free"]


def test_a_small_mode_at_a_sum_of_two_is_one():
    """Of 6 % of the response, more than may be left: a quadratic force would make as much of the larger of the two as 2 x 2 Hz."""
    t, w = np.arange(0.0, 12.0, 0.002), 2.0 * math.pi * np.array([2.0, 3.0, 5.0])
    poles = w * complex(-0.01, math.sqrt(1.0 - 1e-4))
    found = identify_measured(Table({"time": t, "x": (np.exp(np.outer(t, poles)) * [1.0, 0.6, 0.1]).imag.sum(axis=1)}))
    assert [mode.pole for mode in found.identification.modes] == pytest.approx(poles.tolist(), rel=1e-6)
