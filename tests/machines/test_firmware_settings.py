"""Settings of firmware: the impulses that its published definition makes of them, read from the written text, against ours."""

import math
import re

import numpy as np
import pytest

from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.errors import ArgumentError
from shaper_fmu.machines import machine_settings
from shaper_fmu.machines.fit import best_of, fit
from shaper_fmu.machines.settings import FIRMWARE
from shaper_fmu.tune import ModeBox, Move, Requirements, choose

TWO = 2.0 * math.pi
NARROW = Requirements(tolerance=0.05)


def mode(hertz, zeta, margin, amplitudes=(1.0,)):
    return ModeBox.around(TWO * hertz, zeta, margin, amplitudes)


def read(pattern, text):
    match = re.search(pattern, text, re.M)
    assert match is not None, text
    return match.groups()


def set_to(machine, shaper, frequency, zeta):
    setting = FIRMWARE[machine].setting(shaper, frequency, zeta)
    assert setting is not None
    return setting


# Definitions, once more: each from the firmware's source, in its own terms (period, K), not by way of the package.


def klipper(kind, f, zeta):
    df = (1 - zeta**2) ** 0.5
    k, td = math.exp(-zeta * math.pi / df), 1 / (f * df)
    if kind == "zv":
        return [1, k], [0, td / 2]
    if kind == "zvd":
        return [1, 2 * k, k**2], [0, td / 2, td]
    if kind == "mzv":
        k = math.exp(-0.75 * zeta * math.pi / df)
        a = 1 - 1 / 2**0.5
        return [a, (2**0.5 - 1) * k, a * k * k], [0, 0.375 * td, 0.75 * td]
    if kind == "ei":  # the fit with the tolerance 1/20 put in
        a1 = 0.2621605 + zeta * (0.861744 + zeta * 0.654648)
        a3 = 0.262227 + zeta * (-0.761741 + zeta * 0.606763)
        t2 = 0.4999 + zeta * (0.044525575 + zeta * (-0.0585255 + zeta * 0.930273))
        return [a1, 1 - a1 - a3, a3], [0, t2 * td, td]
    times = {
        "2hump_ei": ["0", "0.49890 0.16270 -0.54262 6.16180", "0.99748 0.18382 -1.58270 8.17120", "1.49920 -0.09297 -0.28338 1.85710"],
        "3hump_ei": ["0", "0.49974 0.23834 0.44559 12.4720", "0.99849 0.29808 -2.36460 23.3990", "1.49870 0.10306 -2.01390 17.0320",
                     "1.99960 -0.28231 0.61536 5.40450"],
    }  # fmt: skip
    sizes = {
        "2hump_ei": ["0.16054 0.76699 2.26560 -1.22750", "0.33911 0.45081 -2.58080 1.73650", "0.34089 -0.61533 -0.68765 0.42261",
                     "0.15997 -0.60246 1.00280 -0.93145"],
        "3hump_ei": ["0.11275 0.76632 3.29160 -1.44380", "0.23698 0.61164 -2.57850 4.85220", "0.30008 -0.19062 -2.14560 0.13744",
                     "0.23775 -0.73297 0.46885 -2.08650", "0.11244 -0.45439 0.96382 -1.46000"],
    }  # fmt: skip
    polynomial = lambda text: np.polyval([float(x) for x in text.split()][::-1], zeta)  # noqa: E731
    return [polynomial(x) for x in sizes[kind]], [polynomial(x) / f for x in times[kind]]


