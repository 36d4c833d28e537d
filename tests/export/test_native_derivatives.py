"""Directional derivatives of native FMUs: against the plants' equations, differences taken by hand, and what the standard forbids.

The matrices of the linear plants come from their equations of motion, written here anew with numbers of the tests' own.
"""

from __future__ import annotations

import math
from ctypes import c_double, c_uint32
from typing import Any

import numpy as np
import pytest
from native_calls import ERROR, OK, Host, array, description

from shaper_fmu.registry import components

both_versions = pytest.mark.parametrize("fmi", [2, 3])
kinds = pytest.mark.parametrize("exchange", [False, True])
ROUNDING = 2e-14
SMOOTH = 2e-11


def named(host: Host, label: str) -> tuple[Any, int]:
    """The variable of a scalar's name and, in FMI 3, the element's place in it."""
    name, _, index = label.rstrip("]").partition("[")
    wanted = name if host.fmi == 3 else label
    return next(v for v in host.variables if v.name == wanted), int(index or 1) - 1 if host.fmi == 3 else 0


def setting(host: Host, values: dict[str, float]) -> None:
    for label, value in values.items():
        variable, element = named(host, label)
        every = host.starts(variable)
        every[element] = value
        assert (
            host.access("Set", variable.type, array(c_uint32, [variable.valueReference]), 1, array(c_double, every), len(every))
            == OK
        )


def reading(host: Host, label: str) -> float:
    variable, element = named(host, label)
    values, n = array(c_double, [0.0] * host.size(variable)), host.size(variable)
    assert host.access("Get", variable.type, array(c_uint32, [variable.valueReference]), 1, values, n) == OK, host.log
    return values[element]


def asked(host: Host, unknowns: list[str], seeds: dict[str, float]) -> tuple[int, list[float]]:
    """Status and derivatives of the unknowns (whole arrays in FMI 3) along the seeds."""
    of = [named(host, label)[0] for label in unknowns]
    along = [(*named(host, label), seed) for label, seed in seeds.items()]
    n = sum(map(host.size, of))
    found = array(c_double, [math.nan] * n)
    references, knowns = array(c_uint32, [v.valueReference for v in of]), array(c_uint32, [v.valueReference for v, _, _ in along])
    weights: list[float] = []
    for variable, element, seed in along:
        weights += [seed if i == element else 0.0 for i in range(host.size(variable))]
    if host.fmi == 2:
        return host.call(
            "GetDirectionalDerivative", references, len(of), knowns, len(along), array(c_double, weights), found
        ), list(found)[:n]
    sizes = (references, len(of), knowns, len(along), array(c_double, weights), len(weights), found, n)
    return host.call("GetDirectionalDerivative", *sizes), list(found)[:n]


def derivative(host: Host, unknown: str, known: str) -> float:
    status, found = asked(host, [unknown], {known: 1.0})
    assert status == OK, host.log
    return found[named(host, unknown)[1]]


def running(name: str, fmi: int, exchange: bool, settings: dict[str, float], steps: int = 0) -> Host:
    """An instance between steps, or in continuous-time mode."""
    host = Host(name, fmi, exchange)
    assert host.setup() == OK
    setting(host, settings)
    assert host.call("ExitInitializationMode") == OK, host.log
    if exchange:
        assert host.new_discrete_states() == OK
        assert host.call("EnterContinuousTimeMode") == OK
    for i in range(0 if exchange else steps):
        assert host.step(i * 0.01, 0.01) == OK
    return host


def jacobian(host: Host, rates: list[str], knowns: list[str]) -> np.ndarray:
    return np.array([[derivative(host, rate, known) for known in knowns] for rate in rates])


M, K, C = 2.0, 50.0, 0.7


@both_versions
@kinds
def test_a_mass_has_the_matrices_of_its_equation(fmi, exchange):
    """m x'' + c x' + k x = F: A = [[0, 1], [-k/m, -c/m]], B = [0, 1/m]."""
    host = running("MassSpringDamper", fmi, exchange, {"mass": M, "stiffness": K, "damping": C, "force": 3.0}, steps=20)
    found = jacobian(host, ["velocity", "acceleration"], ["position", "velocity", "force"])
    host.free()
    assert found == pytest.approx(np.array([[0.0, 1.0, 0.0], [-K / M, -C / M, 1.0 / M]]), rel=ROUNDING, abs=ROUNDING)


