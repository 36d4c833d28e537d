"""The hydraulic pendulum against equations written anew, closed forms and the balance of energy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

from shaper_fmu import System, fmu_path
from shaper_fmu.errors import ComponentError
from shaper_fmu.plants.hydraulic_pendulum import HydraulicPendulum

ROD = {"rod_length": 0.485, "rod_mass": 0.43, "hinge_damping": 0.0297}
LOCKED = {"slide_mass": 1e12, "proportional_gain": 0.0}


def orifice(opening, drop, supply):
    """Relative flow through one edge: the root of the pressure drop, linear below 1e-3 of the supply pressure."""
    d = drop / supply
    return opening * d * (d * d + 1e-6) ** -0.25


def flows(plant, p1, p2, spool):
    """Flow into each chamber [m3/s], from pressures in Pa; the edges A, B open to the supply, T1, T2 to the return."""
    supply, back = plant.supply_pressure, plant.return_pressure
    whole = plant.rated_flow * math.sqrt(supply / 3.5e6)
    ahead = 0.5 * (np.hypot(spool, plant.null_opening) + spool)
    behind = 0.5 * (np.hypot(spool, plant.null_opening) - spool)
    past = plant.leakage * (p1 - p2)
    lack1, lack2 = np.maximum(back - p1, 0.0), np.maximum(back - p2, 0.0)
    check1, check2 = (plant.makeup_conductance * lack**2 / (lack + 1e-3 * supply) for lack in (lack1, lack2))
    q1 = whole * (orifice(ahead, supply - p1, supply) - orifice(behind, p1 - back, supply)) - past + check1
    q2 = whole * (orifice(behind, supply - p2, supply) - orifice(ahead, p2 - back, supply)) + past + check2
    return q1 - relieved(plant, p1), q2 - relieved(plant, p2)


def relieved(plant, pressure):
    """Flow out of a chamber through its relief valve [m3/s]."""
    excess = np.maximum(pressure - plant.relief_ratio * plant.supply_pressure, 0.0)
    return plant.relief_conductance * excess**2 / (excess + 1e-3 * plant.supply_pressure)


def slopes(t, y, plant, reference):
    """The equations of motion, pressures in units of 1e5 Pa; mass matrix and forces from Lagrange's equations."""
    x, v, angle, rate, bar1, bar2, pilot, spool = y
    p1, p2 = 1e5 * bar1, 1e5 * bar2
    m, length = plant.rod_mass, plant.rod_length
    half = m * length / 2
    mass = np.array([[plant.slide_mass + m, half * math.cos(angle)], [half * math.cos(angle), m * length**2 / 3]])
    forces = np.array(
        [
            p1 * plant.piston_area - p2 * plant.annulus_area - plant.slide_damping * v + half * rate**2 * math.sin(angle),
            -plant.hinge_damping * rate - half * plant.gravity * math.sin(angle),
        ]
    )
    a, b = np.linalg.solve(mass, forces)
    q1, q2 = flows(plant, p1, p2, spool)
    v1 = plant.dead_volume + plant.piston_area * (plant.stroke / 2 + x)
    v2 = plant.dead_volume + plant.annulus_area * (plant.stroke / 2 - x)
    command = min(1.0, max(-1.0, plant.trim + plant.proportional_gain * (reference(t) - x)))
    w = plant.valve_frequency
    rise1 = plant.bulk_modulus * (q1 - plant.piston_area * v) / v1 / 1e5
    rise2 = plant.bulk_modulus * (q2 + plant.annulus_area * v) / v2 / 1e5
    return [v, a, rate, b, rise1, rise2, w * (command - pilot), w * (pilot - spool)]


def reference_run(plant, reference, stop, corners=()):
    """DOP853 at 1e-12, from rest; `corners` are the times at which the reference bends or jumps."""
    y = [0.0, 0.0, 0.0, 0.0, plant.pressure[0] / 1e5, plant.pressure[1] / 1e5, plant.trim, plant.trim]
    ends = [0.0, *corners, stop]
    for begin, end in itertools.pairwise(ends):
        found = solve_ivp(slopes, (begin, end), y, "DOP853", args=(plant, reference), rtol=1e-12, atol=1e-12)
        assert found.success
        y = found.y[:, -1]
    return y


def seen(plant):
    return [
        *(plant.slide_position, plant.slide_velocity, plant.swing_angle, plant.swing_rate),
        *(plant.pressure[0] / 1e5, plant.pressure[1] / 1e5, plant.pilot_position, plant.spool_position),
    ]


@pytest.fixture(scope="module")
def pushed():
    """A ramp of 0.5 m/s for 0.1 s, then a hold, to 0.2 s."""
    plant = HydraulicPendulum(leakage=4e-12, **ROD)
    plant.initialize()
    return reference_run(plant, lambda t: 0.5 * min(t, 0.1), 0.2, (0.1,))


