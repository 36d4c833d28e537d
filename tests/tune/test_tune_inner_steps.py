"""A plant with a solver of a fixed step inside: its mode is the one that it computes, whatever the communication step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from inner_steps import inner_steps, pole_seen

from shaper_fmu.tune import tune_plant


@pytest.fixture(scope="module")
def plant(tmp_path_factory) -> Path:
    return inner_steps(tmp_path_factory.mktemp("inner"))


def test_the_mode_is_that_of_the_discretised_plant(plant):
    """Euler's method at 2 ms takes a quarter of the damping, which no communication step gives back: the poles are log(1 + h p) / h."""
    found = tune_plant(plant, "force", ["position"], start_values={"on_grid": 1.0}, spread={"mass": 0.05})
    assert found.verdict == "tuned"
    assert found.plant is not None
    (mode,) = found.plant.nominal.modes
    assert mode.pole == pytest.approx(pole_seen(), rel=1e-5)
    assert pole_seen().real == pytest.approx(pole_seen(step=1e-9).real * 0.76, rel=0.01)
    assert found.candidate is not None
    sequence = found.candidate.sequence
    ends = sequence.delays[-1] - np.array(sequence.delays)
    worst = max(abs(np.exp(pole_seen(mass) * ends) @ np.array(sequence.amplitudes)) for mass in np.linspace(0.95, 1.05, 41))
    assert worst <= 0.05
    assert found.verification is not None
    assert found.verification.worst.share == pytest.approx(worst, abs=0.01)  # impulses come at the solver's next step


@pytest.mark.thorough
def test_inner_steps_that_divide_the_communication_step(plant):
    """In equal parts of up to 2 ms: the step matters a little, which is told, and the verdict is by what the plant leaves."""
    found = tune_plant(plant, "force", ["position"], spread={"mass": 0.05})
    assert found.verdict == "tuned"
    assert found.plant is not None
    (mode,) = found.plant.nominal.modes
    assert mode.pole == pytest.approx(pole_seen(), rel=1e-3)
