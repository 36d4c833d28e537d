"""Metrics that are computed while stepping: against closed forms, and against the recorded trajectory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from shaper_fmu.analysis.response import command_end, residual_amplitude
from shaper_fmu.errors import ModelError, SimulationError
from shaper_fmu.master.batch import Batch, Plan
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.master.system import System
from shaper_fmu.metrics.effort import Effort
from shaper_fmu.metrics.envelope import Envelope
from shaper_fmu.metrics.final import Final
from shaper_fmu.metrics.overshoot import Overshoot
from shaper_fmu.metrics.peak import Peak
from shaper_fmu.metrics.residual import Residual
from shaper_fmu.metrics.settling_time import SettlingTime

W, ZETA = 2.0 * math.pi, 0.1


@pytest.fixture
def step_response(fmus) -> System:
    """A step of 1 on an oscillator with a gain of 1."""
    system = System()
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, stiffness=W * W, damping=2.0 * ZETA * W)
    system.drive("plant.force", ([0.0, 0.5], [0.0, W * W]))
    return system


def test_a_step_response_has_the_overshoot_and_peak_of_the_formula(step_response):
    """Overshoot exp(-pi zeta / sqrt(1 - zeta^2)) of a second-order system; steps miss up to (w h)^2 / 8 of the peak."""
    metrics = {
        "final": Final("plant.position"),
        "overshoot": Overshoot("plant.position"),
        "peak": Peak("plant.position"),
        "settling": SettlingTime("plant.position", target=1.0, tolerance=0.02),
        "effort": Effort("plant.force"),
    }
    h = 0.0005
    with Simulation(step_response, record=[], metrics=metrics) as simulation:
        found = simulation.run(8.5, h).metrics
    overshoot = math.exp(-math.pi * ZETA / math.sqrt(1.0 - ZETA**2))
    assert found["final"] == pytest.approx(1.0, abs=1e-2)
    assert found["overshoot"] == pytest.approx(overshoot, abs=2 * (W * h) ** 2 + 2 * math.exp(-ZETA * W * 8.0))
    assert found["peak"] == pytest.approx(1.0 + overshoot, abs=(W * h) ** 2)
    assert found["effort"] == pytest.approx(W * W * math.sqrt(8.0 / 8.5), rel=1e-12)
    # the envelope exp(-zeta w t) / sqrt(1 - zeta^2) is at 0.02 at the latest
    latest = -math.log(0.02 * math.sqrt(1.0 - ZETA**2)) / (ZETA * W)
    assert latest - 0.5 <= found["settling"] - 0.5 <= latest


def test_the_residual_begins_at_the_commands_last_change(fmus):
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[W])
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, stiffness=1.2 * W * W, damping=0.0)
    system.drive("shaper.command", ([0.0, 0.3], [0.0, W * W]))
    system.connect("shaper.shaped", "plant.force")
    own = math.sqrt(1.2) * W
    metrics = {
        "residual": Residual("plant.position", command="shaper.shaped"),
        "envelope": Envelope("plant.position", command="shaper.shaped", rate="plant.velocity", natural_frequency=own, rest=1 / 1.2),
    }
    with Simulation(system, metrics=metrics) as simulation:
        results = simulation.run(4.0, 0.001)
        again = simulation.run(4.0, 0.001)
    end = command_end(results.time, results["shaper.shaped"])
    assert end == pytest.approx(0.3 + math.pi / W, abs=0.001)
    expected = abs(math.cos(0.5 * math.pi * own / W)) / 1.2  # two impulses of 1/2, pi/W apart, on the mode at `own`
    assert results.metrics["envelope"] == pytest.approx(expected, abs=1e-12)
    assert results.metrics["residual"] == pytest.approx(expected, rel=(own * 0.001) ** 2 / 8)
    assert results.metrics["residual"] == pytest.approx(residual_amplitude(results.time, results["plant.position"], end), rel=1e-5)
    assert again.metrics == results.metrics


def test_without_a_record_the_metrics_are_the_same(step_response):
    metrics = {"peak": Peak("plant.velocity"), "final": Final("plant.position")}
    runs = []
    for record in ([], None):
        with Simulation(step_response, record=record, metrics=metrics) as simulation:
            runs.append(simulation.run(2.0, 0.01))
    assert not runs[0].values
    assert runs[0].metrics == runs[1].metrics
    assert runs[1].metrics["final"] == runs[1]["plant.position"][-1]
    assert runs[1].metrics["peak"] == np.max(np.abs(runs[1]["plant.velocity"]))


def test_a_batch_gives_the_metrics_of_single_runs_to_the_bit_and_tells_what_fails(fmus):
    """Every metric over three stiffnesses, together in one compiled call and one by one; then a command that has not ended."""
    system = System()
    system.add("shaper", fmus / "InputShaper.fmu", shaper="zv", natural_frequency=[W], command=W * W)
    system.add("plant", fmus / "MassSpringDamper.fmu", mass=1.0, damping=0.5)
    system.connect("shaper.shaped", "plant.force")
    position, command = "plant.position", "shaper.shaped"
    metrics = {
        "final": Final(position), "peak": Peak(position), "overshoot": Overshoot(position), "effort": Effort(command),
        "residual": Residual(position, command), "envelope": Envelope(position, command, "plant.velocity", W, 1.0),
        "settling": SettlingTime(position, 1.0, 0.2), "unsettled": SettlingTime(position, 5.0, 0.2),
    }  # fmt: skip
    varied = [{"plant.stiffness": factor * W * W} for factor in (0.8, 1.0, 1.3)]
    with Simulation(system, record=[], metrics=metrics) as simulation:
        single = [simulation.run(4.0, 0.01, start_values=values).metrics for values in varied]
    assert [run["unsettled"] for run in single] == [math.inf] * 3
    with Batch(system, Plan(4.0, 0.01), metrics, ["plant.stiffness"]) as batch:
        assert [batch.run(values) for values in varied] == single
        assert batch.run_rows(batch.rows(varied)) == [tuple(run.values()) for run in single]
    end = math.pi / W  # of the shaped command: the last jump is at the run's last point
    with Batch(system, Plan(end, end / 10), metrics, []) as batch, pytest.raises(SimulationError, match="has not come to its end"):
        batch.run({})


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        (Peak("plant.positon"), "Did you mean 'position'"),
        ("peak", "metric 'm' is 'peak'; use .*Final, Overshoot, Peak"),
        (SettlingTime("plant.position", 1.0, 0.0), "metric 'm': 0.0 must be a positive number"),
        (SettlingTime("plant.position", math.nan, 0.1), "metric 'm': nan must be a finite number"),
    ],
)
def test_wrong_metrics_are_refused(step_response, metric, words):
    with pytest.raises(ModelError, match=words), Simulation(step_response, metrics={"m": metric}) as simulation:
        simulation.run(0.1, 0.01)