@pytest.mark.parametrize("step", [1e-3, 0.01, 0.1])
def test_it_agrees_with_an_independent_integration(step, pushed):
    """With linear inputs, at any step. Tolerance: that of the integrators, gathered over the run."""
    plant = HydraulicPendulum(leakage=4e-12, **ROD)
    plant.initialize()
    for i in range(round(0.2 / step)):
        plant.reference_slope = 0.5 if i < round(0.1 / step) else 0.0
        plant.do_step(i * step, step)
    assert plant.reference_position == pytest.approx(0.05, abs=1e-15)
    assert abs(plant.swing_angle) > 0.05
    assert seen(plant) == pytest.approx(pushed, abs=2e-8)


def test_the_spool_stops_at_its_limits():
    """A jump of the reference that asks for six times the full opening."""
    plant = HydraulicPendulum(reference_position=0.1)
    plant.initialize()
    expected = reference_run(plant, lambda t: 0.1, 0.08)
    spools = []
    for i in range(160):
        plant.do_step(0.0005 * i, 0.0005)
        spools.append(plant.spool_position)
    assert 0.9999 < max(spools) <= 1.0
    assert seen(plant) == pytest.approx(expected, abs=3e-8)


@pytest.mark.parametrize("leakage", [0.0, 1e-12, 3e-11])
@pytest.mark.parametrize(("piston", "annulus"), [(4.91e-4, 3.77e-4), (4e-4, 4e-4), (8e-4, 2e-4)])
def test_it_rests_at_its_reference(leakage, piston, annulus):
    """P1 A1 = P2 A2 and P1 + P2 = supply + return pressure, whatever the leakage; the trim takes the rest."""
    plant = HydraulicPendulum(leakage=leakage, piston_area=piston, annulus_area=annulus)
    plant.initialize()
    assert plant.pressure[0] * piston == pytest.approx(plant.pressure[1] * annulus, rel=1e-14)
    assert sum(plant.pressure) == pytest.approx(plant.supply_pressure + plant.return_pressure, rel=1e-14)
    assert flows(plant, plant.pressure[0], plant.pressure[1], plant.trim) == pytest.approx((0.0, 0.0), abs=1e-14 * plant.rated_flow)
    plant.do_step(0.0, 0.5)
    assert [plant.slide_position, plant.slide_velocity, plant.swing_angle] == pytest.approx([0.0] * 3, abs=1e-12)


def test_small_swings_under_a_locked_slide_are_those_of_a_rod():
    """theta = theta0 exp(-zeta w t) (cos wd t + zeta w/wd sin wd t), w = sqrt(3 g / 2 l); nonlinear part: theta0^3 w t / 16."""
    plant = HydraulicPendulum(**ROD, **LOCKED)
    plant.initialize()
    w = math.sqrt(1.5 * 9.81 / 0.485)
    zeta = 0.0297 / (2 * w * 0.43 * 0.485**2 / 3)
    assert (plant.natural_frequency, plant.damping_ratio) == pytest.approx((w, zeta), rel=1e-14)
    assert zeta == pytest.approx(0.08, abs=1e-4)  # Kilic and Kapucu 2011, section 5
    assert w == pytest.approx(5.5045, rel=1e-3)  # measured there
    plant.swing_angle = 1e-3
    wd = w * math.sqrt(1 - zeta**2)
    for i in range(40):
        plant.do_step(0.1 * i, 0.1)
        t = 0.1 * (i + 1)
        wave = math.cos(wd * t) + zeta * w / wd * math.sin(wd * t)
        assert plant.swing_angle == pytest.approx(1e-3 * math.exp(-zeta * w * t) * wave, abs=1.5e-9)


def test_an_undamped_rod_under_a_locked_slide_keeps_its_energy():
    """m l^2 rate^2 / 6 + m g l (1 - cos angle) / 2, from a swing of 2 rad. Tolerance: 1e-10 a substep, some thousand substeps."""
    plant = HydraulicPendulum(rod_length=0.7, rod_mass=0.6, hinge_damping=0.0, **LOCKED)
    plant.initialize()
    plant.swing_angle = 2.0
    energies = []
    for i in range(100):
        plant.do_step(0.03 * i, 0.03)
        kinetic = 0.6 * 0.7**2 * plant.swing_rate**2 / 6
        energies.append(kinetic + 0.6 * 9.81 * 0.35 * (1 - math.cos(plant.swing_angle)))
    assert energies == pytest.approx([0.6 * 9.81 * 0.35 * (1 - math.cos(2.0))] * 100, rel=1e-7)


