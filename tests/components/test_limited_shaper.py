"""LimitedShaper: limits that are never exceeded, and zeros that stay, for commands that nobody knows beforehand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from compiled_kernels import Kernels, record_of
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from native_host import native_fmu
from scipy.optimize import linprog

from shaper_fmu.commands.limited_shaper import SEGMENTS, LimitedShaper
from shaper_fmu.component import NO_EVENT
from shaper_fmu.design.fastest import fastest_move
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError
from shaper_fmu.limited_motion import quickest
from shaper_fmu.master.system import System

W, ZETA = 5.0, 0.03
LIMITS: dict[str, Any] = {"max_velocity": 1.0, "max_acceleration": 3.0}
COMMANDS = [(0.0, 0.0), (0.123, 1.0), (0.6, -0.4), (0.9, 0.35), (1.4, 0.5)]


def run(commands: list[tuple[float, float]], times: np.ndarray, **parameters: Any) -> np.ndarray:
    """Position, speed and acceleration at these times, with steps that end at the commands' jumps; shape (3, times)."""
    component = LimitedShaper(**parameters)
    component.initialize(times[0])
    rows, now, pending = [], float(times[0]), list(commands)
    for t in times.tolist():
        while pending and pending[0][0] <= t:
            at, value = pending.pop(0)
            component.do_step(now, at - now)
            component.command, now = value, at
        component.do_step(now, t - now)
        now = t
        rows.append((component.position, component.velocity, component.acceleration))
    return np.array(rows).T


commands = st.lists(st.tuples(st.floats(0.0, 0.8), st.floats(-2.0, 2.0)), min_size=1, max_size=8)
kinds = st.sampled_from(["none", "zv", "zvd", "ei", "um_zv", "sna_zv", "two_hump_ei"])


@pytest.mark.parametrize(("part", "count"), [(0, 50), *(pytest.param(k, 250, marks=pytest.mark.thorough) for k in range(1, 5))])
def test_limits_are_never_exceeded_and_the_command_is_reached(part, count):
    """1,000 random sequences of commands, in parts."""
    jerks, meanings = st.sampled_from([NO_EVENT, 40.0]), st.sampled_from(["position", "speed"])
    random = given(commands, kinds, jerks, meanings, st.floats(2.0, 20.0))
    seed(part)(settings(max_examples=count, deadline=None)(random(limits_are_kept_and_the_command_is_reached)))()


def limits_are_kept_and_the_command_is_reached(gaps, kind, jerk, meaning, w):
    """The jerk is the acceleration's slope between instants 10 ms apart."""
    component = LimitedShaper(**LIMITS, max_jerk=jerk, command_is=meaning, shaper=kind, natural_frequency=[w], damping_ratio=[0.1])
    component.initialize()
    now, before = 0.0, 0.0
    for gap, value in [*gaps, (12.0 if meaning == "position" else 6.0, None)]:
        for h in [0.01] * int(gap / 0.01) + [gap % 0.01]:
            component.do_step(now, h)
            now += h
            assert abs(component.velocity) <= 1.0 + 1e-12
            assert abs(component.acceleration) <= 3.0 + 1e-11
            if jerk < NO_EVENT:
                assert abs(component.acceleration - before) <= jerk * h + 1e-11
            before = component.acceleration
        if value is not None:
            component.command = value
    assert component.settled
    assert component.acceleration == 0.0
    assert component.next_event_time == component.next_kink_time == NO_EVENT
    if meaning == "position":
        assert component.position == component.command
        assert component.velocity == 0.0
    else:
        most = 1.0 / max(1.0, sum(map(abs, shaper(kind, w, 0.1).amplitudes)))
        assert component.velocity == pytest.approx(max(-most, min(most, component.command)), abs=1e-15)


def shortest_by_programme(way: float, speed: float, v: float, a: float, cells: int = 200) -> tuple[float, float]:
    """A bracket of the least time to rest, by linear programmes over accelerations that are constant in `cells` parts of it."""

    def possible(time: float) -> bool:
        h = time / cells
        sums = np.tril(np.ones((cells, cells))) * h
        ends = np.vstack([np.full(cells, h), h * (time - h * (np.arange(cells) + 0.5))])
        result = linprog(
            np.zeros(cells), A_ub=np.vstack([sums, -sums]), b_ub=np.concatenate([np.full(cells, v - speed), np.full(cells, v + speed)]),
            A_eq=ends, b_eq=[-speed, way - speed * time], bounds=(-a, a), method="highs",
        )  # fmt: skip
        return result.status == 0

    low, high = 0.0, 20.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if possible(middle) else (middle, high)
    return low, high


