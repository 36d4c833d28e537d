"""Modes from free responses made by formulas: exact without noise, covered by their uncertainties with it, classified, refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from shaper_fmu.analysis.identification import FreeResponse, IdentificationError, free_response, identify, unexplained

STEP = 0.02


def pole(w: float, zeta: float) -> complex:
    return complex(-zeta * w, w * math.sqrt(1.0 - zeta * zeta))


def response(poles, residues, n: int = 1500, step: float = STEP) -> np.ndarray:
    """sum_k Re(residues_jk exp(poles_k t)), shape (n, m)."""
    t = step * np.arange(n)
    return np.real(np.exp(np.multiply.outer(t, np.array(poles))) @ np.atleast_2d(residues).T)


TWO = [pole(4.0, 0.01), pole(11.0, 0.03)]
SHAPES = np.array([[1.0, 0.3j], [0.5j, -0.4], [-0.2 + 0.1j, 0.05]])


def kinds(found) -> list[str]:
    return sorted(other.kind for other in found.others)


def test_modes_are_exact_without_noise():
    found = identify(free_response(response(TWO, SHAPES), STEP))
    assert [mode.pole for mode in found.modes] == pytest.approx(TWO, rel=1e-12)
    for k, mode in enumerate(found.modes):
        assert mode.residues[0] == pytest.approx(SHAPES[:, k], abs=1e-12)
    assert found.modes[0].natural_frequency == pytest.approx(4.0, rel=1e-12)
    assert found.modes[1].damping_ratio == pytest.approx(0.03, rel=1e-12)
    assert (found.others, found.findings, found.order) == ((), (), 4)
    # the share is of the sum of amplitudes, in the output that shows the mode best
    assert [mode.share for mode in found.modes] == pytest.approx([0.22360680 / 0.27360680, 0.4 / 0.9], rel=1e-7)
    assert found.response(found.time) == pytest.approx(response(TWO, SHAPES), abs=1e-12)
    assert np.abs(found.residual).max() < 1e-12


def test_experiments_share_poles_and_have_residues_of_their_own():
    """A mode that the first experiment hardly shows is taken from the second."""
    values = [response(TWO, [[1.0, 1e-9]]), response(TWO, [[1e-9, 1.0]])]
    found = identify([free_response(v, STEP, ["x"]) for v in values])
    assert [mode.pole for mode in found.modes] == pytest.approx(TWO, rel=1e-9)
    assert [mode.residues.shape for mode in found.modes] == [(2, 1), (2, 1)]
    assert found.modes[1].residues[1, 0] == pytest.approx(1.0, abs=1e-9)


def test_close_modes_are_told_apart():
    """2 % apart, 19 periods of the beat's quarter: without noise exactly; with 1 % noise to what the bound allows."""
    close = [pole(10.0, 0.005), pole(10.2, 0.005)]
    values = response(close, [[1.0, 0.8], [1.0, -0.7j]], 3000)
    found = identify(free_response(values, STEP))
    assert [mode.pole for mode in found.modes] == pytest.approx(close, rel=1e-10)
    noise = 0.01 * np.random.default_rng(2).standard_normal(values.shape)
    again = identify(free_response(values + noise, STEP))
    for mode, true in zip(again.modes, close, strict=True):
        assert abs(mode.natural_frequency - abs(true)) < 4.0 * mode.natural_frequency_std < 2e-3


def test_rigid_body_decay_and_offset_stand_beside_the_vibration():
    t = STEP * np.arange(1500)
    values = response([*TWO, -0.7], [[1.0, 0.3j, 2.0]])[:, 0] + 5.0 - 3.0 * t
    found = identify(free_response(values, STEP))
    assert [mode.pole for mode in found.modes] == pytest.approx(TWO, rel=1e-10)
    assert kinds(found) == ["decay", "drift", "offset"]
    parts = {other.kind: other for other in found.others}
    assert parts["decay"].pole == pytest.approx(-0.7, rel=1e-10)
    assert [parts[k].residues[0, 0].real for k in ("offset", "drift", "decay")] == pytest.approx([5.0, -3.0, 2.0], abs=1e-9)
    assert found.has("drift")
    assert found.response(t)[:, 0] == pytest.approx(values, abs=1e-10)


