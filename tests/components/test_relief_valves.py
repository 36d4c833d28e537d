"""The hydraulic pendulum's relief valves: against SciPy's Radau, physical bounds, and what stays as it was without them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_hydraulic_pendulum import seen, slopes

from shaper_fmu import System, fmu_path
from shaper_fmu.plants.hydraulic_pendulum import HydraulicPendulum

HEAVY = {"slide_mass": 300.0}
"""A slide of 300 kg at 0.65 m/s, whose valve closes as the reference jumps back: 441 bar without relief valves, of a supply of 100."""
AHEAD, TURN = 0.25, 0.4


def run(step=1e-3, stop=0.6, **values):
    """The plant at the end of the move, and the states at every step."""
    plant = HydraulicPendulum(**HEAVY, **values)
    plant.initialize()
    states = [seen(plant)]
    for i in range(round(stop / step)):
        plant.reference_position = AHEAD if i < round(TURN / step) else 0.0
        plant.do_step(i * step, step)
        states.append(seen(plant))
    return plant, np.array(states)


@pytest.fixture(scope="module")
def relieved():
    return run()


def test_without_valves_the_oil_locked_in_stops_the_slide():
    """What was seen before there were any: four times the supply's pressure, below the one at which the oil's spring had all energy.

    A column of the least volume V0 would take P^2 V0 / (2 beta), and the slide has m v^2 / 2.
    """
    plant, states = run(relief_conductance=0.0)
    speed = np.abs(states[:, 1]).max()
    peak = states[:, 4:6].max()
    assert peak == pytest.approx(441.4, abs=0.1)
    assert 1e5 * peak < math.sqrt(300.0 * speed**2 * plant.bulk_modulus / plant.dead_volume)


def test_the_valves_hold_the_pressure(relieved):
    """No chamber takes in more than its piston sweeps: what is above the opening pressure is that flow over the conductance."""
    plant, states = relieved
    swept = plant.piston_area * np.abs(states[:, 1]).max()
    bound = plant.relief_ratio * plant.supply_pressure + swept / plant.relief_conductance + 1e-3 * plant.supply_pressure
    peak = 1e5 * states[:, 4:6].max()
    assert plant.relief_ratio * plant.supply_pressure < peak < bound
    assert peak == pytest.approx(131.3e5, abs=0.1e5)


def test_it_agrees_with_radau(relieved):
    """The equations written anew, integrated by an implicit method at 1e-9, through the whole relief."""
    plant, states = relieved
    start = HydraulicPendulum(**HEAVY)
    start.initialize()
    y, at = np.array(seen(start)), 0.0
    for reference, stop in ((AHEAD, TURN), (0.0, 0.6)):
        found = solve_ivp(slopes, (at, stop), y, "Radau", args=(plant, lambda t, r=reference: r), rtol=1e-9, atol=1e-11)
        assert found.success
        y, at = found.y[:, -1], stop
    assert states[-1] == pytest.approx(y, abs=2e-6)
    assert np.abs(states[:, 4:6]).max() > 130.0  # bar: the valves were open


@pytest.mark.parametrize("step", [7e-3, 0.05, 0.2])
def test_the_communication_step_does_not_matter(relieved, step):
    """Tolerance: that of the integration, 1e-10 a substep, in bar."""
    whole = round(0.2 / step) * step
    short, _ = run(1e-3, whole)
    long, _ = run(step, whole)
    assert seen(long) == pytest.approx(seen(short), abs=1e-6)


def test_what_stays_below_the_opening_pressure_is_the_same_to_the_bit():
    """A jump by 90 mm, as large as the paper's move: not above 68 bar."""
    results = []
    for conductance in (0.0, 2e-10, 1e-6):
        plant = HydraulicPendulum(reference_position=0.09, relief_conductance=conductance)
        plant.initialize()
        plant.do_step(0.0, 0.6)
        results.append(seen(plant))
    assert results[0] == results[1] == results[2]


def test_the_oils_volume_is_balanced():
    """What flows in less what is relieved is what the piston sweeps and the oil's compression: by the FMU's own rates.

    V P' / beta = Q - A v, with the flow of the valve that the outputs give, at each point; the relieved oil counted once.
    """
    system = System()
    system.add("arm", fmu_path("HydraulicPendulum", platforms=["this"]), **HEAVY)
    system.drive("arm.reference_position", lambda t: AHEAD if t < TURN else 0.0)
    names = ("slide_position", "slide_velocity", "pressure[1]", "pressure[2]", "spool_position")
    rates = ("relative_pressure_rate[1]", "relative_pressure_rate[2]")
    found = system.simulate(0.6, 1e-3, record=[f"arm.{name}" for name in (*names, *rates)])
    x, v, p1, p2, spool = (found[f"arm.{name}"] for name in names)
    plant = HydraulicPendulum(**HEAVY)
    plant.initialize()
    open_points = 0
    for i in range(len(found.time)):
        y = [x[i], v[i], 0.0, 0.0, p1[i] / 1e5, p2[i] / 1e5, 0.0, spool[i]]
        expected = slopes(0.0, y, plant, lambda t: 0.0)[4:6]
        got = [found[f"arm.{name}"][i] * plant.supply_pressure / 1e5 for name in rates]
        assert got == pytest.approx(expected, rel=1e-9, abs=1e-6)
        open_points += max(p1[i], p2[i]) > 1.2e7
    assert open_points > 10
