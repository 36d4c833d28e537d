"""The families of shapers: closed forms, published values, and the equations that define them."""

from __future__ import annotations

import cmath
import math
import random

import pytest
from compiled_kernels import Kernels, record_of

from shaper_fmu.commands.input_shaper import InputShaper
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.all_modes import NO_SOLUTION
from shaper_fmu.kinds.shapers import Shaper

T = 2.0 * math.pi  # period of 1 rad/s


def complex_v(sequence: ImpulseSequence, ratio: float, zeta: float) -> float:
    """V at ratio * 1 rad/s with matched damping, in complex form, independent of the design's own sums."""
    pole = ratio * complex(-zeta, math.sqrt(1 - zeta**2))
    return abs(
        sum(a * cmath.exp(pole * (sequence.duration - t)) for a, t in zip(sequence.amplitudes, sequence.delays, strict=True))
    )


def v_slope(sequence: ImpulseSequence, ratio: float, zeta: float) -> float:
    """dV/dr by central differences of order 4."""
    h = 1e-3
    values = [complex_v(sequence, ratio + k * h, zeta) for k in (-2, -1, 1, 2)]
    return (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h)


# Undamped: duration / T, amplitudes, I(5 %), I(10 %). Closed forms of Smith 1958, Singer and Seering 1990, Singhose et al.
# 1994-1997 evaluated to the digits printed; the insensitivities are crossings of V, printed to about 2e-5.
UNDAMPED = {
    "zv": (0.5, [1 / 2, 1 / 2], 0.063689, 0.12753),
    "mzv": (0.75, [0.292893, 0.414214, 0.292893], 0.10349, 0.21437),
    "zvd": (1.0, [1 / 4, 1 / 2, 1 / 4], 0.287133, 0.40965),
    "ei": (1.0, [0.2625, 0.475, 0.2625], 0.399451, 0.4935),
    "zvdd": (1.5, [1 / 8, 3 / 8, 3 / 8, 1 / 8], 0.480382, 0.61457),
    "two_hump_ei": (1.5, [0.159797, 0.340203, 0.340203, 0.159797], 0.72453, 0.80599),
    "zvddd": (2.0, [1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16], 0.627129, 0.76038),
    "three_hump_ei": (2.0, [0.11238, 0.2375, 0.300241, 0.2375, 0.11238], 0.96389, 1.0314),
    "um_zv": (1 / 3, [1, -1, 1], 0.0551, None),
    "um_zvd": (0.732468, [1, -1, 1, -1, 1], 0.258, None),
}


@pytest.mark.parametrize("kind", UNDAMPED)
def test_undamped_table(kind):
    duration, amplitudes, five, ten = UNDAMPED[kind]
    sequence = shaper(kind, 1.0)
    assert sequence.duration / T == pytest.approx(duration, abs=1e-6)
    assert sequence.amplitudes == pytest.approx(amplitudes, abs=1e-6)
    assert sequence.insensitivity(1.0) == pytest.approx(five, abs={"um_zv": 6e-5, "um_zvd": 6e-4}.get(kind, 2e-5))
    if ten is not None:
        assert sequence.insensitivity(1.0, tolerance=0.1) == pytest.approx(
            ten, abs=6e-5 if kind in ("ei", "three_hump_ei") else 2e-5
        )


@pytest.mark.parametrize("tolerance", [0.01, 0.05, 0.2])
def test_undamped_insensitivity_of_ei_is_the_closed_form(tolerance):
    """I = 2 - (2/pi) acos((3V - 1)/(1 + V))."""
    expected = 2 - 2 / math.pi * math.acos((3 * tolerance - 1) / (1 + tolerance))
    assert shaper("ei", 3.0, vibration_tolerance=tolerance).insensitivity(3.0, tolerance=tolerance) == pytest.approx(
        expected, abs=1e-6
    )