def before_2024(kind, f, zeta):
    if kind in ("zv", "zvd", "mzv"):
        return klipper(kind, f, zeta)
    df = (1 - zeta**2) ** 0.5
    k, half, v = math.exp(-zeta * math.pi / df), 0.5 / (f * df), 1 / 20
    if kind == "ei":
        return [0.25 * (1 + v), 0.5 * (1 - v) * k, 0.25 * (1 + v) * k**2], [0, half, 2 * half]
    if kind == "2hump_ei":
        x = (v**2 * ((1 - v**2) ** 0.5 + 1)) ** (1 / 3)
        a1 = (3 * x * x + 2 * x + 3 * v**2) / (16 * x)
        return [a1, (0.5 - a1) * k, (0.5 - a1) * k**2, a1 * k**3], [i * half for i in range(4)]
    a1 = 0.0625 * (1 + 3 * v + 2 * (2 * (v + 1) * v) ** 0.5)
    a2, a3 = 0.25 * (1 - v), 0.5 * (1 + v) - 2 * a1
    return [a1, a2 * k, a3 * k**2, a2 * k**3, a1 * k**4], [i * half for i in range(5)]


def of_klipper(text, define):
    kind, f, zeta = (read(rf"^{key}_x: (\S+)$", text)[0] for key in ("shaper_type", "shaper_freq", "damping_ratio"))
    return define(kind, float(f), float(zeta))


def of_prusa(text):
    t, f, d, tail = read(r"^M593 X T(\d) F(\S+) D(\S+)(.*) W$", text)
    kind = ["zv", "zvd", "mzv", "ei", "2hump_ei", "3hump_ei"][int(t)]
    assert (tail == " R20") == ("ei" in kind)
    assert 10 <= float(f) <= 100  # what is outside is clamped in silence
    return before_2024(kind, float(f), float(d))


def of_duet(text):
    kind, f, zeta = read(r'^M593 P"(\w+)" F(\S+) S(\S+)$', text)
    f, zeta = float(f), float(zeta)
    assert 7.2 <= f <= 1000
    assert 0 <= zeta <= 0.99
    if kind == "mzv":
        return klipper(kind, f, zeta)
    if kind in ("ei2", "ei3"):
        sizes, times = klipper(f"{kind[-1]}hump_ei", f, zeta)
        return sizes, [t / (1 - zeta**2) ** 0.5 for t in times]  # the same fits in damped periods
    k, n = math.exp(-zeta * math.pi / (1 - zeta**2) ** 0.5), {"zvd": 2, "zvdd": 3, "zvddd": 4}[kind]
    half = 0.5 / (f * (1 - zeta**2) ** 0.5)
    return np.poly([-k] * n) / (1 + k) ** n, [i * half for i in range(n + 1)]


def of_marlin(text):
    f, zeta = map(float, read(r"^M593 X F(\S+) D(\S+)$", text))
    factor = math.floor(np.polyval([43.073216, -7.58095488, -99.02008832, 64.44056192], zeta)) if zeta > 0 else 64
    return [(128 - factor) / 128, factor / 128], [0, 0.5 / f]


def of_fixed_time(text):
    number = int(read(r"^M493 S1 X C(\d)$", text)[0])
    f, zeta, tail = read(r"^M493 X A(\S+) I(\S+)(.*)$", text)
    f, zeta = float(f), float(zeta)
    assert 20 <= f <= 500
    assert 0.01 <= zeta <= 0.25
    assert (tail == " Q0.05") == (number in (5, 6, 7))
    df = (1 - zeta**2) ** 0.5
    k = math.exp(-zeta * math.pi / df)
    if number <= 4:
        sizes = np.poly([-k] * number)
    elif number == 8:
        sizes = np.array([1, 2**0.5 * k, k**2])
    else:
        sizes = np.array(before_2024(["ei", "2hump_ei", "3hump_ei"][number - 5], f, zeta)[0])
    samples = math.floor((0.375 if number == 8 else 0.5) / f / df * 1000 + 0.5)
    return sizes, [i * samples / 1000 for i in range(len(sizes))]


READ = {
    "klipper": lambda text: of_klipper(text, klipper),
    "kalico": lambda text: of_klipper(text, before_2024),
    "prusa": of_prusa,
    "reprapfirmware": of_duet,
    "marlin": of_marlin,
    "marlin-ft": of_fixed_time,
}