def test_constant_acceleration_is_three_poles_at_zero():
    t = STEP * np.arange(1500)
    found = identify(free_response(response(TWO, [[1.0, 0.3j]])[:, 0] + 0.25 * t * t, STEP))
    assert found.has("acceleration")
    assert next(o for o in found.others if o.kind == "acceleration").residues[0, 0].real == pytest.approx(0.25, rel=1e-9)
    assert [mode.pole for mode in found.modes] == pytest.approx(TWO, rel=1e-8)


def test_unstable_undamped_and_overdamped_poles():
    growing = identify(free_response(response([pole(4.0, -0.01), TWO[1]], [[1.0, 0.5]]), STEP))
    assert [mode.pole for mode in growing.modes] == pytest.approx(TWO[1:], rel=1e-9)
    assert kinds(growing) == ["unstable"]
    assert "no shaper helps" in growing.findings[0].text
    alone = identify(free_response(response([0.3, TWO[1]], [[1.0, 0.5]], 500), STEP))
    assert kinds(alone) == ["growth"]
    undamped = identify(free_response(response([pole(4.0, 0.0), TWO[1]], [[1.0, 0.5]]), STEP))
    assert [mode.natural_frequency for mode in undamped.modes] == pytest.approx([4.0, 11.0], rel=1e-12)
    assert 0.0 <= undamped.modes[0].damping_ratio < 1e-12
    noisy = response([pole(4.0, 0.0)], [[1.0]]) + 0.02 * np.random.default_rng(5).standard_normal((1500, 1))
    assert [mode.natural_frequency for mode in identify(free_response(noisy, STEP)).modes] == pytest.approx([4.0], rel=1e-3)


@pytest.mark.parametrize("poles", [[-1.0, -3.0], [pole(3.0, 0.97)], [-2.0]])
def test_what_does_not_vibrate_is_said_not_to(poles):
    found = identify(free_response(response(poles, [np.arange(1.0, len(poles) + 1.0)], 500), STEP))
    assert not found.vibrates
    assert found.has("no_vibration")
    assert found.others[0].kind in ("decay", "overdamped")


def test_harmonics_are_no_modes():
    """A slightly nonlinear spring adds multiples of the pole: 2 s and 3 s of 2 % and 1 %."""
    s = TWO[0]
    found = identify(free_response(response([s, 2 * s, 3 * s, 2 * s.real], [[1.0, 0.02j, 0.01, -0.02]]), STEP))
    assert [mode.pole for mode in found.modes] == pytest.approx([s], rel=1e-9)
    assert kinds(found) == ["harmonic"] * 3


def test_small_modes_are_left_out_as_asked():
    values = response(TWO, [[1.0, 1e-3]])
    assert len(identify(free_response(values, STEP), smallest_share=1e-4).modes) == 2
    found = identify(free_response(values, STEP), smallest_share=1e-2)
    assert len(found.modes) == 1
    assert found.has("minor")


def draws(count: int, noise: float):
    """Identifications of one to three random modes, one to three outputs, half of them with a drift, and the true poles."""
    rng = np.random.default_rng(11)
    for trial in range(count):
        k, m = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        w = 2.0 * np.cumprod(rng.uniform(1.3, 3.0, k))
        true = [pole(a, z) for a, z in zip(w, np.exp(rng.uniform(math.log(0.006), math.log(0.08), k)), strict=True)]
        residues = rng.uniform(0.5, 1.5, (m, k)) * np.exp(2j * math.pi * rng.random((m, k)))
        step = 2.0 * math.pi / w[-1] / 20.0
        n = min(2500, math.ceil(3.0 / min(-p.real for p in true) / step))
        values = response(true, residues, n, step)
        level = noise * np.sqrt(np.mean(values * values, axis=0))
        if trial % 2:
            values = values + rng.standard_normal(m) + np.linspace(0.0, 3.0, n)[:, None]
        yield identify(free_response(values + level * rng.standard_normal(values.shape), step)), true


