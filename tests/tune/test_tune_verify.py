"""The shaped plant, simulated over a range of its parameters: closed forms of V on a mass and a spring."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from three_mass_loop import DAMPING, KD, KP, MASS, STIFFNESS, response

from shaper_fmu import System, fmu_path
from shaper_fmu.design.impulse_sequence import ImpulseSequence
from shaper_fmu.design.shapers import shaper
from shaper_fmu.errors import ComponentError, ModelError
from shaper_fmu.tune.choice.boxes import ModeBox, mode_boxes
from shaper_fmu.tune.choice.choice import Candidate, choose
from shaper_fmu.tune.choice.requirements import Move, Requirements
from shaper_fmu.tune.identify.range import identify_plant
from shaper_fmu.tune.verification.command import Command
from shaper_fmu.tune.verification.verify import Verification, _reason, verify

W = 10.0
BOXES = [ModeBox.around(W, margin=0.1)]
PLANT = {"mass": 1.0, "stiffness": W * W, "damping": 0.0}


def of_kind(kind: str, **options) -> Candidate:
    candidates = choose(BOXES, Requirements(kinds=(kind,), **options), floor=False).candidates
    return next(one for one in candidates if one.design.factors)


def verified(kind: str, spread: dict[str, float], **options) -> Verification:
    plant = fmu_path("MassSpringDamper", platforms=["this"])
    return verify(plant, "force", ["position"], of_kind(kind), BOXES, spread, start_values=PLANT, **options)


def zvd_leaves(mass: float) -> float:
    """cos(pi w / (2 w0))^2 (Singer and Seering 1990), w = sqrt(k / m)."""
    return math.cos(0.5 * math.pi / math.sqrt(mass)) ** 2


def test_before_and_after_are_those_of_the_closed_form():
    found = verified("zvd", {"mass": 0.1})
    assert found.nominal.before == (pytest.approx(1.0 / W**2, rel=1e-3),)  # the step's static deflection
    assert found.nominal.share == pytest.approx(0.0, abs=1e-6)
    assert found.worst.values == {"mass": pytest.approx(0.9)}
    assert found.worst.share == pytest.approx(zvd_leaves(0.9), rel=1e-3)
    for point in found.points:
        assert point.share == pytest.approx(zvd_leaves(point.values["mass"]), rel=1e-3, abs=1e-6)
    assert found.holds
    assert "over mass +-10 % the shaped plant leaves at most" in found.reason
    assert "(at mass = 0.9)" in found.reason
    assert found.reason.count("holds") == 1


def test_a_worst_case_between_the_points_of_the_grid_is_found():
    """A two-hump EI shaper's maxima inside its band are its tolerance; no point of the grid lies on one."""
    found = verified("two_hump_ei", {"stiffness": 0.45})
    tolerance = of_kind("two_hump_ei").design.factors[0].tolerance
    grid = {p.values["stiffness"] / W**2: p.share for p in found.points[:9]}
    assert sorted(grid) == pytest.approx(np.linspace(0.55, 1.45, 9))
    assert max(grid.values()) < tolerance * (1.0 - 2e-3)
    assert 0.56 < found.worst.values["stiffness"] / W**2 < 1.44
    assert found.worst.share == pytest.approx(tolerance, rel=1e-3)


def test_two_parameters_at_their_worst_corner():
    found = verified("zvd", {"mass": 0.2, "stiffness": 0.2}, tolerance=0.05)
    # w^2 from 0.8 / 1.2 to 1.2 / 0.8 of the nominal; ZVD is worse above
    assert found.worst.share == pytest.approx(zvd_leaves(0.8 / 1.2), rel=1e-3)
    assert not found.holds
    assert "does not hold" in found.reason


def test_the_plant_in_a_system_at_an_operating_point(fmus):
    system = System("machine")
    system.add("body", fmus / "MassSpringDamper.fmu", PLANT)
    system.set("body.damping", 4.0)  # with it the body has come to rest under the force of 30 before the step
    candidate = choose([ModeBox.around(W, 0.2)], Requirements(kinds=("zvd",)), floor=False).candidates[1]
    found = verify(
        system, "body.force", ["body.position"], candidate, BOXES, {}, command=Command(30.0, -2.0, 8.0)
    )  # fmt: skip
    assert found.worst == found.nominal
    assert found.points == (found.nominal,)
    # first swing of a damped step: x from 0 to 1 + exp(-pi zeta / sqrt(1 - zeta^2)), half of it
    overshoot = math.exp(-math.pi * 0.2 / math.sqrt(1.0 - 0.04))
    assert found.nominal.before == (pytest.approx(0.02 * 0.5 * (1.0 + overshoot), rel=1e-3),)
    assert found.nominal.share < 1e-4
    assert "the nominal parameters" in found.reason
    assert "body.force" not in system.connections  # the system is not changed
    assert list(system.fmus) == ["body"]


def test_places_where_the_plant_cannot_be_run_are_told():
    found = verified("zvd", {"mass": 1.0})  # a mass of 0 is outside its domain
    assert len(found.failed) == 1
    assert found.failed[0][0]["mass"] == 0.0
    assert "mass" in found.failed[0][1]
    assert not found.holds
    assert "At 1 other places the plant could not be run" in found.reason