# Damped EI for V = 5 %: zeta: (amplitudes, t2/Tn, t3/Tn, I(5 %)), solved independently to the printed digits
EI = {
    0.05: ([0.30676, 0.46765, 0.225589], 0.501696, 0.999494, 0.4332),
    0.1: ([0.354713, 0.453421, 0.191866], 0.505134, 1.000925, 0.4720),
    0.2: ([0.46122, 0.404549, 0.134231], 0.518598, 1.009112, 0.5716),
    0.3: ([0.580378, 0.330251, 0.089371], 0.545782, 1.023722, 0.7212),
}


@pytest.mark.parametrize("zeta", EI)
def test_damped_ei_table(zeta):
    amplitudes, second, third, five = EI[zeta]
    sequence = shaper("ei", 1.0, zeta)
    assert sequence.amplitudes == pytest.approx(amplitudes, abs=1e-6)
    assert [t / T for t in sequence.delays] == pytest.approx([0.0, second, third], abs=1e-6)
    assert sequence.insensitivity(1.0, zeta) == pytest.approx(five, abs=6e-5)


UM_ZV = {
    0.0: (0.16666667, 0.33333333),
    0.05: (0.1814057, 0.3339256),
    0.1: (0.1967999, 0.3357174),
    0.2: (0.2299023, 0.3431184),
    0.3: (0.2669397, 0.3563500),
}
UM_ZVD = {0.0: (0.08951255, 0.36623382, 0.6429551, 0.73246765), 0.1: (0.12030677, 0.35983063, 0.67456449, 0.73853028)}


@pytest.mark.parametrize(
    ("kind", "zeta", "times"), [("um_zv", z, t) for z, t in UM_ZV.items()] + [("um_zvd", z, t) for z, t in UM_ZVD.items()]
)
def test_unity_magnitude_tables(kind, zeta, times):
    sequence = shaper(kind, 1.0, zeta)
    assert [t / T for t in sequence.delays[1:]] == pytest.approx(times, abs=1e-7)
    assert sequence.amplitudes == tuple((-1.0) ** i for i in range(len(times) + 1))


def test_mzv_and_matched_insensitivities_at_ten_percent_damping():
    assert shaper("mzv", 1.0, 0.1).amplitudes == pytest.approx([0.365128, 0.407489, 0.227383], abs=1e-6)
    found = [shaper(kind, 1.0, 0.1).insensitivity(1.0, 0.1) for kind in ("zv", "mzv", "zvd", "zvdd", "zvddd")]
    assert found == pytest.approx([0.0751, 0.1341, 0.3402, 0.5744, 0.7587], abs=6e-5)


def test_equal_impulses():
    """MISZV: n equal impulses T/n apart; I(5 %) for n = 2 .. 5."""
    found = []
    for n in range(2, 6):
        sequence = shaper("miszv", 1.0, equal_impulses=n)
        assert sequence.amplitudes == pytest.approx([1 / n] * n, abs=1e-15)
        assert sequence.delays == pytest.approx([i * T / n for i in range(n)], abs=1e-14)
        found.append(sequence.insensitivity(1.0))
    assert found == pytest.approx([0.0637, 0.0829, 0.0904, 0.0940], abs=6e-5)


@pytest.mark.parametrize(("b", "duration"), [(0.25, 0.435906), (0.5, 0.391827), (0.75, 0.359017), (1.0, 1 / 3)])
def test_specified_negative_amplitude(b, duration):
    sequence = shaper("sna_zv", 1.0, negative_amplitude=b)
    assert sequence.amplitudes == pytest.approx([(1 + b) / 2, -b, (1 + b) / 2], abs=1e-15)
    assert sequence.duration / T == pytest.approx(duration, abs=1e-6)


# The largest damping ratio at which each is tested, well inside the range where it exists for a tolerance up to 20 %
RANGES = {"ei": 0.4, "two_hump_ei": 0.19, "three_hump_ei": 0.11, "um_zv": 0.9, "um_zvd": 0.9, "um_ei": 0.6}


