"""Measured moves of machines whose truth is known: what is called proven holds on the true plant, and clean records are proven."""

from __future__ import annotations

import numpy as np
import pytest
from move_records import Record, left, made

from shaper_fmu.analysis.identification import CONTRADICTING, IdentificationError
from shaper_fmu.tune.identify.measured_table import Table
from shaper_fmu.tune.tuning import Tuning
from shaper_fmu.tune.tuning_measured import tune_measured

TROUBLED = [
    ("no", "rest", ["s_curve"], 1e-3),
    ("no", "begin", ["cycloid", "lag"], 1e-3),
    ("no", "move", ["trapezoid", "two_modes"], 1e-3),
    ("no", "move", ["fifth_order", "lag", "feedthrough"], 1e-4),
    ("no", "move", ["s_curve"], 0.05),
    ("no", "end", ["two_modes", "two_outputs"], 1e-3),
    ("no", "ring", ["clipped"], 1e-3),
    ("end", "rest", ["friction"], 1e-3),
    ("end", "begin", ["cubic"], 1e-3),
    ("end", "rest", ["clipped"], 1e-3),
    ("early", "rest", ["two_modes"], 1e-3),
    ("early", "begin", ["lag", "quantised"], 1e-3),
    ("early", "rest", ["two_moves"], 1e-3),
    ("input", "rest", ["lag", "two_modes"], 1e-3),
    ("input", "begin", ["filtered", "drift"], 1e-3),
    ("late", "rest", ["two_moves", "two_outputs"], 1e-3),
]
"""How the end of the excitation is told, where the record begins, what is wrong with it, and its noise: see `made`."""
CLEAN = [
    ("end", "rest", ["two_modes"]),
    ("late", "begin", ["drift"]),
    ("end", "begin", ["lag"]),
    ("no", "ring", []),
    ("no", "end", ["quantised"]),
]


def tuned(seed: int, told: str, start: str, kinds: list[str], noise: float) -> tuple[Tuning | None, float]:
    """The tuning of a record, None if that is refused, and what its shaper leaves on the true plant."""
    record = made(np.random.default_rng(seed), told, start, kinds, noise)
    try:
        found = tune_measured(record.table, **record.options)
    except IdentificationError:
        return None, 0.0
    chosen = found.choice is not None and found.choice.recommended is not None
    return found, left(found, record) if chosen else 0.0


@pytest.mark.parametrize("seed", range(len(TROUBLED)))
def test_what_is_proven_holds_on_the_true_plant(seed):
    """The shaper's impulses on the true poles and amplitudes (V of Singer and Seering 1990) leave no more than the bound says."""
    found, true = tuned(seed, *TROUBLED[seed])
    if found is None or found.verdict != "for_modes_found":
        assert found is None or not found.good
        return
    assert not {one.code for one in found.findings} & set(CONTRADICTING)
    assert found.choice is not None
    assert found.choice.recommended is not None
    assert true <= found.choice.recommended.worst_case


def test_what_noise_may_hide_is_not_proven():
    """A tenth of noise hides a second mode of 8 % at twice the frequency, at which the impulses for the one found add up again."""
    t = np.arange(0.0, 7.0, 0.05)
    poles, amplitudes = np.array([-0.12 + 6.0j, -0.25 + 12.0j]), np.array([[0.92], [0.08]])
    y = np.real(np.exp(np.multiply.outer(t, poles)) @ amplitudes)[:, 0] + 0.1 * np.random.default_rng(3).standard_normal(len(t))
    record = Record(Table({"time": t, "y": y}), poles, amplitudes, {"excitation_end": -1.0})
    found = tune_measured(record.table, **record.options)
    assert found.measured is not None
    assert len(found.measured.identification.modes) == 1
    assert found.choice is not None
    assert found.choice.recommended is not None
    assert left(found, record) > found.choice.recommended.worst_case
    assert found.verdict == "not_proven"
    assert "the noise may hide a mode" in found.summary


@pytest.mark.parametrize("seed", range(len(CLEAN)))
def test_clean_free_responses_are_proven(seed):
    """Noise of a thousandth, and nothing that a linear plant with a slow sensor would not do."""
    told, start, kinds = CLEAN[seed]
    found, true = tuned(100 + seed, told, start, kinds, 1e-3)
    assert found is not None
    assert found.verdict == "for_modes_found", found.summary
    assert true <= 0.05