@pytest.mark.parametrize(
    ("way", "speed", "v", "a"), [(1.0, 0.0, 1.0, 3.0), (-0.7, 0.8, 1.0, 2.0), (0.05, 0.9, 1.0, 1.5), (0.3, -0.5, 0.6, 4.0), (0.01, 0.1, 1.0, 1.0)]
)  # fmt: skip
def test_the_motion_is_the_quickest(way, speed, v, a):
    """Against scipy's linear programmes, whose cells cost them up to a cell. (ruckig's times are the same to 2e-15 for 2,000 states.)"""
    _, _, rising, cruise, falling = quickest(way, speed, v, a)
    time = rising + cruise + falling
    low, high = shortest_by_programme(way, speed, v, a)
    assert time <= high + 1e-9
    assert time >= low * (1.0 - 1.0 / 200) - 1e-3


@pytest.mark.parametrize("meaning", ["position", "speed"])
@pytest.mark.parametrize("jerk", [NO_EVENT, 50.0])
def test_the_output_is_the_convolution_of_the_quickest_motion(meaning, jerk):
    """The motion without shaper and jerk limit, shifted, weighted and averaged by numpy."""
    half, smoothing = math.pi / (W * math.sqrt(1.0 - ZETA**2)), 2.0 * 3.0 / jerk
    at = np.linspace(0.0, 4.0, 81)
    kernel = shaper("zv", W, ZETA)
    averaged = np.linspace(0.0, smoothing, 2001) if jerk < NO_EVENT else np.zeros(1)
    found = run(COMMANDS, at, **LIMITS, max_jerk=jerk, command_is=meaning, natural_frequency=[W], damping_ratio=[ZETA])
    wanted = np.zeros_like(found[:2])
    for amplitude, delay in zip(kernel.amplitudes, kernel.delays, strict=True):
        fine = np.linspace(0.0, 4.0, 8001)
        quick = run(COMMANDS, fine, **LIMITS, command_is=meaning, shaper="none")[:2]
        for k, t in enumerate(at.tolist()):
            values = np.array([np.interp(t - delay - averaged, fine, one, left=0.0) for one in quick])
            wanted[:, k] += amplitude * (np.trapezoid(values, averaged) / smoothing if jerk < NO_EVENT else values[:, 0])
    assert found[:2] == pytest.approx(wanted, abs=2e-6)
    assert half == pytest.approx(kernel.duration)


def driven(acceleration: str, system: System) -> None:
    """An oscillator driven by the acceleration [m/s2], of a plant of 1 kg."""
    system.add("plant", native_fmu("MassSpringDamper", 2), stiffness=W * W, damping=2.0 * ZETA * W)
    system.connect_raw(acceleration, "plant.force", 1.0)


def envelope(results: Any) -> np.ndarray:
    """What the oscillator swings, over the envelope after a step of the position by 1 m."""
    x, v = results["plant.position"], results["plant.velocity"]
    wd = W * math.sqrt(1.0 - ZETA**2)
    return np.hypot(x, (v + ZETA * W * x) / wd) * wd / W


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_through_fmus_nothing_vibrates_after_the_last_command(fmi, step):
    system = System()
    mode = {"natural_frequency[1]": W, "damping_ratio[1]": ZETA}
    system.add("shaper", native_fmu("LimitedShaper", fmi), **LIMITS, **mode)
    system.drive("shaper.command", COMMANDS)
    driven("shaper.acceleration", system)
    results = system.simulate(5.0, step)
    swing, t = envelope(results), results.time
    assert swing[t < 1.5].max() > 0.1  # it does swing
    assert swing[t > 4.0].max() < 1e-11
    assert results["shaper.position"][-1] == 0.5
    assert np.abs(results["shaper.acceleration"]).max() <= 3.0 + 1e-12


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_through_fmus_the_smoothed_motion_is_that_of_plain_python(fmi, step):
    parameters = {**LIMITS, "max_jerk": 50.0, "command_is": "speed", "natural_frequency": [W], "damping_ratio": [ZETA]}
    system = System()
    system.add("shaper", native_fmu("LimitedShaper", fmi), **parameters)
    system.drive("shaper.command", COMMANDS)
    results = system.simulate(3.0, step)
    found = np.array([results[f"shaper.{name}"] for name in ("position", "velocity", "acceleration")])
    assert found == pytest.approx(run(COMMANDS, results.time, **parameters), abs=1e-11)


