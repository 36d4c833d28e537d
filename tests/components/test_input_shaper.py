"""The input shaper in operation: jumps where they belong, the exact final value, the mean for holding masters."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shaper_fmu.commands.input_shaper import EDGES, InputShaper
from shaper_fmu.component import NO_EVENT
from shaper_fmu.errors import ComponentError

command_rows = st.lists(st.tuples(st.integers(1, 40), st.floats(-10, 10, width=32)), min_size=1, max_size=8)


def ready(**values) -> InputShaper:
    shaper = InputShaper(**{"shaper": "zvd", "natural_frequency": [5.0], "damping_ratio": [0.1], **values})
    shaper.initialize()
    return shaper


def convolved(shaper: InputShaper, edges: list[tuple[float, float]], t: float) -> float:
    """sum_i A_i command(t - t_i), with command(t) from its edges (time, value) and 0 before them."""
    total = 0.0
    for a, delay in zip(shaper.amplitude[: shaper.impulses], shaper.delay[: shaper.impulses], strict=True):
        reached = [value for time, value in edges if time + delay <= t + 1e-12]
        total += a * (reached[-1] if reached else 0.0)
    return total


@settings(deadline=None, max_examples=60)
@given(command_rows, st.sampled_from([0.01, 0.037, 0.11, 0.5]))
def test_output_is_the_convolution_whatever_the_communication_step(rows, step):
    shaper, edges, i = ready(), [], 0
    for steps, value in rows:
        if not edges or edges[-1][1] != value:
            edges.append((i * step, value))
        shaper.command = value
        for _ in range(steps):
            shaper.do_step(i * step, step)
            i += 1
            assert shaper.shaped == pytest.approx(convolved(shaper, edges, i * step), abs=1e-12 * 10)


@settings(deadline=None, max_examples=60)
@given(command_rows, st.sampled_from([0.01, 0.037, 0.11, 0.5]))
def test_shaped_mean_is_the_mean_over_the_step(rows, step):
    """Integrate the staircase of the step piece by piece, between the edges that fall into it."""
    shaper, edges, i = ready(), [(-math.inf, 0.0)], 0
    for steps, value in rows:
        edges.append((i * step, value))
        shaper.command = value
        for _ in range(steps):
            shaper.do_step(i * step, step)
            begin, end = i * step, (i + 1) * step
            jumps = sorted(t + d for t, _ in edges[1:] for d in shaper.delay[: shaper.impulses] if begin < t + d < end)
            points = [begin, *jumps, end]
            mean = sum(convolved(shaper, edges, (a + b) / 2) * (b - a) for a, b in pairwise(points)) / step
            assert shaper.shaped_mean == pytest.approx(mean, abs=1e-10)
            i += 1


@settings(deadline=None, max_examples=60)
@given(command_rows, st.sampled_from([0.01, 0.037, 0.5]))
def test_looking_at_a_communication_point_changes_nothing(rows, step):
    """A step of length zero shows the outputs for the new command; the steps go on as if it had not been."""
    looked, plain, i = ready(), ready(), 0
    for steps, value in rows:
        looked.command = plain.command = value
        looked.do_step(i * step, 0.0)
        assert looked.edge_value[looked.newest % EDGES] == value
        for _ in range(steps):
            looked.do_step(i * step, step)
            plain.do_step(i * step, step)
            assert (looked.shaped, looked.next_event_time) == (plain.shaped, plain.next_event_time)
            i += 1


def test_a_command_set_twice_at_one_time_is_one_edge():
    once, twice = ready(), ready()
    twice.command = 9.0
    twice.do_step(0.0, 0.0)
    once.command = twice.command = 1.0
    for shaper in (once, twice):
        shaper.do_step(0.0, 0.3)
    assert twice.newest == 1
    assert twice.shaped == once.shaped


def test_events_are_announced_and_served_by_stepping_onto_them():
    shaper = ready()
    shaper.command = 2.0
    shaper.do_step(0.0, 0.0)
    t, jumps = 0.0, [(0.0, shaper.shaped)]
    while shaper.next_event_time < NO_EVENT:
        target, before = shaper.next_event_time, shaper.shaped
        shaper.do_step(t, 0.5 * (target - t))  # half way: nothing happens
        assert shaper.shaped == before
        half = t + 0.5 * (target - t)
        shaper.do_step(half, target - half)
        t = target
        jumps.append((t, shaper.shaped - before))
    assert [time for time, _ in jumps] == shaper.delay[: shaper.impulses]
    assert [size for _, size in jumps] == pytest.approx([2.0 * a for a in shaper.amplitude[: shaper.impulses]], rel=1e-14)
    assert shaper.shaped == 2.0  # exactly
    assert shaper.settled


@pytest.mark.parametrize("steps_per_delay", [3, 7, 10, 25])
@pytest.mark.parametrize("start", [0.0, 1000.0])
def test_an_edge_meant_for_a_communication_point_is_not_missed_by_rounding(steps_per_delay, start):
    """Delays of n steps of a tenth of a second, whatever the rounding of start + i * step."""
    step = 0.1
    half_period = steps_per_delay * step
    shaper = InputShaper(shaper="zvd", natural_frequency=[math.pi / half_period])
    shaper.initialize(start)
    shaper.command = 1.0
    values = []
    for i in range(2 * steps_per_delay + 1):
        shaper.do_step(start + i * step, step)
        values.append(shaper.shaped)
    expected = [0.25] * (steps_per_delay - 1) + [0.75] * steps_per_delay + [1.0] * 2
    assert values == pytest.approx(expected, abs=1e-15)


def test_the_final_value_is_exact_although_amplitudes_are_rounded():
    shaper = ready(shaper="custom", custom_impulses=3, custom_amplitude=[0.1, 0.2, 0.7], custom_delay=[0.0, 0.1, 0.2])
    shaper.command = 0.1
    shaper.do_step(0.0, 0.25)
    assert shaper.shaped == 0.1
    shaper.do_step(0.25, 0.25)
    assert shaper.shaped_mean == 0.1


def test_the_command_before_the_start_is_known():
    shaper = ready(initial_command=5.0, command=5.0)
    assert (shaper.shaped, shaper.settled) == (5.0, True)
    shaper.command = 6.0
    shaper.do_step(0.0, 0.1)
    assert shaper.shaped == pytest.approx(5.0 + shaper.amplitude[0], rel=1e-15)


def test_history_is_bounded_but_never_ends():
    """Many more edges than the buffer holds, over a short shaper; the oldest are forgotten in time."""
    shaper = ready(shaper="zv", natural_frequency=[100.0])
    for i in range(3 * EDGES):
        shaper.command = float(i % 7)
        shaper.do_step(0.001 * i, 0.001)
    shaper.do_step(0.001 * 3 * EDGES, 1.0)
    assert shaper.shaped == shaper.command
    assert shaper.newest < 2 * EDGES


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.tuples(st.floats(0.0, 3.0), st.floats(2.0, 12.0), st.floats(0.0, 0.3)), min_size=1, max_size=5),
    st.sampled_from([0.013, 0.05, 0.2]),
)
def test_a_change_of_frequency_does_not_jump_and_leaves_no_error(changes, step):
    """The command jumps at the start and at 1.5 s; frequency and damping change at random times in between."""
    shaper = ready()
    pending = sorted(changes)
    i, before = 0, 0.0
    while i * step < 12.0:
        t = i * step
        shaper.command = 1.0 if t < 1.5 else -0.7
        if pending and t >= pending[0][0]:
            _, w, zeta = pending.pop(0)
            shaper.natural_frequency[0], shaper.damping_ratio[0] = w, zeta
            held = shaper.shaped
            kept = shaper.command
            shaper.command = shaper.edge_value[shaper.newest % EDGES]  # the input rests at this instant
            shaper.do_step(t, 0.0)
            assert shaper.shaped == pytest.approx(held, abs=1e-14)
            shaper.command = kept
        shaper.do_step(t, step)
        assert abs(shaper.shaped - before) <= 1.7 + 1e-12  # never more than the command's own jumps
        before = shaper.shaped
        i += 1
    assert (shaper.shaped, shaper.shaped_mean, shaper.settled) == (-0.7, -0.7, True)  # exactly


def test_what_is_under_way_completes_as_designed_after_a_change():
    shaper = ready()
    amplitude, delay = shaper.amplitude[:3], shaper.delay[:3]
    shaper.command = 1.0
    shaper.do_step(0.0, 0.1)
    shaper.natural_frequency[0] = 50.0
    seen, t = [], 0.1
    for _ in range(300):
        shaper.do_step(t, 0.01)
        t += 0.01
        if not seen or shaper.shaped != seen[-1][1]:
            seen.append((t, shaper.shaped))
    assert [value for _, value in seen] == pytest.approx([amplitude[0], amplitude[0] + amplitude[1], 1.0], abs=1e-14)
    assert [time for time, _ in seen[1:]] == pytest.approx(delay[1:], abs=0.0101)


def test_a_new_command_after_a_change_is_shaped_by_the_new_design():
    shaper, fresh = ready(), ready(natural_frequency=[8.0], damping_ratio=[0.2])
    shaper.do_step(0.0, 0.1)
    shaper.natural_frequency[0], shaper.damping_ratio[0] = 8.0, 0.2
    shaper.command = fresh.command = 3.0
    for i in range(100):
        for one in (shaper, fresh):
            one.do_step(0.1 + 0.01 * i, 0.01)
        assert shaper.shaped == fresh.shaped
    assert shaper.duration == fresh.duration


@pytest.mark.parametrize(("name", "value"), [("natural_frequency", -1.0), ("natural_frequency", math.nan), ("damping_ratio", 1.0)])
def test_an_impossible_change_is_refused(name, value):
    shaper = ready()
    getattr(shaper, name)[0] = value
    with pytest.raises(ComponentError, match="natural_frequency must be greater than 0 rad/s"):
        shaper.do_step(0.0, 0.1)


@pytest.mark.parametrize(
    ("values", "steps", "mean"),
    [
        # UM-ZV of 1 Hz, a whole second: 1, -1, 1 at 0, 1/6, 1/3 s; the command is off from 1/6 to 1/3 s
        ({"shaper": "um_zv", "natural_frequency": [2 * math.pi]}, [(1.0, 1.0)], 5 / 6),
        # ZV of 1/2 Hz: a pulse of 0.1 s comes again at 1 s, within a step of 2 s, at half its size
        ({"shaper": "zv", "natural_frequency": [math.pi]}, [(1.0, 0.1), (0.0, 0.1), (0.0, 2.0)], 0.5 * 0.1 / 2.0),
    ],
)
def test_shaped_mean_sees_what_comes_and_goes_within_a_step(values, steps, mean):
    shaper, t = InputShaper(**values), 0.0
    shaper.initialize()
    for command, h in steps:
        shaper.command = command
        shaper.do_step(t, 0.0)
        shaper.do_step(t, h)
        t += h
    assert shaper.shaped_mean == pytest.approx(mean, abs=1e-14)


def test_too_many_impulses_are_an_error():
    shaper = InputShaper(shaper="miszv", modes=3, equal_impulses=9, natural_frequency=[1.0, 2.1, 3.3])
    with pytest.raises(ComponentError, match="the 3 modes convolved have more than 640 impulses"):
        shaper.initialize()
