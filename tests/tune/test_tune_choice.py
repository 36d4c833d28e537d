"""The choice of a shaper: bounds, the front, the recommendation and its words, against brute force and closed forms."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from tuned_plants import dense_maxima, random_plant, together

from shaper_fmu import System, fmu_path
from shaper_fmu.commands.smooth_shaper import SmoothShaper
from shaper_fmu.design.shapers import shaper
from shaper_fmu.design.smoothers import smoother
from shaper_fmu.errors import ComponentError
from shaper_fmu.kinds.smoothers import SMOOTHERS
from shaper_fmu.tune.choice.boxes import ModeBox
from shaper_fmu.tune.choice.candidates import Design
from shaper_fmu.tune.choice.choice import Candidate, choose
from shaper_fmu.tune.choice.reasons import narrowed, percent_beside, rounded_up
from shaper_fmu.tune.choice.requirements import NEGATIVE, POSITIVE, Move, Requirements
from shaper_fmu.tune.choice.result import Choice
from shaper_fmu.tune.identify.range import Range
from shaper_fmu.tune.tuning_measured import tune_measured

W = 4.65


@pytest.mark.representatives(seed=range(25))
@pytest.mark.parametrize("seed", range(100))
def test_the_recommendation_is_never_dominated(seed: int):
    boxes, requirements = random_plant(seed)
    choice = choose(boxes, requirements, floor=False)
    designs = [(c.design, c.worst_case) for c in choice.candidates] + [(d.design, None) for d in choice.dominated]
    seen, alike = [], []  # alike: those that an InputShaper designs by their kind, as is the one recommended if one is as short
    for design, proven in designs:
        sequence = design.sequence
        worst = together(dense_maxima(sequence.amplitudes, sequence.delays, boxes), boxes)
        assert proven is None or worst <= proven <= worst + 1e-3
        if requirements.allow_negative or min(sequence.amplitudes) >= 0.0:
            seen.append((sequence.delays[-1], worst))
            alike += [seen[-1]] if design.by_kind else []
    seen_less = 1e-5  # than there is between the points of the grid
    fitting = [(t, v) for t, v in seen if v <= requirements.tolerance - seen_less and t <= requirements.longest_delay]
    best = choice.recommended
    if best is None:
        assert not fitting
        assert all(v >= choice.nearest.worst_case - seen_less for t, v in seen if t <= requirements.longest_delay)
    else:
        assert best.worst_case <= requirements.tolerance
        assert best.delay <= requirements.longest_delay * (1.0 + 1e-9)
        assert best in choice.front
        duration = best.sequence.delays[-1]
        saving = requirements.least_saving  # docs/choice.md: less than that, and a shaper of a kind is preferred to a custom one
        equals = alike if best.design.by_kind else seen
        assert not [t for t, _ in fitting if t < duration * (1.0 - 1e-9) and ((t, _) in equals or t < duration * (1.0 - saving))]
        assert not [t for t, v in equals if t < duration * (1.0 - 1e-9) and v < best.worst_case - seen_less]
        assert not [t for t, v in equals if t <= duration * (1.0 + 1e-9) and v < best.worst_case - seen_less]
        if not best.design.by_kind:
            assert not [t for t, v in fitting if (t, v) in alike and t * (1.0 - saving) < duration * (1.0 - 1e-9)]


def test_random_plants_are_of_all_sorts():
    choices = [choose(*random_plant(seed), floor=False) for seed in (0, 6, 7, 12, 45)]
    assert {len(choice.boxes) for choice in choices} == {1, 2}
    assert {choice.recommended is None for choice in choices} == {True, False}
    assert any(choice.dominated for choice in choices)


def test_every_kind_on_every_set_of_modes_is_considered():
    boxes = [ModeBox.around(3.0, 0.01, 0.05), ModeBox.around(7.0, 0.02, 0.05)]
    choice = choose(boxes, Requirements(kinds=POSITIVE), floor=False)
    considered = [one.design for one in choice.candidates] + [one.design for one in choice.dominated]
    names = {one.name for one in choice.left_out}
    lengths = {kind: [shaper(kind, *box.centre, vibration_tolerance=0.05).duration for box in boxes] for kind in POSITIVE}
    found = {tuple((f.kind, *f.modes) for f in design.factors) for design in considered}
    wanted = itertools.product((None, *POSITIVE), repeat=2)
    expected = {tuple((kind, k) for k, kind in enumerate(pair) if kind) for pair in wanted}
    missing = expected - found
    assert len(missing) == len(names) <= 4  # of too many impulses: 5 x 4, 5 x 5
    for (first, _), (second, _) in missing:
        assert len(shaper(first, 3.0).delays) * len(shaper(second, 7.0).delays) > 16
    for design in considered:
        assert design.sequence.duration == pytest.approx(sum(lengths[f.kind][f.modes[0]] for f in design.factors), rel=1e-3)


def test_the_front_falls_and_leaves_nothing_better_out():
    choice = choose([ModeBox.around(W, 0.02, 0.1)], Requirements(kinds=POSITIVE), floor=False)
    delays, levels = ([getattr(one, name) for one in choice.front] for name in ("delay", "worst_case"))
    assert delays == sorted(set(delays))
    assert levels == sorted(set(levels), reverse=True)
    for one in choice.candidates:
        assert any(other.delay <= one.delay and other.worst_case <= one.worst_case for other in choice.front)


def test_zv_leaves_what_its_closed_form_says():
    """ZV, undamped: V = |cos(pi w / (2 w0))| (Singer and Seering 1990)."""
    choice = choose([ModeBox.around(W, margin=0.1)], Requirements(kinds=("zv",)))
    zv = choice.candidates[1]
    assert zv.delay == pytest.approx(math.pi / W, rel=1e-14)
    assert zv.worst_case == pytest.approx(math.cos(0.5 * math.pi * 0.9), abs=1e-6)
    assert zv.at[0][0] in (pytest.approx(0.9 * W), pytest.approx(1.1 * W))


def test_modes_left_alone_count_with_their_shares_of_the_worst_output():
    """ZV on 5 rad/s leaves |cos(pi / 2 * 12.5 / 5)| = cos(pi / 4) of a mode at 12.5 rad/s; outputs with shares 0.1 and 0.25."""
    boxes = [ModeBox.around(5.0, amplitudes=(9.0, 3.0)), ModeBox.around(12.5, amplitudes=(1.0, 1.0))]
    choice = choose(boxes, Requirements(0.2, kinds=("zv",)))
    assert choice.recommended is not None
    assert choice.recommended.name == "ZV on 5 rad/s"
    assert choice.recommended.worst_case == pytest.approx(0.25 * math.sqrt(0.5), abs=1e-6)
    assert choice.recommended.bounds == (pytest.approx(0.0, abs=1e-6), pytest.approx(math.sqrt(0.5), abs=1e-6))


def test_margins_widen_the_range():
    box = ModeBox(Range(4.0, 5.0, 6.0), Range(0.02, 0.03, 0.05))
    choice = choose([box], Requirements(frequency_margin=0.1, damping_margin=0.5, kinds=("zvd",)), floor=False)
    assert choice.boxes[0].frequencies == pytest.approx((3.6, 6.6))
    assert choice.boxes[0].dampings == pytest.approx((0.01, 0.075))
    assert choice.boxes[0].natural_frequency.nominal == 5.0


def test_the_reason_of_a_recommendation():
    choice = choose([ModeBox(Range(4.2, 4.6, 5.1), Range(0.0, 0.0, 0.0))], Requirements(kinds=("zv", "ei")))
    assert choice.recommended is not None
    assert choice.floor is not None
    zv = choice.front[1]
    floor = 100.0 * (1.0 - choice.floor / choice.recommended.delay)
    assert choice.reason.startswith("EI on 4.65 rad/s: shortest of those within 5 % over 4.2 to 5.1 rad/s, ")
    assert f"ZV on 4.65 rad/s is {choice.recommended.delay - zv.delay:.3g} s shorter" in choice.reason
    assert f"may leave {100.0 * math.cos(0.5 * math.pi * 4.2 / 4.65):.3g} %" in choice.reason
    assert f"The floor is {floor:.3g} % below" in choice.reason


def test_modes_that_do_not_swing_need_no_shaper():
    boxes = [ModeBox.around(5.0, amplitudes=(1.0,)), ModeBox.around(12.0, amplitudes=(0.0,))]
    with pytest.raises(ComponentError, match="nothing vibrates"):
        choose([replace(box, amplitudes=(0.0,)) for box in boxes])
    with pytest.raises(ComponentError, match="no mode"):
        choose([])


@pytest.mark.parametrize("limit", [0.9, 0.1])
def test_where_nothing_fits_the_ways_out_are_ways_out(limit: float):
    boxes = [ModeBox.around(W, margin=0.1)]
    requirements = Requirements(longest_delay=limit, kinds=("zv", "zvd", "ei", "mzv"))
    choice = choose(boxes, requirements)
    assert choice.recommended is None
    assert choice.nearest.name == ("ZV on 4.65 rad/s" if limit > 0.5 else "unshaped")
    assert "nothing fits a tolerance of 5 % and a delay of" in choice.reason
    assert "a delay of 1.36 s (ZVD on 4.65 rad/s)" in choice.reason
    assert choose(boxes, replace(requirements, longest_delay=1.36)).recommended is not None
    if limit < 0.5:
        assert narrowed(choice) is None
        assert "a tolerance of" not in choice.reason.partition("These changes")[2]
        return
    larger = rounded_up(choice.nearest.worst_case)
    assert f"a tolerance of {100.0 * larger:.3g} % (ZV" in choice.reason
    assert choose(boxes, replace(requirements, tolerance=larger)).recommended is not None
    found = narrowed(choice)
    assert found is not None
    low, high = found[1][0].frequencies
    # |cos(pi w / (2 w0))| = 0.05 at w = w0 (1 -+ 2/pi asin(0.05))
    assert low == pytest.approx(W * (1.0 - 2.0 / math.pi * math.asin(0.05)), rel=1e-3)
    assert f"modes that stay within {low:.4g} to {high:.4g} rad/s (ZV on 4.65 rad/s)" in choice.reason
    assert choose(found[1], requirements).recommended is not None


def test_negative_impulses_only_where_they_are_allowed():
    boxes = [ModeBox.around(W, margin=0.05)]
    assert all(min(one.sequence.amplitudes) >= 0.0 for one in choose(boxes, floor=False).candidates)
    choice = choose(boxes, Requirements(allow_negative=True))
    assert {name.upper().replace("_", "-") for name in NEGATIVE} <= {one.name.split()[0] for one in choice.candidates}
    assert choice.recommended is not None
    assert choice.floor is not None
    assert min(choice.recommended.sequence.amplitudes) < 0.0
    assert choice.recommended.delay < choice.floor
    assert "shorter than any shaper of positive impulses could be" in choice.reason
    assert choice.to_floor(choice.recommended) is None


def test_no_positive_shaper_that_fits_is_below_the_floor():
    for boxes in ([ModeBox.around(W, margin=0.15)], [ModeBox.around(3.0, margin=0.05), ModeBox.around(8.0)]):
        choice = choose(boxes)
        assert choice.floor
        fitting = [one.delay for one in choice.candidates if one.worst_case <= 0.05]
        assert min(fitting) >= choice.floor * (1.0 - 1e-6)


@pytest.mark.parametrize(("kind", "width", "above"), [("ei", 0.399, 0.0), ("zvd", 0.2866, 0.070)])
def test_the_distance_to_the_floor_over_a_shapers_own_band(kind: str, width: float, above: float):
    """EI lies on the floor of its insensitivity at 5 %, ZVD 7.0 % above (docs/shapers.md)."""
    choice = choose([ModeBox.around(W, margin=0.5 * width)], Requirements(kinds=(kind,)), floor=False)
    assert choice.to_floor(choice.candidates[1]) == pytest.approx(above, abs=2e-3)


def candidate_with(choice: Choice, *kinds: str) -> Candidate:
    return next(one for one in choice.candidates if tuple(f.kind for f in one.design.factors) == kinds)


def test_start_values_make_the_input_shaper_this_shaper():
    boxes = [ModeBox.around(3.0, 0.02, 0.02, (1.0,)), ModeBox.around(8.0, 0.04, 0.02, (0.5,))]
    choice = choose(boxes, Requirements(kinds=("zv", "zvd", "ei", "direct_zv")), floor=False)
    for kinds in (("ei", "ei"), ("zv",), ("zvd", "zv"), ("direct_zv",), ()):
        one = candidate_with(choice, *kinds)
        system = System("shaped")
        system.add("shaper", fmu_path("InputShaper", platforms=["this"]), **one.start_values())
        system.drive("shaper.command", 1.0)
        results = system.simulate(stop_time=1.1 * one.delay + 0.1, step=0.05, record=["shaper.shaped", "shaper.settled"])
        passed = np.searchsorted(one.sequence.delays, results.time + 1e-9)
        assert results["shaper.shaped"] == pytest.approx(np.cumsum(one.sequence.amplitudes)[passed - 1], abs=1e-9)
        assert results["shaper.settled"][-1]


@pytest.mark.representatives(seed=[1])
@pytest.mark.parametrize("seed", range(12))
def test_smoothers_that_are_named_are_compared_and_the_shortest_that_fits_is_recommended(seed: int):
    """Brute force: every smoother on every number of modes, V on a dense grid of the boxes, by impulses at a higher frequency."""
    rng = np.random.default_rng(seed)
    modes = [(float(w), float(z)) for w, z in zip(rng.uniform(2.0, 20.0, 3), rng.choice([0.0, 0.01, 0.1], 3), strict=True)]
    boxes = [
        ModeBox.around(w, z, float(rng.uniform(0.0, 0.15)), (float(rng.uniform(0.2, 1.0)),)) for w, z in modes[: rng.integers(1, 4)]
    ]
    requirements = Requirements(tolerance=float(rng.uniform(0.02, 0.3)), kinds=tuple(SMOOTHERS))
    choice = choose(boxes, requirements, floor=False)
    order = sorted(range(len(boxes)), key=lambda k: -boxes[k].amplitudes[0])
    seen = []
    for kind, count in itertools.product(SMOOTHERS, range(1, len(boxes) + 1)):
        shaped = sorted(order[:count])
        kernel = smoother(kind, [boxes[k].centre[0] for k in shaped], [boxes[k].centre[1] for k in shaped])
        masses = kernel.as_impulses(3.0 * max(box.natural_frequency.high for box in boxes))
        seen.append((kernel.duration, together(dense_maxima(masses.amplitudes, masses.delays, boxes), boxes)))
    assert len(choice.candidates) >= len(set(seen)) >= len(boxes)
    fitting = [t for t, v in [(0.0, 1.0), *seen] if v <= requirements.tolerance - 1e-5]
    best = choice.recommended
    assert (best is not None) >= bool(fitting)
    if best is not None:
        assert best.worst_case <= requirements.tolerance
        assert best.delay <= min(fitting, default=math.inf) * (1.0 + 1e-9)
        assert not [t for t, v in seen if t < best.delay * (1.0 - 1e-9) and v < best.worst_case - 1e-5]


def test_a_smoothers_start_values_make_the_smooth_shaper_that_was_bounded():
    boxes = [ModeBox.around(3.0, 0.02, 0.02, (1.0,)), ModeBox.around(8.0, 0.04, 0.02, (0.5,))]
    best = choose(boxes, Requirements(kinds=("dzvd",)), floor=False).recommended
    assert best is not None
    assert best.design.smooth
    component = SmoothShaper(**best.start_values())
    component.initialize()
    assert component.duration == pytest.approx(best.delay, rel=1e-14)
    assert best.name == "DZVD on 3 rad/s"  # which lets nothing of the other mode through either
    with pytest.raises(ComponentError, match="dzvd is no InputShaper"):
        tune_measured("none.csv", requirements=Requirements(kinds=("dzvd",)))


def test_start_values_of_too_many_custom_impulses_are_refused():
    one, other = (
        choose([ModeBox.around(w)], Requirements(kinds=(kind,)), floor=False) for w, kind in ((3.0, "zvddd"), (7.0, "zvdd"))
    )
    design = Design(one.candidates[1].design.factors + other.candidates[1].design.factors)
    with pytest.raises(ComponentError, match="a custom InputShaper takes 16"):
        design.start_values()


def test_shapers_that_cannot_be_designed_are_told():
    """Three-hump EI shapers for 5 % end at a damping ratio of about 0.27 (docs/shapers.md)."""
    choice = choose([ModeBox.around(W, 0.3)], Requirements(kinds=("zv", "three_hump_ei")), floor=False)
    assert [one.name for one in choice.left_out] == ["three-hump EI on 4.65 rad/s"]
    assert "no three_hump_ei shaper was found" in choice.left_out[0].reason


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"tolerance": 0.0}, "0 < tolerance < 1"),
        ({"tolerance": math.nan}, "0 < tolerance < 1"),
        ({"longest_delay": -1.0}, "cannot be negative"),
        ({"kinds": ("zvv",)}, "Did you mean 'zv'|Did you mean 'zvd'"),
        ({"kinds": ("um_zv",)}, "allow_negative"),
        ({"frequency_margin": 1.0}, "margins"),
    ],
)
def test_requirements_outside_their_domain_are_refused(options: dict, words: str):
    with pytest.raises(ComponentError, match=words):
        choose([ModeBox.around(W)], Requirements(**options))


def test_boxes_outside_their_domain_are_refused():
    with pytest.raises(ComponentError, match="0 < low <= nominal <= high"):
        ModeBox(Range(5.0, 4.0, 6.0), Range(0.0, 0.0, 0.0))
    with pytest.raises(ComponentError, match="high < 1"):
        ModeBox(Range(4.0, 5.0, 6.0), Range(0.0, 0.5, 1.0))
    with pytest.raises(ComponentError, match="not negative"):
        ModeBox.around(5.0, amplitudes=(-1.0,))
    with pytest.raises(ComponentError, match="each needs as many"):
        choose([ModeBox.around(5.0), ModeBox.around(9.0, amplitudes=(1.0, 2.0))])
    with pytest.raises(ComponentError, match="distance"):
        Move(0.0)


@pytest.mark.parametrize(("share", "told"), [(0.0100004, "1.00004 %"), (0.0123, "1.23 %"), (0.00999, "0.999 %"), (0.2, "20 %")])
def test_a_share_beside_a_limit_of_1_percent_is_told_from_it(share, told):
    """Never "1 %, more than 1 %"."""
    assert percent_beside(share, 0.01) == told
