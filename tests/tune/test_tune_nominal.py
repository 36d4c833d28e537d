"""A condition at the modes' nominal points: against brute force, sampled V, closed forms and a linear programme of the test's own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from tuned_plants import dense_maxima, nominal_levels, random_plant, together

from shaper_fmu.errors import ComponentError
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.candidates import Design
from shaper_fmu.tune.choice.choice import Candidate, choose
from shaper_fmu.tune.choice.reasons import narrowed
from shaper_fmu.tune.choice.requirements import Requirements
from shaper_fmu.tune.choice.result import fits, shortest_of
from shaper_fmu.tune.identify.range import Range

SEEN_LESS = 1e-5  # than there is between the points of a grid
UNDAMPED = Range(0.0, 0.0, 0.0)
OFF_CENTRE = ModeBox(Range(4.51, 4.58, 4.79), UNDAMPED)


def nominal_plant(seed: int) -> tuple[list[ModeBox], Requirements]:
    """A random plant whose nominal points are anywhere in the boxes, and a nominal tolerance below the other one."""
    boxes, requirements = random_plant(seed)
    rng = np.random.default_rng(1000 + seed)
    moved = []
    for box in boxes:
        w, zeta = (float(rng.uniform(low, high)) for low, high in (box.frequencies, box.dampings))
        moved.append(
            replace(
                box,
                natural_frequency=replace(box.natural_frequency, nominal=w),
                damping_ratio=replace(box.damping_ratio, nominal=zeta),
            )
        )
    kinds = tuple(
        kind for kind in requirements.kinds or ("zv", "mzv", "zvd", "ei", "two_hump_ei", "si") if kind != "si" or len(boxes) == 1
    )
    return moved, replace(
        requirements, nominal_tolerance=requirements.tolerance * 10.0 ** float(rng.uniform(-2.0, -0.05)), kinds=kinds
    )


def shown(design: Design, boxes: list[ModeBox]) -> tuple[float, float, float]:
    """Delay, worst case and nominal level, from the impulses."""
    amplitudes, delays = design.sequence.amplitudes, design.sequence.delays
    worst = together(dense_maxima(amplitudes, delays, boxes), boxes)
    return delays[-1], worst, together(nominal_levels(amplitudes, delays, boxes), boxes)


@pytest.mark.representatives(seed=range(8))
@pytest.mark.parametrize("seed", range(24))
def test_the_recommendation_is_the_shortest_that_fits_both_conditions(seed: int):
    boxes, requirements = nominal_plant(seed)
    choice = choose(boxes, requirements, floor=False)
    seen = [shown(one.design, boxes) for one in (*choice.candidates, *choice.dominated)]
    for one, (delay, worst, nominal) in zip(choice.candidates, seen, strict=False):
        assert one.delay == pytest.approx(delay, rel=1e-12)
        assert worst <= one.worst_case <= worst + 1e-3
        assert one.nominal == pytest.approx(nominal, abs=1e-9)
    limit = requirements.longest_delay
    designs = [one.design for one in (*choice.candidates, *choice.dominated)]
    fitting = [
        (t, one.by_kind)
        for one, (t, v, n) in zip(designs, seen, strict=True)
        if v <= requirements.tolerance - SEEN_LESS and n <= requirements.nominal_tolerance - 1e-9 and t <= limit
    ]
    best = choice.recommended
    if best is None:
        assert not fitting
    else:
        assert fits(best, requirements)
        assert best.nominal <= requirements.nominal_tolerance
        assert best in choice.front
        for t, by_kind in fitting:  # a custom one that saves too little is passed over for one of a kind
            saving = requirements.least_saving if best.design.by_kind and not by_kind else 0.0
            assert t >= best.delay * (1.0 - saving - 1e-9)
    for one in choice.dominated:
        delay, worst, nominal = shown(one.design, boxes)
        assert one.by.delay <= delay * (1.0 + 1e-12)
        assert one.by.worst_case <= worst + SEEN_LESS
        assert max(one.by.nominal, requirements.nominal_tolerance) <= max(nominal, requirements.nominal_tolerance) + 1e-9


@pytest.mark.parametrize("seed", [0, 1, 6, 12, 25])
def test_nothing_on_the_front_is_dominated_in_three_dimensions(seed: int):
    boxes, requirements = nominal_plant(seed)
    choice = choose(boxes, requirements, floor=False)
    points = {id(one): (one.delay, one.worst_case, max(one.nominal, requirements.nominal_tolerance)) for one in choice.candidates}
    for one in choice.candidates:
        no_worse = [other for other in choice.candidates if all(np.less_equal(points[id(other)], points[id(one)]))]
        if any(one is kept for kept in choice.front):
            assert {points[id(other)] for other in no_worse} == {points[id(one)]}
        else:
            assert any(other is kept for kept in choice.front for other in no_worse)
    assert [one.delay for one in choice.front] == sorted(one.delay for one in choice.front)


def test_a_nominal_tolerance_from_the_tolerance_on_is_no_condition():
    box = ModeBox(Range(4.2, 4.6, 5.1), Range(0.01, 0.02, 0.03))
    plain, asked = (choose([box], Requirements(nominal_tolerance=limit, kinds=("zvd", "si")), floor=False) for limit in (1.0, 0.05))
    assert plain.recommended is not None
    assert asked.recommended == plain.recommended
    assert {one.name for one in asked.candidates} - {one.name for one in plain.candidates} == {"ZVD on 4.6 rad/s"}
    assert all(one.nominal <= one.worst_case for one in asked.candidates)


def specified(boxes: list[ModeBox], nominal_tolerance: float) -> tuple[Candidate, float | None]:
    """Specified insensitivity within 5 % and nominally within this tolerance, and the floor."""
    choice = choose(boxes, Requirements(nominal_tolerance=nominal_tolerance, kinds=("si",)))
    assert choice.recommended is not None
    assert choice.recommended.design.factors[0].kind == "si"
    return choice.recommended, choice.floor


@pytest.mark.parametrize("zeta", [0.0, 0.03])
@pytest.mark.parametrize("nominal_tolerance", [0.01, 2e-4])
def test_specified_insensitivity_keeps_both_tolerances(zeta: float, nominal_tolerance: float):
    box = ModeBox(Range(4.2, 4.6, 5.1), Range(0.7 * zeta, zeta, 1.5 * zeta))
    found, floor = specified([box], nominal_tolerance)
    sequence = found.sequence
    sampled = [
        sequence.residual_vibration(w, z) for w in np.linspace(*box.frequencies, 2000) for z in dict.fromkeys((*box.dampings, zeta))
    ]
    assert 0.0499 < max(sampled) <= 0.05
    assert nominal_levels(sequence.amplitudes, sequence.delays, [box])[0] <= nominal_tolerance
    assert sequence.certificate <= 0.05e-9
    free, _ = specified([box], 1.0)
    assert nominal_levels(free.sequence.amplitudes, free.sequence.delays, [box])[0] > 0.011
    assert free.delay < found.delay
    assert floor is not None
    assert floor <= found.delay <= floor * (1.0 + 1e-3)


def test_no_sequence_is_shorter_that_keeps_both_tolerances():
    """A linear programme over 200 pairs of impulses, which are optimal without damping, at 300 frequencies."""
    box = ModeBox(Range(4.2, 4.6, 5.1), UNDAMPED)
    duration = specified([box], 0.01)[0].delay * (1.0 - 5e-4)
    offsets = np.linspace(0.0, 0.5 * duration, 201)
    frequencies = np.append(np.linspace(*box.frequencies, 300), box.natural_frequency.nominal)
    rows = np.cos(np.outer(frequencies, offsets)) / np.append(np.full(300, 0.05), 0.01)[:, None]
    matrix = np.hstack((np.vstack((rows, -rows)), -np.ones((602, 1))))
    cost = np.append(np.zeros(201), 1.0)
    least = linprog(cost, matrix, np.zeros(602), 1.0 - cost[None], [1.0], method="highs")
    assert least.fun > 1.0


def test_two_modes_share_both_tolerances():
    boxes = [
        ModeBox(Range(4.2, 4.6, 5.1), Range(0.02, 0.03, 0.05), (1.0, 0.3)),
        ModeBox(Range(11.0, 12.0, 12.5), Range(0.01, 0.02, 0.03), (0.4, 0.3)),
    ]
    choice = choose(boxes, Requirements(nominal_tolerance=0.01, kinds=("zv", "si")), floor=False)
    assert choice.recommended is not None
    assert choice.recommended.name == "SI on 4.65 and 11.75 rad/s"
    _, worst, nominal = shown(choice.recommended.design, boxes)
    assert 0.97 * 0.05 <= worst <= 0.05
    assert 0.97 * 0.01 <= nominal <= 0.01


def test_what_zvd_and_zv_leave_nominally_is_told():
    """ZVD, undamped: V = cos(pi w / (2 w0))^2; ZV: V = |cos(pi w / (2 w0))| (Singer and Seering 1990)."""
    choice = choose([ModeBox(Range(4.2, 4.6, 5.1), UNDAMPED)], Requirements(kinds=("zv", "zvd")), floor=False)
    left = math.cos(0.5 * math.pi * 4.6 / 4.65)
    assert choice.recommended is not None
    assert choice.recommended.nominal == pytest.approx(left**2, abs=1e-9)
    assert f"it leaves at most 2.29 %, nominally {100.0 * left**2:.3g} %" in choice.reason
    nominal = choose(
        [ModeBox(Range(4.2, 4.6, 5.1), UNDAMPED)], Requirements(nominal_tolerance=1e-9, kinds=("zv", "zvd")), floor=False
    )
    assert nominal.recommended is not None
    assert nominal.recommended.name == "ZVD on 4.6 rad/s"
    assert "within 5 % over 4.2 to 5.1 rad/s and within 1e-07 % nominally" in nominal.reason
    assert "nominally less than 0.001 %" in nominal.reason


def test_a_shorter_one_that_misses_only_the_nominal_tolerance_is_told():
    """ZV on the middle of the range leaves |cos(pi w / (2 w0))|, too much at the nominal point."""
    box = ModeBox(Range(4.51, 4.72, 4.79), UNDAMPED)
    choice = choose([box], Requirements(nominal_tolerance=0.01, kinds=("zv", "zvd")), floor=False)
    assert choice.recommended is not None
    assert choice.recommended.name == "ZVD on 4.72 rad/s"
    left = abs(math.cos(0.5 * math.pi * 4.72 / 4.65))
    assert (
        f"ZV on 4.65 rad/s is {2.0 * math.pi / 4.72 - math.pi / 4.65:.3g} s shorter but leaves {100.0 * left:.3g} % nominally"
        in choice.reason
    )


def test_where_nothing_fits_nominally_the_ways_out_are_ways_out():
    requirements = Requirements(nominal_tolerance=0.01, longest_delay=1.0, kinds=("zv", "zvd"))
    choice = choose([OFF_CENTRE], requirements, floor=False)
    assert choice.recommended is None
    assert "nothing fits a tolerance of 5 %, a nominal tolerance of 1 % and a delay of 1 s over 4.51 to 4.79 rad/s" in choice.reason
    at_range = math.ceil(1e3 * abs(math.cos(0.5 * math.pi * 4.79 / 4.58)) * 10.0) / 1e4  # ZV on the nominal frequency
    at_nominal = math.ceil(1e4 * abs(math.cos(0.5 * math.pi * 4.58 / 4.65))) / 1e4  # ZV on the middle of the range
    assert f"a tolerance of {100.0 * at_range:.3g} % (ZV on 4.58 rad/s)" in choice.reason
    assert f"a nominal tolerance of {100.0 * at_nominal:.3g} % (ZV on 4.65 rad/s)" in choice.reason
    assert "a delay of 1.36 s (ZVD on 4.65 rad/s)" in choice.reason
    for other in ({"tolerance": at_range}, {"nominal_tolerance": at_nominal}, {"longest_delay": 1.36}):
        assert choose([OFF_CENTRE], replace(requirements, **other), floor=False).recommended is not None
    found = narrowed(choice)
    assert found is not None
    assert found[1][0].natural_frequency.nominal == 4.58
    # |cos(pi w / (2 w0))| = 0.05 at w = w0 (1 + 2/pi asin(0.05)); the lower end is as much nearer to the nominal frequency
    high = 4.58 * (1.0 + 2.0 / math.pi * math.asin(0.05))
    assert found[1][0].frequencies[1] == pytest.approx(high, rel=1e-3)
    assert choose(found[1], requirements, floor=False).recommended is not None


def test_where_one_tolerance_is_not_enough_both_are_told():
    """Unshaped alone is quick enough: its V is 1."""
    box = ModeBox.around(4.65, margin=0.05)
    choice = choose(
        [box, replace(box, amplitudes=(0.0,))], Requirements(0.5, 0.1, nominal_tolerance=0.01, kinds=("zv",)), floor=False
    )
    assert choice.recommended is None
    assert choice.nearest.nominal == choice.nearest.worst_case == pytest.approx(1.0)
    assert "a tolerance of" not in choice.reason.partition("These changes")[2]
    assert "a delay of 0.676 s" in choice.reason


def test_a_shaper_designed_by_its_kind_is_preferred_to_a_custom_one_of_the_same_length():
    """ZV on w leaves nothing at 3 w: the direct ZV for both is no longer."""
    boxes = [ModeBox.around(4.0), ModeBox.around(12.0)]
    choice = choose(boxes, Requirements(kinds=("zv", "direct_zv")), floor=False)
    direct = next(one for one in choice.candidates if one.design.factors and one.design.factors[0].kind == "direct_zv")
    assert choice.recommended is not None
    assert choice.recommended.name == "ZV on 4 rad/s"
    assert direct.delay == pytest.approx(choice.recommended.delay, rel=1e-9)
    zv = choice.recommended
    for share, first in ((1e-10, zv), (1e-8, direct)):
        shorter = replace(direct, delay=zv.delay * (1.0 - share), worst_case=0.0)
        assert shortest_of([shorter, zv]).name == first.name


@pytest.mark.parametrize("limit", [0.0, -0.1, 1.5, math.nan])
def test_nominal_tolerances_outside_their_domain_are_refused(limit: float):
    with pytest.raises(ComponentError, match=r"nominal_tolerance = .* 0 < nominal_tolerance <= 1"):
        Requirements(nominal_tolerance=limit)