def test_the_reason_never_says_more_than_the_verdict():
    """All shares simulated are within the tolerance, but a place failed, or the communication step may matter by more than is left."""
    failed = verified("zvd", {"mass": 1.0}, tolerance=1.5)
    assert failed.worst.share < 1.5
    assert not failed.holds
    assert "150 % is not shown to hold" in failed.reason
    seen = verified("zvd", {"mass": 0.1})
    for change in (0.01, 0.03, 0.05):
        coarse = replace(seen, step_change=change)
        assert coarse.holds == (seen.worst.share + change <= 0.05)
        reason = _reason(coarse, {"mass": 0.1}, [("m", 1.0)])
        assert f"5 % {'holds' if coarse.holds else 'is not shown to hold'}" in reason
        assert f"changes the nominal share by {100.0 * change:g} %" in reason
    assert not replace(seen, step_change=0.05).holds


def test_outputs_that_drift_are_refused(fmus):
    """Without springs to the ground the chain moves on for ever under a force."""
    names = ["position[3]"]
    boxes = [ModeBox.around(W, 0.01)]
    candidate = choose(boxes, Requirements(kinds=("zvd",)), floor=False).candidates[1]
    with pytest.raises(ComponentError, match=r"plant.position\[3\] does not settle after a step of plant.force"):
        verify(fmus / "ThreeMassChain.fmu", "force", names, candidate, boxes, {})


def test_what_makes_no_sense_is_refused(fmus):
    with pytest.raises(ModelError, match="Did you mean 'mass'"):
        verified("zvd", {"mas": 0.1})
    with pytest.raises(ModelError, match="cannot vary"):
        verified("zvd", {"damping": 0.1})
    with pytest.raises(ComponentError, match="no output vibrates"):
        verified("zvd", {}, command=Command(amplitude=0.0))
    candidate = choose(BOXES, Requirements(move=Move(1.0), kinds=("cycloid",))).candidates[0]
    with pytest.raises(ComponentError, match="needs a `move_command`"):
        verify(fmus / "MassSpringDamper.fmu", "force", ["position"], candidate, BOXES, {})
    assert np.isfinite(verified("zv", {}).worst.share)


def test_boxes_come_from_experiments(fmus):
    """A mass on a spring: w = sqrt(k / m), and the input's step moves it by 1 / k, all of it in one mode."""
    masses = [1.0, 0.8, 1.25]
    points = [{"mass": m, "stiffness": 100.0, "damping": 0.4} for m in masses]
    plant = identify_plant(fmus / "MassSpringDamper.fmu", "force", ["position"], points=points)
    (box,) = mode_boxes(plant)
    assert box.frequencies == pytest.approx((10.0 / math.sqrt(1.25), 10.0 / math.sqrt(0.8)), rel=1e-3)
    assert box.natural_frequency.nominal == pytest.approx(10.0, rel=1e-3)
    zeta = [0.4 / (2.0 * math.sqrt(100.0 * m)) for m in masses]
    assert box.dampings == pytest.approx((min(zeta), max(zeta)), rel=2e-2)
    assert box.amplitudes == pytest.approx([0.01] * 3, rel=1e-2)
    choice = choose([box], Requirements(kinds=("zv", "zvd", "ei")), floor=False)
    assert choice.recommended is not None
    tolerance = choice.recommended.start_values()["vibration_tolerance"]
    assert choice.recommended.sequence == shaper("ei", *box.centre, vibration_tolerance=tolerance)


def test_a_plant_that_swings_before_the_step_is_refused_with_numbers():
    """Released at 0 under a constant force of 30 it swings by 30 / k about 30 / k for ever."""
    with pytest.raises(
        ComponentError, match=r"does not rest at 1 s, .* position swings by \+-0.3 m, .* give a time after which it rests"
    ):
        verified("zvd", {}, command=Command(30.0, 2.0, 1.0))


def test_a_coupled_system_is_stepped_finely_enough(fmus):
    """The loop of Jung 2011: before and after from the step response of its matrices, within a few thousandths of the tolerance."""
    loop = System("loop")
    chain = {"mass": MASS, "stiffness": STIFFNESS, "damping": DAMPING}
    loop.add("chain", fmus / "ThreeMassChain.fmu", chain)
    loop.add("controller", fmus / "PositionController.fmu", {"proportional_gain": KP, "integral_gain": 0.0, "derivative_gain": KD})
    for source, target in (("position[1]", "position"), ("velocity[1]", "velocity")):
        loop.connect(f"chain.{source}", f"controller.{target}")
    loop.connect("controller.force", "chain.force")
    for k in (1, 2, 3):
        loop.set(f"chain.disturbance[{k}]", 0.0)
    known = response()
    poles = [pole for pole in known.poles if pole.imag > 0.0]
    boxes = [ModeBox.around(abs(pole), -pole.real / abs(pole)) for pole in poles]
    candidate = choose(boxes, Requirements(kinds=("zv",)), floor=False).candidates[1]  # on the fast mode: the slow one stays
    found = verify(loop, "controller.reference", ["chain.position[3]"], candidate, boxes, {}, tolerance=0.05)
    window = 1.5 * 2.0 * math.pi / min(box.natural_frequency.low for box in boxes)
    times = np.linspace(0.0, window, 20001)[1:]
    before, after = (
        0.5 * np.ptp(known.values(sequence, sequence.duration + times)[2])
        for sequence in (ImpulseSequence((1.0,), (0.0,)), candidate.sequence)
    )
    assert found.nominal.before == (pytest.approx(before, rel=2e-4),)
    assert found.nominal.share == pytest.approx(after / before, abs=1e-4)
    assert found.step_change < 5e-5
