"""Native FMUs whose inputs of every type change from step to step, in masters that are not ours; and steps of any length."""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_host import native_fmu
from other_masters import INSTANCE, Job, run_jobs
from test_native_interoperability import PACKAGES, pytestmark, require

from shaper_fmu.component import Component, Input, Output, Parameter
from shaper_fmu.export.native.backend import build_native_fmu

__all__ = ["pytestmark"]
MASTERS = [
    ("fmpy", 2, False),
    ("fmpy", 3, False),
    ("fmpy", 3, True),
    ("libcosim", 2, False),
    ("ecos", 2, False),
    ("ecos", 3, False),
]


class GatedSum(Component):
    """Adds up a flow that a gate lets through, by gears."""

    flow = Input("", "what flows")
    gear = Input("", "factor of the flow", start=1, kind=int)
    gate = Input("", "whether it flows", start=False, kind=bool)
    first = Parameter(0, "", "what the count begins with")
    inverted = Parameter(False, "", "whether the gate is open when false")
    total = Output("", "sum of flow, gear and time")
    count = Output("", "steps with the gate open", kind=int)
    flowing = Output("", "whether it flowed over the last step", kind=bool)

    def start(self) -> None:
        self.count = self.first

    def step(self, t: float, h: float) -> None:
        self.flowing = h > 0.0 and self.gate != self.inverted
        if self.flowing:
            self.total += h * self.flow * self.gear
            self.count += 1


FLOW, GEAR, GATE = [0.5, -1.25, 3.0, 3.0, 0.75], [1, 1, -3, 2, 2], [False, True, True, True, False]


@pytest.mark.parametrize(("master", "fmi", "events"), MASTERS)
def test_inputs_of_every_type_change_at_each_step(master, fmi, events, tmp_path):
    """What the gate lets through adds up as written here by hand; a value that were late, early or lost would show."""
    if master in PACKAGES:
        require(master)
    path = build_native_fmu(GatedSum, tmp_path, fmi, ("x86_64-linux",))
    record = [(INSTANCE, "total", "real"), (INSTANCE, "count", "integer"), (INSTANCE, "flowing", "boolean")]
    drive = {"flow": FLOW, "gear": GEAR, "gate": GATE}
    job = Job(str(path), 0.25, 5, record, drive, {"first": 40, "inverted": True}, events=events)
    run = run_jobs(master, {"sum": job}, tmp_path)["sum"]
    assert run.times == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25]
    passed = [0.25 * 0.5, 0.0, 0.0, 0.0, 0.25 * 0.75 * 2]  # inverted: the first and the last step
    assert run.rows == [[sum(passed[: i + 1]), 40 + 1 + (i == 4), not GATE[i]] for i in range(5)]


ENDS = [0.05, 0.0731, 0.3, 0.30001, 0.4, 1.0]


@pytest.mark.parametrize("fmi", [2, 3])
def test_steps_of_any_length(fmi, tmp_path):
    """The closed form of the step response: F/k (1 - e^(-z w t) (cos w' t + z w / w' sin w' t))."""
    job = Job(str(native_fmu("MassSpringDamper", fmi)), 0.0, 0, [(INSTANCE, "position", "real")], {"force": 2.0}, ends=ENDS)
    run = run_jobs("fmpy", {"step": job}, tmp_path)["step"]
    decay, t = 0.5, np.array(ENDS)  # of 1 kg, 100 N/m and 1 N s/m
    damped = math.sqrt(100.0 - decay**2)
    expected = 2.0 / 100.0 * (1.0 - np.exp(-decay * t) * (np.cos(damped * t) + decay / damped * np.sin(damped * t)))
    assert run.times == [0.0, *ENDS]
    assert np.abs(np.array(run.rows)[:, 0] - expected).max() <= 1e-12 * expected.max()


def test_early_returns_stand_at_the_events(tmp_path):
    """Each change of the command comes back half a period later, pi / w with ZV and no damping: amplitudes of 1/2."""
    drive = {"command": [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]}
    job = Job(str(native_fmu("InputShaper", 3)), 0.0, 0, [(INSTANCE, "shaped", "real")], drive, ends=ENDS, events=True)
    run = run_jobs("fmpy", {"shaper": job}, tmp_path)["shaper"]
    delay = math.pi / 10.0
    assert run.events == pytest.approx([delay, 0.3 + delay], abs=1e-14)
    assert [row[0] for row in run.rows] == pytest.approx([0.5, 0.5, 0.5, -0.5, 0.0, -1.0], abs=1e-14)
