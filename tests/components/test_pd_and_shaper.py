"""PD gains and shaper designed at once: closed forms, brute force, an independent integration, and the FMUs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from shaper_fmu.design import PdDesign, design_pd_and_shaper, shaper
from shaper_fmu.design.pd_and_shaper import _Task
from shaper_fmu.errors import ArgumentError, NoSolutionError
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics import Peak, SettlingTime

MASS, DISTANCE, FORCE = 2.0, 0.3, 5.0
SCALE = math.sqrt(MASS * DISTANCE / FORCE)
RANGE = (1.6, 2.5)


def test_the_fastest_pd_alone_overshoots_by_the_tolerance():
    """exp(-pi zeta/sqrt(1 - zeta^2)) = 0.98 * 0.02, a fiftieth of which is kept free, and Kp L is the whole force."""
    found = design_pd_and_shaper(MASS, DISTANCE, FORCE, shapers=["none"])
    log = math.log(0.0196)
    assert found.damping_ratio == pytest.approx(-log / math.hypot(math.pi, log), abs=2e-3)
    assert (found.proportional_gain, found.overshoot) == (pytest.approx(FORCE / DISTANCE), pytest.approx(0.0196, abs=3e-4))


def test_without_damping_a_zv_shaper_uses_the_force_twice():
    """Half the step at a time: Kp = 2 F/L, and (1 + cos w t)/2 = 0.02 of the way is left when it settles."""
    found = design_pd_and_shaper(MASS, DISTANCE, FORCE)
    assert (found.shaper, found.damping_ratio) == ("zv", 0.0)
    assert found.proportional_gain == pytest.approx(2 * FORCE / DISTANCE, rel=1e-6)
    assert found.settling_time == pytest.approx(math.acos(-0.96) * SCALE / math.sqrt(2), rel=1e-4)


# over the scale sqrt(m L/F): with the force limit, 2 % tolerance, 5 % overshoot; docs/drive_limits.md has these numbers
TIMES = {None: (3.61, 3.94, 2.02), RANGE: (4.98, 5.16, 3.51)}


@pytest.mark.parametrize("masses", TIMES)
def test_at_once_is_faster_than_one_after_the_other(masses):
    at_once = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=masses)
    alone = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=masses, shapers=["none"])
    after = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=masses, shapers=["zv", "zvd"], concurrent=False)
    assert [one.settling_time / SCALE for one in (alone, after, at_once)] == pytest.approx(TIMES[masses], abs=0.006)
    assert after.proportional_gain == pytest.approx(alone.proportional_gain)
    assert at_once.peak_force == pytest.approx(FORCE, rel=1e-9)


def simulated(found: PdDesign, mass: float, end: float) -> tuple[float, float, float]:
    """Settling time into 2 %, peak force and overshoot of an independent integration (scipy's DOP853)."""
    impulses = list(zip(found.sequence.delays, found.sequence.amplitudes, strict=True))
    state, times, positions, forces = [0.0, 0.0], [], [], []
    ends = [*found.sequence.delays[1:], end]
    for (begin, _), stop in zip(impulses, ends, strict=True):
        reference = DISTANCE * sum(a for t, a in impulses if t <= begin)

        def force(x, v, reference=reference):
            return found.proportional_gain * (reference - x) - found.derivative_gain * v

        grid = np.linspace(begin, stop, 4001)
        slopes = lambda _t, y, force=force: [y[1], force(y[0], y[1]) / mass]  # noqa: E731
        run = solve_ivp(slopes, (begin, stop), state, method="DOP853", t_eval=grid, rtol=1e-10, atol=1e-12)
        state = run.y[:, -1]
        times.append(run.t)
        positions.append(run.y[0] / DISTANCE)
        forces.append(force(run.y[0], run.y[1]))
    t, x, f = (np.concatenate(parts) for parts in (times, positions, forces))
    return float(t[np.flatnonzero(np.abs(x - 1) > 0.02)[-1]]), float(np.abs(f).max()), float(x.max() - 1)


def test_an_independent_integration_finds_the_same():
    found = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=RANGE, min_damping_ratio=0.1)
    runs = [simulated(found, mass, 12 * SCALE) for mass in np.linspace(*RANGE, 7)]
    assert max(run[0] for run in runs) == pytest.approx(found.settling_time, rel=4e-3)
    assert max(run[1] for run in runs) == pytest.approx(FORCE, rel=2e-4)
    assert max(run[2] for run in runs) == pytest.approx(found.overshoot, abs=3e-4)