def test_the_balance_of_energy():
    """Work of the oil that enters the chambers = kinetic, potential and compression energy + friction, by Simpson's rule.

    From V P' = beta (Q - A v) follows P Q = P A v + P V P' / beta. Outputs of the native FMU every 0.1 ms.
    """
    system = System()
    system.add("arm", fmu_path("HydraulicPendulum", platforms=["this"]), slide_mass=4.0, rod_mass=1.2)
    system.drive("arm.reference_position", 0.04)
    names = ("slide_position", "slide_velocity", "swing_angle", "swing_rate", "pressure[1]", "pressure[2]", "spool_position")
    results = system.simulate(
        0.4, 1e-4, record=[f"arm.{name}" for name in (*names, "relative_pressure_rate[1]", "relative_pressure_rate[2]")]
    )
    x, v, angle, rate, p1, p2, spool = (results[f"arm.{name}"] for name in names)
    plant = HydraulicPendulum()
    rise1, rise2 = (plant.supply_pressure * results[f"arm.relative_pressure_rate[{i}]"] for i in (1, 2))
    q1, q2 = flows(plant, p1, p2, spool)
    v1 = plant.dead_volume + plant.piston_area * (plant.stroke / 2 + x)
    v2 = plant.dead_volume + plant.annulus_area * (plant.stroke / 2 - x)
    entered = p1 * q1 + p2 * q2
    compression = (p1 * v1 * rise1 + p2 * v2 * rise2) / plant.bulk_modulus
    friction = plant.slide_damping * v**2 + plant.hinge_damping * rate**2
    half = 1.2 * 0.485 / 2
    kinetic = 5.2 * v**2 / 2 + half * v * rate * np.cos(angle) + 1.2 * 0.485**2 / 6 * rate**2
    gained = kinetic + half * 9.81 * (1 - np.cos(angle))
    balance = simpson(entered - compression - friction, x=results.time)
    assert np.max(gained) > 1.0  # J
    assert balance == pytest.approx(gained[-1] - gained[0], abs=1e-6 * float(simpson(abs(entered), x=results.time)))


def test_a_heavy_slide_swings_on_the_oil():
    """Closed valve, no losses: x = v / w sin(w t) at the hydraulic frequency, with the rod's share of mass, a quarter."""
    plant = HydraulicPendulum(
        rod_mass=4.0, hinge_damping=0.0, gravity=1e-9, slide_damping=0.0, leakage=0.0, null_opening=1e-12, proportional_gain=0.0
    )
    plant.initialize()
    oil = sum(a * a / (3e-5 + a * 0.3) for a in (4.91e-4, 3.77e-4))
    w = math.sqrt(1.4e9 * oil / 11.0)
    assert plant.hydraulic_frequency == pytest.approx(w, rel=1e-14)
    plant.slide_velocity = speed = 1e-4
    plant.swing_rate = -1.5 * speed / 0.485  # so that the rod's momentum about the hinge is 0
    for i in range(50):
        plant.do_step(1e-3 * i, 1e-3)
        t = 1e-3 * (i + 1)
        assert plant.slide_position == pytest.approx(speed / w * math.sin(w * t), abs=1e-11)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_open_valve_gives_the_speed_it_promises(way):
    """Without friction and leakage; the edges' laminar part takes less than 1e-5."""
    plant = HydraulicPendulum(
        rod_mass=1e-6, hinge_damping=0.0, slide_damping=0.0, leakage=0.0, null_opening=1e-4, stroke=2.0, reference_position=way
    )
    plant.initialize()
    plant.do_step(0.0, 0.6)
    promised = plant.extending_speed if way > 0.0 else -plant.retracting_speed
    assert plant.slide_velocity == pytest.approx(promised, rel=1e-5)


def test_messages_say_what_to_do():
    for values, words in {
        (("return_pressure", 2e7),): r"return_pressure = 20000000 Pa must be less than supply_pressure = 10000000 Pa",
        (("leakage", 1e-9),): r"the valve cannot hold the slide at rest: it would have to open -?\d\.\d+ times",
        (("rod_length", 0.0),): r"rod_length = 0 m must be greater than 0 m",
    }.items():
        with pytest.raises(ComponentError, match=words):
            HydraulicPendulum(**dict(values)).initialize()


def test_the_end_of_the_stroke_is_an_error():
    plant = HydraulicPendulum(reference_position=-0.31)
    plant.initialize()
    with pytest.raises(ComponentError, match=r"slide_position = -0\.30\d+ m, possible is half a stroke of 0.6 m either way"):
        plant.do_step(0.0, 3.0)


def test_a_step_that_would_never_end_is_refused():
    plant = HydraulicPendulum()
    plant.initialize()
    for step in (1001.0, 1e308):
        with pytest.raises(ComponentError, match="a communication step of more than 1000 s is not possible"):
            plant.do_step(0.0, step)


def test_cavitation_is_an_error_also_within_a_step():
    """Reversed at full speed without make-up valves; the step is long enough for the pressure to recover."""
    plant = HydraulicPendulum(reference_position=0.2, makeup_conductance=0.0)
    plant.initialize()
    plant.do_step(0.0, 0.1)
    plant.reference_position = -0.2
    with pytest.raises(ComponentError, match=r"oil cavitates: the pressure in a chamber fell to -\d+\.\d+ Pa"):
        plant.do_step(0.1, 0.3)
    saved = HydraulicPendulum(reference_position=0.2)
    saved.initialize()
    saved.do_step(0.0, 0.1)
    saved.reference_position = -0.2
    saved.do_step(0.1, 0.3)
    assert min(saved.pressure) > 0.0