def impulses_of(machine, text):
    sizes, times = READ[machine](text)
    return ImpulseSequence(tuple(np.array(sizes) / sum(sizes)), tuple(times))


@pytest.mark.parametrize("machine", FIRMWARE)
def test_impulses_of_every_shaper_are_those_of_the_published_definition(machine):
    firmware, rng = FIRMWARE[machine], np.random.default_rng(7)
    for shaper in firmware.shapers:
        for _ in range(20):
            setting = set_to(machine, shaper, float(rng.uniform(21.0, 99.0)), float(rng.choice([0.0, rng.uniform(0.0, 0.19)])))
            expected = impulses_of(machine, firmware.lines("x", setting))
            np.testing.assert_allclose(setting.sequence.amplitudes, expected.amplitudes, rtol=0, atol=1e-13)
            # F of Marlin's M593 is damped, and written with six digits
            relative = 2e-6 if machine == "marlin" else 1e-13
            np.testing.assert_allclose(setting.sequence.delays, expected.delays, rtol=relative, atol=0)


@pytest.mark.parametrize("machine", FIRMWARE)
def test_what_is_told_is_what_the_written_impulses_leave(machine):
    rng = np.random.default_rng(3)
    for _ in range(4):
        boxes = [mode(float(rng.uniform(25, 60)), float(rng.uniform(0.0, 0.1)), float(rng.uniform(0.0, 0.12)))]
        if rng.random() < 0.5:
            boxes.append(mode(float(rng.uniform(60, 95)), 0.05, 0.03, (float(rng.uniform(0.05, 0.5)),)))
        choice = choose(boxes, Requirements(nominal_tolerance=0.02), floor=False)
        found = machine_settings(machine, choice)
        (text,) = found.files.values()
        sequence = impulses_of(machine, text)
        shares = np.array([box.amplitudes[0] for box in boxes]) / sum(box.amplitudes[0] for box in boxes)
        worst = [
            max(left(sequence, np.linspace(*box.frequencies, 41), z).max() for z in np.linspace(*box.dampings, 5))
            for box in choice.boxes
        ]
        assert found.candidate.worst_case >= shares @ worst - 1e-4
        assert found.candidate.worst_case <= shares @ worst + 2e-3  # the bound is of the worst point, the grid is near it
        assert found.holds == (found.candidate.worst_case <= 0.05 and found.candidate.nominal <= 0.02)
        assert ("NOT HELD" in text) == (not found.holds)
        assert f"{100 * found.candidate.worst_case:.3g} %" in found.words


def left(sequence, w, zeta):
    """V at natural frequencies [rad/s]."""
    poles = np.asarray(w) * (-zeta + 1j * math.sqrt(1 - zeta**2))
    return np.abs(np.exp(np.outer(poles, sequence.duration - np.array(sequence.delays))) @ np.array(sequence.amplitudes))


@pytest.mark.parametrize("machine", FIRMWARE)
def test_of_each_shaper_the_best_setting_is_found_and_of_these_the_shortest_that_fits_is_taken(machine):
    rng, firmware = np.random.default_rng(11), FIRMWARE[machine]
    for _ in range(4):
        box = mode(float(rng.uniform(25, 60)), float(rng.uniform(0.0, 0.15)), float(rng.uniform(0.02, 0.2)))
        zeta, w = box.damping_ratio.nominal, np.linspace(*box.frequencies, 41)
        found = fit(firmware, [box], NARROW)
        for one in found:
            settings = [
                firmware.setting(one.setting.shaper, float(f), zeta)
                for f in np.geomspace(0.4, 2.5, 500) * box.natural_frequency.nominal / TWO
            ]
            least = min(left(setting.sequence, w, zeta).max() for setting in settings if setting is not None)
            assert one.candidate.worst_case <= least + 2e-3  # the search looks at nine frequencies of the range
        best, holds = best_of(found, NARROW)
        fitting = [one for one in found if one.candidate.worst_case <= 0.05]
        assert holds == bool(fitting)
        assert best.candidate.delay == min(one.candidate.delay for one in fitting) if fitting else best in found