def test_a_force_that_is_largest_on_the_way_is_found():
    """Without damping a heavier mass is braked harder, just before the second impulse, than the first one pushes; at w = 1 rad/s."""
    for ratio in (0.0, 0.02, 0.3):
        one = PdDesign(MASS, 2 * ratio * MASS, 1.0, ratio, "zvd", shaper("zvd", 1.0, ratio), 0.0, 0.0, 0.0, 0.0)
        runs = [simulated(one, mass, 20.0) for mass in (MASS, 1.7 * MASS)]
        found = _Task(np.array([1.0, 1.7]), 0.02, 1.0).seen("zvd", ratio)
        assert found.force == pytest.approx(max(run[1] for run in runs) / (MASS * DISTANCE), rel=2e-4)
        assert found.overshoot == pytest.approx(max(run[2] for run in runs), abs=2e-4)
        assert found.force > 1.2 * one.sequence.amplitudes[0] or ratio > 0.0


def test_no_design_of_a_random_search_settles_sooner():
    """Over gains and shaper, each with the largest gain that its peak force permits; the masses at the ends and in the middle."""
    found, rng = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=RANGE), np.random.default_rng(4)
    for _ in range(60):
        ratio, name = rng.uniform(0.0, 0.9), str(rng.choice(["zv", "zvd"]))
        one = PdDesign(
            MASS, 2 * ratio * MASS, 1.0, ratio, name, shaper(name, 1.0, ratio), 0.0, 0.0, 0.0, 0.0
        )  # w = 1 rad/s: time is w t, and the force Kp L
        runs = [simulated(one, mass, 16.0) for mass in (*RANGE, MASS)]
        gain = FORCE / max(run[1] for run in runs)
        if max(run[2] for run in runs) <= 0.05:
            assert max(run[0] for run in runs) / math.sqrt(gain) >= found.settling_time * (1 - 5e-3)


@pytest.mark.parametrize("masses", [None, RANGE])
def test_the_fmus_settle_in_that_time_within_the_force(fmus, masses):
    found = design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=masses, min_damping_ratio=0.1)
    system = System("positioning")
    for name, file in {"shaper": "InputShaper", "controller": "PositionController", "mass": "MassSpringDamper"}.items():
        system.add(name, fmus / f"{file}.fmu")
    for name, value in {"mass.stiffness": 1e-9, "mass.damping": 0.0, "shaper.command": DISTANCE}.items():
        system.set(name, value)
    system.connect("shaper.shaped", "controller.reference")
    system.connect("controller.force", "mass.force")
    for name in ("position", "velocity"):
        system.connect(f"mass.{name}", f"controller.{name}")
    metrics = {"settling": SettlingTime("mass.position", DISTANCE, 0.02 * DISTANCE), "force": Peak("controller.force")}
    with Simulation(system, record=[], metrics=metrics) as simulation:
        runs = [
            simulation.run(12 * SCALE, 1e-4 * SCALE, start_values={**found.start_values(), "mass.mass": mass}).metrics
            for mass in (MASS, *(masses or ()))
        ]
    assert max(run["force"] for run in runs) == pytest.approx(FORCE, rel=2e-3)
    assert max(run["settling"] for run in runs) == pytest.approx(found.settling_time, rel=5e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mass": 0.0}, "mass and max_force"),
        ({"mass_range": (2.5, 3.0)}, "contain mass = 2"),
        ({"tolerance": 1.0}, "tolerance"),
        ({"min_damping_ratio": 1.0}, "min_damping_ratio"),
        ({"shapers": []}, "at least one shaper"),
        ({"shapers": ["um_zv"]}, "negative impulses"),
    ],
)
def test_impossible_arguments_are_refused(arguments, message):
    with pytest.raises(ArgumentError, match=message):
        design_pd_and_shaper(**{"mass": MASS, "distance": DISTANCE, "max_force": FORCE, **arguments})


def test_a_range_in_which_nothing_settles_is_told():
    with pytest.raises(NoSolutionError, match="nothing settles within the limits"):
        design_pd_and_shaper(MASS, DISTANCE, FORCE, mass_range=(0.01, 200.0), tolerance=1e-4, max_overshoot=0.0)