def left_by_a_saturated_command() -> float:
    """A command shaped first, whose drive then follows as fast as its limits allow."""
    system = System()
    system.add("shaper", native_fmu("InputShaper", 2), **{"natural_frequency[1]": W, "damping_ratio[1]": ZETA})
    system.add("drive", native_fmu("LimitedShaper", 2), **LIMITS, shaper="none")
    system.drive("shaper.command", [(0.0, 0.0), (0.1, 1.0)])
    system.connect("shaper.shaped", "drive.command")
    driven("drive.acceleration", system)
    results = system.simulate(4.0, 0.001)
    return float(envelope(results)[results.time > 2.5].max())


def test_a_shaped_command_that_is_limited_afterwards_vibrates_and_this_one_does_not():
    """One metre at 1 m/s and 3 m/s2, a mode of 5 rad/s; docs/drive_limits.md has the numbers."""
    left = left_by_a_saturated_command()
    print(f"saturated: {100 * left:.2f} % of a step's swing")
    assert left > 0.05


def test_above_the_floor_as_documented():
    """The motion is the trapezoid through ZV: 1.333 + 0.628 s, where no move without vibration is shorter than 1.458 s."""
    floor = fastest_move(1.0, **LIMITS, modes=[W]).lower_bound
    component = LimitedShaper(**LIMITS, natural_frequency=[W])
    component.command = 1.0
    component.initialize()
    now = 0.0
    while component.next_event_time < NO_EVENT:
        now, h = component.next_event_time, component.next_event_time - now
        component.do_step(now - h, h)
    assert now == pytest.approx(4.0 / 3.0 + math.pi / W, abs=1e-12)
    assert now / floor - 1.0 == pytest.approx(0.345, abs=5e-4)


def test_compiled_it_gives_the_same_bits():
    rng = np.random.default_rng(5)
    for meaning, jerk in (("position", NO_EVENT), ("speed", 30.0), ("position", 30.0)):
        compiled = Kernels(LimitedShaper)
        component = LimitedShaper(**LIMITS, command_is=meaning, max_jerk=jerk, shaper="um_zvd", natural_frequency=[W])
        record = record_of(component)
        assert compiled.start(record) == component.start() == 0
        for k in range(300):
            if rng.random() < 0.1:
                component.command = record["command"] = float(rng.uniform(-1.0, 1.0))
            assert component.step(0.02 * k, 0.02) == compiled.step(record, 0.02 * k, 0.02)
            assert record_of(component).tobytes() == record.tobytes()


def test_a_command_for_every_step_of_a_long_run():
    """The ring's numbers are reduced; a sine in steps of 1 ms is followed within the limits."""
    component = LimitedShaper(**LIMITS, natural_frequency=[50.0])
    component.initialize()
    for k in range(3 * SEGMENTS):
        component.command = 0.2 * math.sin(0.001 * k)
        component.do_step(0.001 * k, 0.001)
        assert abs(component.acceleration) <= 3.0 + 1e-12
    assert component.position == pytest.approx(0.2 * math.sin(0.001 * 3 * SEGMENTS), abs=0.02)


def test_what_cannot_be_kept_in_mind_is_an_error():
    component = LimitedShaper(**LIMITS, natural_frequency=[0.1])
    component.initialize()

    def steps() -> None:
        for k in range(2 * SEGMENTS):
            component.command = 0.2 * math.sin(0.001 * k)
            component.do_step(0.001 * k, 0.001)

    with pytest.raises(ComponentError, match="use a larger communication step"):
        steps()


def test_designs_that_do_not_exist_are_refused():
    with pytest.raises(ComponentError, match="no um_zv shaper"):
        LimitedShaper(shaper="um_zv", damping_ratio=[0.99]).initialize()


def test_a_speed_that_negative_impulses_leave_no_room_for_is_a_third_as_documented():
    """UM-ZV's sizes are 1, 1 and 1; within a third of the limit their sum cannot exceed it."""
    shaper = LimitedShaper(command_is="speed", command=1.0, max_velocity=1.0, shaper="um_zv", natural_frequency=[W])
    shaper.initialize()
    shaper.do_step(0.0, 20.0)
    assert shaper.settled
    assert shaper.velocity == pytest.approx(1.0 / 3.0, rel=1e-12)
