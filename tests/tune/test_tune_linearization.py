"""Linearization of FMUs: matrices by hand, modes of plants with hidden parameters, FMUs that go wrong, and beside experiments."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hidden_plants import HIDDEN
from linear_fmus import PARAMETERS, STATES, faulty, linear_fmu, matrices

from shaper_fmu import System
from shaper_fmu.design.modal_responses import step_response
from shaper_fmu.errors import ComponentError, ShaperFmuError, SimulationError
from shaper_fmu.tune.identify.experiment import experiment
from shaper_fmu.tune.identify.linear_comparison import compare
from shaper_fmu.tune.identify.linear_differences import jacobian
from shaper_fmu.tune.identify.linearization import LinearizationError, NoLinearizationError, linearize
from shaper_fmu.tune.identify.range import identify_plant

BOTH = "CoSimulation ModelExchange"
KINDS = ["", "CoSimulation", "ModelExchange", BOTH]
BENT = {"cubic": 5.0, "d": 0.25}


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("directional", KINDS)
def test_matrices_at_the_operating_point(version, directional):
    """A Duffing spring that a constant force has deflected: by directional derivatives to the bit, by differences to 1e-12.

    The force of 4 balances 9 q + 5 q^3.
    """
    found = linearize(linear_fmu(version, directional), "u", ["y"], start_values=BENT, point={"u": 4.0})
    assert found.at_rest
    assert found.time > 0.0
    assert found.states == STATES
    q = found.state[0]
    assert q == pytest.approx(max(np.roots([5.0, 0.0, 9.0, -4.0]), key=np.real).real, rel=1e-4)  # settled to 1e-3
    exact = matrices(q, **BENT)
    for one, other in zip((found.A, found.B, found.C, found.D), exact, strict=True):
        if directional:
            assert one.tolist() == other.tolist()
        else:
            assert np.abs(one - other).max() < 1e-12 * np.abs(exact[0]).max()
    assert found.origin == ("directional derivatives" if directional else "differences")
    assert (np.abs(found.A - exact[0]) <= found.error).all()
    assert (found.error <= 1e-11 * np.abs(exact[0]).max()).all()


@pytest.mark.parametrize("directional", KINDS)
def test_modes_and_residues(directional):
    """Those of q'' + 2 zeta w q' + w^2 q = b u after a unit step: c b / w^2 (-1 + j zeta / sqrt(1 - zeta^2))."""
    found = linearize(linear_fmu(2, directional), "u", ["y"])
    assert found.time == 0.0
    assert found.unrest == 0.0
    assert found.input == "u"
    assert found.outputs == ("y",)
    for mode, k in zip(found.modes, (1, 2), strict=True):
        w, zeta, b = (PARAMETERS[f"{name}{k}"] for name in "wzb")
        assert mode.natural_frequency == pytest.approx(w, rel=1e-13)
        assert mode.damping_ratio == pytest.approx(zeta, rel=1e-11)
        assert mode.residues == pytest.approx([b / w**2 * complex(-1.0, zeta / math.sqrt(1.0 - zeta**2))], rel=1e-11)
        assert mode.error < 1e-12
    expected = step_response(*matrices()[:3])
    assert found.step_response().residues == pytest.approx(expected.residues, rel=1e-11)
    assert linearize(linear_fmu(2), "u", ["y"], start_values={"d": 0.5}).step_response().final == pytest.approx([0.5 + 1 / 9 + 0.1])


LIMITS = {
    "MassSpringDamper": 1e-12,
    "OverheadCrane": 1e-12,
    "ThreeMassChain": 1e-12,
    "FlexibleBeam": 3e-6,
    "DoublePendulumCrane": 1e-9,
    "RotatingBeam": 3e-6,
}


@pytest.mark.parametrize("name", HIDDEN)
def test_hidden_modes(fmus, name):
    """Ten draws of each plant, by differences in Model Exchange, against eigenvalues by numpy; of the beam, those of its finite
    elements. A rigid body's poles at 0 are no modes."""
    rng = np.random.default_rng(11)
    for _ in range(10):
        hidden = HIDDEN[name](rng)
        found = linearize(fmus / f"{name}.fmu", hidden.input, hidden.outputs, start_values=hidden.values)
        assert found.at_rest
        poles = [mode.pole for mode in found.modes if np.abs(mode.residues).max() > 0.0]
        assert poles == pytest.approx(list(hidden.poles), rel=LIMITS[name])


def test_a_rigid_body_has_no_step_response(fmus):
    found = linearize(fmus / "ThreeMassChain.fmu", "force", ["position[1]"])
    assert np.sum(np.abs(found.poles) < 1e-5) == 2
    assert len(found.poles) == 6
    with pytest.raises(ComponentError, match=r"not stable|does not decay|coincide"):
        found.step_response()