@pytest.mark.parametrize("kind", RANGES)
def test_random_designs_solve_their_equations(kind):
    """200 random (zeta, tolerance): certificate below 1e-11, amplitudes as they must be, the conditions seen from outside."""
    rng = random.Random(kind)
    for _ in range(200):
        zeta, tolerance = rng.uniform(0.0, RANGES[kind]), rng.uniform(0.01, 0.2)
        sequence = shaper(kind, 1.0, zeta, vibration_tolerance=tolerance)
        assert sequence.certificate < 1e-11
        assert sum(sequence.amplitudes) == pytest.approx(1.0, abs=1e-11)
        if kind.startswith("um"):
            assert {abs(a) for a in sequence.amplitudes} == {1.0}
        else:
            assert min(sequence.amplitudes) > 0.0
        expected = tolerance if kind in ("ei", "three_hump_ei", "um_ei") else 0.0
        assert complex_v(sequence, 1.0, zeta) == pytest.approx(expected, abs=1e-10)
        if kind in ("ei", "three_hump_ei", "um_ei"):
            assert v_slope(sequence, 1.0, zeta) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("kind", "humps"), [("ei", 1), ("two_hump_ei", 2), ("three_hump_ei", 3)])
@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.1])
@pytest.mark.parametrize("tolerance", [0.02, 0.05, 0.1])
def test_humps_reach_the_tolerance_and_no_further(kind, humps, zeta, tolerance):
    """A dense scan of V inside the tolerated band: as many maxima as humps, each equal to the tolerance."""
    sequence = shaper(kind, 1.0, zeta, vibration_tolerance=tolerance)
    width = sequence.insensitivity(1.0, zeta, tolerance * (1 + 1e-9))
    ratios = [1 + (i / 20000 - 0.5) * 2 * width for i in range(20001)]
    values = [complex_v(sequence, r, zeta) if r > 0 else 1.0 for r in ratios]
    peaks = [v for a, v, b in zip(values, values[1:], values[2:], strict=False) if a < v >= b and v < 2 * tolerance]
    assert peaks[:humps] == pytest.approx([tolerance] * humps, abs=1e-6)
    assert all(v == pytest.approx(tolerance, abs=1e-6) for v in peaks)


def test_a_scaled_undamped_ei_is_not_a_damped_one():
    """At zeta = 0.3 scaling by K^i gives I = .577, the solved shaper .721."""
    zeta = 0.3
    k = math.exp(-zeta * math.pi / math.sqrt(1 - zeta**2))
    scaled = [a * k**i for i, a in enumerate([0.2625, 0.475, 0.2625])]
    fitted = ImpulseSequence(tuple(a / sum(scaled) for a in scaled), tuple(i * math.pi / math.sqrt(1 - zeta**2) for i in range(3)))
    assert fitted.insensitivity(1.0, zeta) == pytest.approx(0.577, abs=6e-4)
    assert shaper("ei", 1.0, zeta).insensitivity(1.0, zeta) == pytest.approx(0.721, abs=6e-4)


# Faults that other implementations are known for


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.1, 0.2])
def test_three_hump_ei_keeps_its_tolerance_when_damped(zeta):
    """A published cubic fit with a lost comma, and the fit itself (5.72 % for 5 %), would fail here."""
    assert complex_v(shaper("three_hump_ei", 1.0, zeta), 1.0, zeta) == pytest.approx(0.05, abs=1e-10)


def test_damped_designs_follow_the_tolerance():
    found = [complex_v(shaper("ei", 1.0, 0.1, vibration_tolerance=v), 1.0, 0.1) for v in (0.01, 0.05, 0.15)]
    assert found == pytest.approx([0.01, 0.05, 0.15], abs=1e-10)