def test_uncertainties_cover_the_truth():
    """45 random responses with white noise of 5 % of each output's RMS: of all modes' frequencies and damping ratios 95 % lie
    within 1.96 standard deviations; the count is within bounds of the binomial distribution that one family in a million misses. No
    mode is lost, none added (12 other families of 45 neither)."""
    inside, total = 0, 0
    for found, true in draws(45, 0.05):
        assert len(found.modes) == len(true)
        for mode, p in zip(found.modes, true, strict=True):
            inside += abs(mode.natural_frequency - abs(p)) < 1.96 * mode.natural_frequency_std
            inside += abs(mode.damping_ratio + p.real / abs(p)) < 1.96 * mode.damping_ratio_std
            total += 2
    assert binom.ppf(5e-7, total, 0.95) <= inside <= binom.ppf(1.0 - 5e-7, total, 0.95)


def test_standard_deviations_reach_the_bound():
    """A lightly damped sinusoid A exp(-alpha t) cos(w t + phi) in white noise, over many time constants: Fisher's information has
    the integrals of t^k exp(-2 alpha t), so the Cramer-Rao bounds are 16 sigma^2 alpha^3 h / A^2 for alpha and w, and
    8 sigma^2 alpha h for real and imaginary part of the residue."""
    w, zeta, sigma, h = 10.0, 0.02, 0.02, 0.01
    values = response([pole(w, zeta)], [[1.0]], 4000, h)
    values += sigma * np.random.default_rng(1).standard_normal(values.shape)
    mode = identify(free_response(values, h)).modes[0]
    bound = math.sqrt(16.0 * sigma**2 * (zeta * w) ** 3 * h)
    assert mode.natural_frequency_std == pytest.approx(bound, rel=0.1)
    assert mode.damping_ratio_std * w == pytest.approx(bound, rel=0.1)
    assert mode.residue_std[0, 0] == pytest.approx(math.sqrt(16.0 * sigma**2 * zeta * w * h), rel=0.1)


def test_coloured_noise_is_told():
    values = response(TWO, [[1.0, 0.5]])[:, 0]
    noise = np.convolve(np.random.default_rng(3).standard_normal(1600), np.ones(5) / 5.0, "valid")[:1500]
    found = identify(free_response(values + 0.05 * noise, STEP))
    assert found.has("coloured")
    assert not identify(free_response(values + 0.02 * noise[np.random.default_rng(4).permutation(1500)], STEP)).has("coloured")


def test_unexplained_tells_an_alias():
    """A mode of 100 rad/s seen every 0.05 s looks like one of 25.66 rad/s; other samples do not agree."""
    true = [pole(100.0, 0.001)]
    seen = identify(free_response(response(true, [[1.0]], 600, 0.05), 0.05))
    assert seen.modes[0].pole.imag == pytest.approx(2.0 * math.pi / 0.05 - 100.0, rel=1e-3)
    assert unexplained(free_response(response(true, [[1.0]], 600, 0.065), 0.065), seen) > 0.9
    right = identify(free_response(response(true, [[1.0]], 600, 0.01), 0.01))
    assert unexplained(free_response(response(true, [[1.0]], 600, 0.0065), 0.0065), right) < 1e-9


def refused(words: str, values, step: float = STEP, **options) -> None:
    with pytest.raises(IdentificationError, match=words):
        identify(values if isinstance(values, FreeResponse) else free_response(values, step), **options)


def test_data_without_an_answer_are_refused():
    slow = response([pole(1.0, 0.02)], [[1.0]], 300)
    refused("too short: 5.98 s are 0.9", slow)
    refused("too coarse: .* samples per period", response([pole(2.2, 0.001)], [[1.0]], 400, 1.0), 1.0)
    refused("nothing but noise", np.random.default_rng(0).standard_normal((800, 2)))
    refused("nothing moves", np.ones((100, 2)) + np.arange(100)[:, None])
    clipped = np.clip(response(TWO, [[1.0, 0.2]]), -0.4, 0.4)
    refused("x1 is clipped: it stays at 0.4", clipped)
    refused("20 samples are too few", np.zeros(20))
    refused("x2 is not a finite number at sample 3", np.where(np.arange(50)[:, None] == [9, 3], np.nan, 1.0))
    refused("step = -1 s must be a positive number", np.zeros(50), -1.0)
    with pytest.raises(IdentificationError, match="3 names for 1 outputs"):
        free_response(np.zeros(50), STEP, ["a", "b", "c"])
    with pytest.raises(IdentificationError, match="same outputs and the same step"):
        identify([free_response(slow, 0.1), free_response(slow, 0.2)])
    with pytest.raises(IdentificationError, match="no response"):
        identify([])