def test_a_point_that_is_not_at_rest(fmus):
    """A force of 3 N on 100 N/m at 0: 0.03 m from its equilibrium, beside the nominal 0.01 m of 1 N."""
    plant = fmus / "MassSpringDamper.fmu"
    found = linearize(plant, "force", ["position"], point={"force": 3.0}, settle_time=0.0)
    assert found.unrest == pytest.approx(3.0, rel=1e-9)
    assert not found.at_rest
    assert found.derivative == pytest.approx([0.0, 3.0])
    settled = linearize(plant, "force", ["position"], point={"force": 3.0})
    assert settled.at_rest
    assert settled.state == pytest.approx([0.03, 0.0], abs=1e-6)
    pushed = linearize(fmus / "ThreeMassChain.fmu", "force", ["position[1]"], point={"force": 330.0}, settle_time=0.0)
    assert pushed.unrest > 0.1  # nothing holds it: no state balances the force


WRONG = [
    ("directional_fails", "CoSimulation", "GetDirectionalDerivative failed: no derivatives today"),
    ("directional_fails", "ModelExchange", "GetDirectionalDerivative failed: no derivatives today"),
    ("directional_nan", "CoSimulation", "directional derivatives with respect to .* of nan"),
    ("derivatives_fail", "", "Derivatives failed: no right-hand side"),
    ("derivatives_nan", "", "state derivatives of nan"),
    ("endless", "", "DiscreteStates asked for another update again and again"),
    ("terminates", "", "DiscreteStates asked to end the simulation"),
    ("states_refused", "", "SetContinuousStates failed: no such states"),
    ("huge_state", "", "of 1e\\+200"),
]


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(("fault", "directional", "words"), WRONG)
def test_fmus_that_go_wrong_are_refused(version, fault, directional, words):
    with pytest.raises(SimulationError, match=words):
        linearize(linear_fmu(version, directional), "u", ["y"], start_values=faulty(fault), point={"u": 1.0}, settle_time=1.0)


def test_fmus_that_contradict_themselves():
    with pytest.raises(SimulationError, match="declares 4 states but has 40000"):
        linearize(linear_fmu(3), "u", ["y"], start_values=faulty("other_count"), settle_time=0.0)
    with pytest.raises(LinearizationError, match=r"Model Exchange gives y = .* in the states in which co-simulation gives"):
        linearize(linear_fmu(2), "u", ["y"], start_values=faulty("other_output"), point={"u": 1.0}, settle_time=1.0)
    with pytest.raises(LinearizationError, match="lists a derivative, but not of which state"):
        linearize(linear_fmu(2, rates=False), "u", ["y"])


def test_what_an_fmu_lacks_is_named(fmus):
    with pytest.raises(NoLinearizationError, match="neither Model Exchange nor directional derivatives"):
        linearize(linear_fmu(2, exchange=False), "u", ["y"])
    with pytest.raises(NoLinearizationError, match="declares no continuous states"):
        linearize(fmus / "PulseWidthModulator.fmu", "reference", ["pulse"])
    with pytest.raises(NoLinearizationError, match="u is discrete"):
        linearize(linear_fmu(2, input_="discrete"), "u", ["y"])
    system = System("two")
    system.add("one", linear_fmu(2))
    system.add("other", linear_fmu(2))
    system.connect("one.y", "other.u")
    with pytest.raises(NoLinearizationError, match="a system of 2 coupled FMUs"):
        linearize(system, "one.u", ["other.y"])


def test_a_system_of_one_fmu():
    system = System("alone")
    system.add("machine", linear_fmu(3, "ModelExchange"), w1=4.0)
    found = linearize(system, "machine.u", ["machine.y"], point={"machine.w2": 10.0})
    assert found.A.tolist() == matrices(w1=4.0, w2=10.0)[0].tolist()
    assert [mode.natural_frequency for mode in found.modes] == pytest.approx([4.0, 10.0], rel=1e-13)


@pytest.mark.parametrize("version", [2, 3])
def test_an_experiment_is_compared(version):
    """Both modes agree; the tangent at the deflected spring has w^2 + 3 cubic q^2."""
    found = experiment(linear_fmu(version, BOTH), "u", ["y"], start_values=BENT, point={"u": 4.0})
    assert found.linear is not None
    assert found.linear.agrees
    assert found.linear.linearization.time == found.settle_time > 0.0
    q = max(np.roots([5.0, 0.0, 9.0, -4.0]), key=np.real).real
    assert found.modes[0].natural_frequency == pytest.approx(math.sqrt(9.0 + 15.0 * q * q), rel=1e-4)
    assert found.linear.worst < 1e-4
    (finding,) = (one for one in found.findings if one.code == "linearized")
    assert "2 modes agree" in finding.text