def test_multi_hump_times_are_not_scaled_by_the_damped_period():
    """The solved times differ from i Td/2; a ZVD's do not."""
    half = math.pi / math.sqrt(1 - 0.2**2)
    assert shaper("zvd", 1.0, 0.2).delays == pytest.approx([0.0, half, 2 * half])
    assert abs(shaper("two_hump_ei", 1.0, 0.2).delays[3] - 3 * half) > 0.1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("zvx", 1.0), "there is no shaper 'zvx'. Did you mean 'zv"),
        ((None, 1.0), "there is no shaper None"),
        (("custom", 1.0), "there is no shaper 'custom'"),
        (("zv", -1.0), "natural_frequency = -1.0 is outside its domain > 0"),
        (("zv", 1.0, 1.0), "damping_ratio = 1.0 is outside its domain 0 <= zeta < 1"),
        (("zv", [1.0, 2.0, 3.0], [0.1, 0.2]), "2 damping ratios for 3 natural frequencies"),
        (("zv", "fast"), "natural_frequency = 'fast': a text where a number is needed"),
        (("zv", []), "give a number, or one for each mode"),
        (("three_hump_ei", 1.0, 0.6), "no three_hump_ei shaper was found for the damping ratio 0.6, only up to 0.27"),
    ],
)
def test_what_is_impossible_is_told(arguments, words):
    with pytest.raises(ComponentError, match=words):
        shaper(*arguments)


@pytest.mark.parametrize(
    ("amplitudes", "delays", "words"),
    [((1.0,), (0.0, 1.0), "each impulse needs both"), ((1.0, 0.0), (0.0, -1.0), "not decrease"), ((math.nan,), (0.0,), "finite")],
)
def test_wrong_sequences_are_refused(amplitudes, delays, words):
    with pytest.raises(ComponentError, match=words):
        ImpulseSequence(amplitudes, delays)


@pytest.mark.parametrize("kind", [item.name for item in Shaper if item.name != "custom"])
def test_the_fmus_component_designs_the_same(kind):
    component = InputShaper(shaper=kind, modes=2, natural_frequency=[3.0, 7.1], damping_ratio=[0.06, 0.02])
    component.initialize()
    sequence = shaper(kind, [3.0, 7.1], [0.06, 0.02])
    assert tuple(component.amplitude[: component.impulses]) == sequence.amplitudes
    assert tuple(component.delay[: component.impulses]) == sequence.delays


@pytest.mark.parametrize("samples", [21, 41, 101])
def test_what_sampling_costs(samples):
    """ZV, its second impulse on a grid of N samples per period, half a sample off: sin(pi/2N) rounded, 1 - cos-like when split.

    At N = 21 that is 7.5 % and 0.56 %: rounding shifts by half a sample, splitting over both neighbours leaves
    (2 pi/N)^2 / 16.
    """
    h = T / samples  # an odd N puts T/2 in the middle between two samples
    rounded = ImpulseSequence((0.5, 0.5), (0.0, math.pi + h / 2))
    split = ImpulseSequence((0.5, 0.25, 0.25), (0.0, math.pi - h / 2, math.pi + h / 2))
    assert complex_v(rounded, 1.0, 0.0) == pytest.approx(math.sin(math.pi / (2 * samples)), rel=1e-12)
    assert complex_v(split, 1.0, 0.0) == pytest.approx((2 * math.pi / samples) ** 2 / 16, rel=0.01)
    if samples == 21:
        assert complex_v(rounded, 1.0, 0.0) == pytest.approx(0.075, abs=5e-4)
        assert complex_v(split, 1.0, 0.0) == pytest.approx(0.0056, abs=5e-5)


@pytest.mark.thorough
def test_every_kind_is_designed_alike_when_compiled():
    """The whole record after `start`, bit for bit; and the same status where there is no such shaper."""
    compiled = Kernels(InputShaper)
    for kind in Shaper:
        for zeta in (0.0, 0.07):
            plain = InputShaper(shaper=kind, modes=2, natural_frequency=[3.0, 7.1], damping_ratio=[zeta, 0.02])
            record = record_of(plain)
            assert (plain.start() or 0) == compiled.start(record) == 0
            assert record_of(plain).tobytes() == record.tobytes(), kind.name
    impossible = InputShaper(shaper="three_hump_ei", damping_ratio=[0.6])
    assert impossible.start() == compiled.start(record_of(impossible)) == NO_SOLUTION