def test_what_klippers_fits_lose_at_the_design_frequency():
    """EI leaves the tolerance by definition; ours to 1e-11, the fit of 2024 within 0.3 %, the weakened form of 2021 up to 1 % less."""
    for zeta in (0.0, 0.05, 0.1, 0.2):
        new = set_to("klipper", "ei", 40.0, zeta).sequence.residual_vibration(TWO * 40.0, zeta)
        old = set_to("kalico", "ei", 40.0, zeta).sequence.residual_vibration(TWO * 40.0, zeta)
        assert abs(new - 0.05) < 0.003, (zeta, new)
        assert old <= 0.05 + 1e-12
        assert (old < 0.04) == (zeta >= 0.1), (zeta, old)


@pytest.mark.parametrize(
    ("machine", "hertz", "words"),
    [
        ("marlin-ft", 3.0, r"Marlin \(Fixed-Time Motion\) takes shapers of 20 to 500 Hz; the modes are at 3 Hz"),
        ("prusa", 0.2, r"takes shapers of 10 to 100 Hz; the modes are at 0.2 Hz"),
        ("reprapfirmware", 0.5, r"takes shapers of 7.2 to 1000 Hz"),
    ],
)
def test_a_mode_outside_of_the_firmwares_range_is_refused(machine, hertz, words):
    with pytest.raises(ArgumentError, match=words):
        machine_settings(machine, choose([mode(hertz, 0.02, 0.05)], floor=False))


def test_a_clamped_frequency_is_never_written():
    """The best one would be at 9.7 Hz: the setting is at 10 Hz or above, and told for what it leaves."""
    found = machine_settings("prusa", choose([mode(9.7, 0.02, 0.05)], floor=False))
    assert impulses_of("prusa", found.files["prusa.gcode"]).delays == found.candidate.sequence.delays


def test_wrong_names_and_axes_and_moves():
    choice = choose([mode(40.0, 0.02, 0.05)], floor=False)
    with pytest.raises(ArgumentError, match=r"machine 'kliper' is not known. Did you mean 'klipper'"):
        machine_settings("kliper", choice)
    with pytest.raises(ArgumentError, match="Kalico shapes the axes x, y, not 'z'"):
        machine_settings("kalico", choice, axis="z")
    assert "shaper_type_y" in machine_settings("klipper", choice, axis="Y").files["klipper.cfg"]
    of_move = choose([mode(40.0, 0.02, 0.05)], Requirements(move=Move(0.1, max_velocity=1.0, max_acceleration=10.0)), floor=False)
    with pytest.raises(ArgumentError, match="the choice is for a move"):
        machine_settings("klipper", of_move)


def test_a_caveat_begins_the_file():
    choice = choose([mode(40.0, 0.02, 0.05)], floor=False)
    for machine in ("klipper", "marlin", "st", "c", "csv"):
        text = next(iter(machine_settings(machine, choice, caveat="NOT HELD: on the plant").files.values()))
        assert re.match(r"\W*NOT HELD: on the plant\.", text)


@pytest.mark.parametrize("machine", FIRMWARE)
def test_numbers_have_no_exponent_which_g_code_takes_for_a_word(machine):
    """A damping ratio of 1.2e-5 is read as 1.2 by Marlin, which is none."""
    choice = choose([mode(40.0, 1.23e-5, 0.02)], NARROW, floor=False)
    (text,) = machine_settings(machine, choice).files.values()
    settings = "\n".join(line for line in text.splitlines() if not line.startswith((";", "#")))
    assert re.search(r"\d[eE]-?\d", settings) is None
    assert ("0.0000123" in settings) == (machine != "marlin-ft")