def test_two_ways_to_the_modes_of_a_nonlinear_plant(fmus):
    """The servo-hydraulic slide with its rod, eight states: what swings in the outputs, and eigenvalues of the right-hand side."""
    found = experiment(fmus / "HydraulicPendulum.fmu", "reference_position", ["swing_angle", "slide_position"])
    assert found.linear is not None
    assert found.linear.agrees
    assert len(found.linear.linearization.states) == 8
    for mode, other in zip(found.modes, found.linear.linearization.modes, strict=True):
        assert mode.pole == pytest.approx(other.pole, rel=1e-5)
        assert found.step_residues(mode) == pytest.approx(other.residues, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("unseen", [{"b2": 0.0}, {"c2": 0.0}])
def test_modes_that_the_experiment_cannot_see_are_told(unseen):
    """A mode that is not excited, or not in the output; that is no disagreement."""
    found = experiment(linear_fmu(2), "u", ["y"], start_values=unseen)
    assert len(found.modes) == 1
    assert found.linear is not None
    assert found.linear.agrees
    assert [mode.natural_frequency for mode in found.linear.hidden] == pytest.approx([20.0], rel=1e-12)
    assert any("not seen in these outputs: 20 rad/s" in finding.text for finding in found.findings)


def test_disagreement_is_told():
    """The same experiment beside matrices with another first mode; with one mode fewer; and beside modes outside of the record."""
    found = experiment(linear_fmu(2), "u", ["y"])
    assert found.linear is not None
    linearization = found.linear.linearization

    def beside(identification=found.identification, **given):
        a, b, c, d = matrices(**given)
        other = replace(linearization, A=a, B=b, C=c, D=d)
        return compare(other, identification, found.excitation, found.nonlinearity, 1e-3)

    assert beside().agrees
    shifted = beside(w1=3.03)
    assert not shifted.agrees
    assert shifted.worst == pytest.approx(0.03 / 3.03, rel=1e-3)
    assert "its mode of 3.03 rad/s (damping ratio 0.05) was found at 3 rad/s (damping ratio 0.05), 9.9e-03 apart" in shifted.text
    fewer = beside(replace(found.identification, modes=found.modes[:1]))
    assert "its mode of 20 rad/s (damping ratio 0.02)" in fewer.text
    assert "was not found" in fewer.text
    assert "has no mode of 20 rad/s (damping ratio 0.02), which was found" in beside(b2=0.0, w2=100.0).text
    assert "apart do not show it" in beside(w2=2000.0, b2=4e9).text
    assert "is too short for it" in beside(w1=0.03, b1=1.0).text


def test_a_linearization_that_fails_is_a_finding():
    found = experiment(linear_fmu(2, BOTH), "u", ["y"], start_values=faulty("directional_fails"))
    assert len(found.modes) == 2
    assert found.linear is None
    assert "no derivatives today" in next(one.text for one in found.findings if one.code == "not_linearized")
    for quiet in (
        experiment(linear_fmu(2, exchange=False), "u", ["y"]),
        experiment(linear_fmu(2), "u", ["y"], linear=False),
    ):
        assert quiet.linear is None
        assert not quiet.findings
    moving = experiment(linear_fmu(2), "u", ["y"], start_values={"z1": 0.0, "b2": 0.0}, point={"u": 1.0})
    assert "of their size from rest" in next(one.text for one in moving.findings if one.code == "not_linearized")


def test_each_operating_point_is_compared():
    found = identify_plant(linear_fmu(2), "u", ["y"], points=[{}, {"w1": 4.0}])
    assert [one.linear.agrees for one in found.experiments if one.linear is not None] == [True, True]
    assert [one.code for one in found.findings] == ["linearized"]


def test_differences_take_a_step_that_fits():
    """Of sin(w x) at 0, w; a magnitude that is too large is noticed, and so is the end of the domain."""

    def wave(x: np.ndarray) -> np.ndarray:
        if abs(x[0]) > 1e-4:
            raise SimulationError("beyond the domain")
        return np.sin(1e4 * x)

    found, error = jacobian(lambda x: np.sin(1e4 * x), np.zeros(1), np.ones(1), np.ones(1))
    assert abs(found[0, 0] - 1e4) <= error[0, 0] < 1e-6
    assert jacobian(wave, np.zeros(1), np.ones(1), np.ones(1))[0] == pytest.approx(1e4, rel=1e-10)
    with pytest.raises(SimulationError, match="beyond the domain"):
        jacobian(wave, np.ones(1), np.ones(1), np.ones(1))


def test_the_same_bits_each_time():
    one, other = (linearize(linear_fmu(3), "u", ["y"], start_values=BENT, point={"u": 4.0}) for _ in range(2))
    for a, b in ((one.A, other.A), (one.B, other.B), (one.state, other.state), (one.poles, other.poles)):
        assert a.tobytes() == b.tobytes()


def test_every_error_is_for_users():
    assert issubclass(NoLinearizationError, LinearizationError)
    assert issubclass(LinearizationError, ShaperFmuError)