@both_versions
@kinds
def test_three_masses_have_the_matrices_of_their_chain(fmi, exchange):
    """m1 x1'' = F + d1 + k1 (x2 - x1) + c1 (x2' - x1'), and so on."""
    mass, (k1, k2), (c1, c2) = [3.0, 5.0, 7.0], (90.0, 40.0), (1.5, 0.25)
    host = Host("ThreeMassChain", fmi, exchange)
    assert host.setup() == OK
    for name, values in (("mass", mass), ("stiffness", (k1, k2)), ("damping", (c1, c2))):
        if fmi == 3:
            reference = array(c_uint32, [named(host, name)[0].valueReference])
            assert host.access("Set", "Float64", reference, 1, array(c_double, list(values)), len(values)) == OK
        else:
            setting(host, {f"{name}[{i + 1}]": value for i, value in enumerate(values)})
    assert host.call("ExitInitializationMode") == OK
    every = [1, 2, 3]
    knowns = [f"{name}[{i}]" for name in ("position", "velocity") for i in every] + ["force"]
    found = jacobian(host, [f"acceleration[{i}]" for i in every], knowns)
    host.free()
    springs, dampers = (np.array([[-a, a, 0.0], [a, -a - b, b], [0.0, b, -b]]) for a, b in ((k1, k2), (c1, c2)))
    expected = np.hstack([springs, dampers, [[1.0], [0.0], [0.0]]]) / np.array(mass)[:, None]
    assert found == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING)


@both_versions
def test_a_crane_has_the_derivatives_of_its_equation(fmi):
    """l theta'' = -(2 l' theta' + 2 zeta w0 l theta' + g sin theta + a cos theta), l' = -hoist, differentiated by hand."""
    g, l0, zeta, a, hoist = 9.81, 4.0, 0.05, 0.8, 0.3
    length, angle, rate = 3.2, 0.4, -0.6
    parameters = {"initial_rope_length": l0, "damping_ratio": zeta, "gravity": g, "trolley_acceleration": a, "hoist_speed": hoist}
    host = running("OverheadCrane", fmi, True, parameters)
    assert host.call("SetContinuousStates", array(c_double, [1.0, 2.0, length, angle, rate]), 5) == OK
    found = jacobian(
        host, ["swing_acceleration"], ["swing_angle", "swing_rate", "rope_length", "trolley_acceleration", "hoist_speed"]
    )
    load = jacobian(host, ["load_position"], ["trolley_position", "swing_angle", "rope_length"])
    status, along = asked(host, ["swing_acceleration", "trolley_speed_rate"], {"swing_angle": 2.0, "trolley_acceleration": -3.0})
    host.free()
    sine, cosine, w0 = math.sin(angle), math.cos(angle), math.sqrt(g / l0)
    expected = [
        -(g * cosine - a * sine) / length, 2.0 * hoist / length - 2.0 * zeta * w0,
        (-2.0 * hoist * rate + g * sine + a * cosine) / length**2, -cosine / length, 2.0 * rate / length,
    ]  # fmt: skip
    assert found == pytest.approx(np.array([expected]), rel=SMOOTH)
    assert load == pytest.approx(np.array([[1.0, length * cosine, sine]]), rel=SMOOTH)
    assert status == OK
    assert along == pytest.approx([2.0 * expected[0] - 3.0 * expected[3], -3.0], rel=SMOOTH)


@both_versions
def test_parameters_have_derivatives_during_initialization_alone(fmi):
    """w0 = sqrt(k/m), zeta = c / (2 sqrt(k m)); a damping of 0 can grow only, and its differences are taken on that side."""
    host = Host("MassSpringDamper", fmi)
    assert host.setup() == OK
    setting(host, {"mass": M, "stiffness": K, "damping": 0.0, "force": 1.0})
    found = jacobian(host, ["natural_frequency", "damping_ratio", "acceleration"], ["stiffness", "damping", "mass"])
    assert reading(host, "acceleration") == 1.0 / M
    assert host.call("ExitInitializationMode") == OK
    status, _ = asked(host, ["acceleration"], {"mass": 1.0})
    assert (status, "mass cannot be asked for now" in host.log[0][1]) == (ERROR, True)
    host.free()
    root = math.sqrt(K * M)
    expected = [[0.5 / root, 0.0, -0.5 * math.sqrt(K / M) / M], [0.0, 0.5 / root, 0.0], [0.0, 0.0, -1.0 / M**2]]
    assert found == pytest.approx(np.array(expected), rel=SMOOTH, abs=1e-15)


@both_versions
def test_a_shaper_passes_its_first_impulse_on_when_it_samples_and_nothing_between(fmi):
    """ZV's first amplitude is 1 / (1 + K), K = exp(-zeta pi / sqrt(1 - zeta^2)); in continuous time inputs wait for an event."""
    zeta = 0.1
    expected = 1.0 / (1.0 + math.exp(-zeta * math.pi / math.sqrt(1.0 - zeta**2)))
    host = running("InputShaper", fmi, False, {"damping_ratio[1]": zeta}, steps=3)
    found = derivative(host, "shaped", "command")
    host.free()
    exchanged = running("InputShaper", fmi, True, {"damping_ratio[1]": zeta})
    between = derivative(exchanged, "shaped", "command")
    exchanged.free()
    assert (found, between) == (pytest.approx(expected, rel=ROUNDING), 0.0)


