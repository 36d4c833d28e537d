"""Containers in masters that are not ours: the residual is the formula's, whatever they step, and systems move as in a run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from containers import FREQUENCY, MASS, STIFFNESS, container, shaped_oscillator
from other_masters import INSTANCE, Job, run_jobs
from test_native_interoperability import PACKAGES, pytestmark, require

__all__ = ["pytestmark"]
MASTERS = [
    ("fmpy", 2, False),
    ("fmpy", 3, False),
    ("fmpy", 3, True),
    ("libcosim", 2, False),
    ("ecos", 2, False),
    ("ecos", 3, False),
]
RESIDUALS = {"zv": 0.0, "zvd": 0.0, "ei": 0.05}
"""Of the undamped mode itself: Singer and Seering 1990; Singhose 1994, at V = 5 %."""


@pytest.mark.representatives(step=[0.05])
@pytest.mark.parametrize(("master", "fmi", "events"), MASTERS)
@pytest.mark.parametrize("step", [0.001, 0.007, 0.05])
def test_shapers_leave_what_the_formula_says(master, fmi, events, step, tmp_path):
    if master in PACKAGES:
        require(master)
    steps = math.ceil(1.0 / step)
    record = [(INSTANCE, "plant.position", "real"), (INSTANCE, "plant.velocity", "real")]
    jobs = {}
    for kind in RESIDUALS:
        path = container(shaped_oscillator(5 - fmi, kind), tmp_path / f"{kind}.fmu", fmi)
        jobs[kind] = Job(str(path), step, steps, record, {"shaper.command": [STIFFNESS] * steps}, {}, events=events)
    for kind, run in run_jobs(master, jobs, tmp_path).items():
        position, velocity = np.array(run.rows)[-1]
        away = math.hypot(position - MASS, velocity / FREQUENCY)  # STIFFNESS is the force of one metre
        assert away == pytest.approx(RESIDUALS[kind], abs=1e-10), kind