def test_the_derivative_of_a_move_with_respect_to_the_time_is_its_velocity():
    """FMI 3 has a variable for the time, which stands among the dependencies. The cycloid: y = L (s/T - sin(2 pi s/T)/(2 pi))."""
    host = running("MotionProfile", 3, True, {})
    time = next(v for v in description("MotionProfile", 3).modelVariables if v.causality == "independent")
    length, start, duration = (reading(host, name) for name in ("distance", "start_time", "duration"))
    s = 0.3 * duration
    assert host.call("SetTime", start + s) == OK
    found, velocity = array(c_double, [0.0]), reading(host, "velocity")
    references = [array(c_uint32, [v.valueReference]) for v in (named(host, "position")[0], time)]
    status = host.call("GetDirectionalDerivative", references[0], 1, references[1], 1, array(c_double, [1.0]), 1, found, 1)
    host.free()
    assert status == OK
    assert velocity == pytest.approx(length / duration * (1.0 - math.cos(2.0 * math.pi * s / duration)), rel=1e-12)
    assert found[0] == pytest.approx(velocity, rel=1e-8)


JUMPING = {("LimitedShaper", "acceleration"), ("ShapedStop", "acceleration"), ("ShapedStop", "rest_time")}
"""Outputs that jump with an input, so that they have no derivative there, besides the times of events."""


@both_versions
@pytest.mark.parametrize("name", components())
def test_derivatives_are_differences_of_outputs_that_an_importer_can_take(name, fmi):
    """Inputs of co-simulation: outputs after the input was set 1e-6 higher and lower, at a communication point."""
    host = running(name, fmi, False, {}, steps=7)
    inputs = [v for v in host.variables if v.causality == "input" and v.type in ("Real", "Float64")]
    reals = [v for v in host.variables if v.causality == "output" and v.type in ("Real", "Float64") and host.size(v) == 1]
    outputs = [v.name for v in reals if v.name != "next_event_time" and (name, v.name) not in JUMPING]
    before = host.all_values()
    for known in (v.name for v in inputs if host.size(v) == 1):
        status, found = asked(host, outputs, {known: 1.0})
        assert (status, host.log) == (OK, [])
        sides = []
        for side in (1e-6, -1e-6):
            other = running(name, fmi, False, {}, steps=7)
            setting(other, {known: reading(other, known) + side})
            sides.append([reading(other, output) for output in outputs])
            other.free()
        expected = [(high - low) / 2e-6 for high, low in zip(*sides, strict=True)]
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-6), known
    assert host.all_values() == before
    host.free()


@both_versions
def test_what_cannot_be_asked_is_refused_in_words(fmi):
    host = running("MassSpringDamper", fmi, False, {})
    for unknown, seeds, words in (
        ("force", {"force": 1.0}, "force is given, not computed"),
        ("position", {"stiffness": 1.0}, "stiffness cannot be asked for now"),
        ("position", {"natural_frequency": 1.0}, "natural_frequency cannot be asked for now"),
        ("position", {"force": math.nan}, "a seed is nan"),
    ):
        status, _ = asked(host, [unknown], seeds)
        assert status == ERROR
        assert words in host.log[0][1]
    nothing = array(c_uint32, [999])
    sizes = () if fmi == 2 else (1,)
    arguments = (nothing, 1, nothing, 1, array(c_double, [1.0]), *sizes, array(c_double, [1.0]), *sizes)
    assert host.call("GetDirectionalDerivative", *arguments) == ERROR
    assert "999" in host.log[0][1]
    host.free()


def test_fmi3_counts_seeds_and_sensitivities():
    host = running("ThreeMassChain", 3, False, {})
    references = [array(c_uint32, [named(host, name)[0].valueReference]) for name in ("velocity", "force")]
    for seeds, found, words in (
        (2, 3, "1 elements of type Float64, but there are 2"),
        (1, 2, "3 elements of type Float64, but there are 2"),
    ):
        room = array(c_double, [0.0] * 3)
        assert host.call("GetDirectionalDerivative", references[0], 1, references[1], 1, room, seeds, room, found) == ERROR
        assert words in host.log[0][1]
    host.free()


@both_versions
def test_more_unknowns_than_are_taken_at_once(fmi):
    """The layer takes 16 at a time; the same unknown over and over has the same derivative each time."""
    host = running("MassSpringDamper", fmi, False, {"mass": M})
    status, found = asked(host, ["acceleration", "velocity"] * 20, {"force": 4.0})
    host.free()
    assert status == OK
    assert found == pytest.approx([4.0 / M, 0.0] * 20, rel=ROUNDING)
