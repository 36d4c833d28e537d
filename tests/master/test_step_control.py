"""Control of the step size: the tolerance is met on a closed loop, events stay exact, and FMUs that cannot go back are named."""

from __future__ import annotations

import itertools
import math
import zipfile

import numpy as np
import pytest
from linear_fmus import linear_fmu
from scipy.linalg import expm

from shaper_fmu.archives import read_archive, write_archive
from shaper_fmu.errors import ModelError
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System

STIFFNESS, DAMPING, KP, KD = 100.0, 0.4, 300.0, 12.0


def closed_loop(versions: tuple[int, int]) -> System:
    """A PD controller and an oscillator, with a reference that steps at t = 0.25 s."""
    controller, plant = (
        fmu_path(n, v, platforms=["this"]) for n, v in zip(("PositionController", "MassSpringDamper"), versions, strict=True)
    )
    system = System("loop")
    system.add("controller", controller, proportional_gain=KP, derivative_gain=KD)
    system.add("plant", plant, stiffness=STIFFNESS, damping=DAMPING)
    system.drive("controller.reference", ([0.0, 0.25], [0.0, 1.0]))
    system.connect("controller.force", "plant.force")
    system.connect("plant.position", "controller.position")
    system.connect("plant.velocity", "controller.velocity")
    return system


def monolithic(t: float) -> float:
    """x'' = -(k + Kp) x - (c + Kd) x' + Kp from rest, by the matrix exponential."""
    a = np.array([[0.0, 1.0, 0.0], [-(STIFFNESS + KP), -(DAMPING + KD), KP], [0.0, 0.0, 0.0]])
    return float((expm(a * (t - 0.25)) @ [0.0, 0.0, 1.0])[0])


@pytest.mark.parametrize("versions", [(2, 2), (3, 2), (3, 3)])
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss_seidel"])
def test_the_error_follows_the_tolerance(versions, algorithm):
    """First order: the local error of a step is of order 2, so the global one falls like the root of the tolerance."""
    errors = []
    for tolerance in (1e-3, 1e-4, 1e-5):
        results = closed_loop(versions).simulate(1.5, 0.1, tolerance=tolerance, algorithm=algorithm, record=["plant.position"])
        assert len(results.time) == 16  # the grid's points, however the steps are divided
        late = [i for i, t in enumerate(results.time) if t > 0.3]
        errors.append(max(abs(results["plant.position"][i] - monolithic(results.time[i])) for i in late))
    assert errors[0] < 0.1
    assert errors[2] < 1e-2
    for coarse, fine in itertools.pairwise(errors):
        assert 2.0 < coarse / fine < 5.0  # sqrt(10), if the steps followed the root exactly


@pytest.mark.parametrize("version", [2, 3])
def test_fmus_are_told_that_they_may_be_set_back(version):
    """This FMU refuses a state of a time before which nothing was to be set any more; a PD controller on its two modes."""
    system = System()
    system.add("plant", linear_fmu(version))
    system.add("controller", fmu_path("PositionController", platforms=["this"]), proportional_gain=2.0, velocity=0.0)
    system.drive("controller.reference", 1.0)
    system.connect("controller.force", "plant.u")
    system.connect("plant.y", "controller.position")
    assert len(system.simulate(1.0, 0.05, tolerance=1e-5).time) == 21


def test_without_coupling_error_steps_stay_whole_and_events_exact():
    """A ZV-shaped step: nothing to control, so the result is that of exact events, to the bit of rounding."""
    system = System()
    system.add("shaper", fmu_path("InputShaper", platforms=["this"]), shaper="zv", natural_frequency=[7.3])
    system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), stiffness=7.3**2, damping=0.0)
    system.drive("shaper.command", ([0.0, 0.123], [0.0, 7.3**2]))
    system.connect("shaper.shaped", "plant.force")
    results = system.simulate(1.0, 0.05, tolerance=1e-6)
    assert math.hypot(results["plant.position"][-1] - 1.0, results["plant.velocity"][-1] / 7.3) < 1e-12


def test_fmus_that_cannot_go_back_are_named(tmp_path):
    path = fmu_path("MassSpringDamper", platforms=["this"])
    files = read_archive(path.read_bytes(), path.name)
    assert b"canGetAndSetFMUstate" in files["modelDescription.xml"]
    files["modelDescription.xml"] = files["modelDescription.xml"].replace(
        b'canGetAndSetFMUstate="true"', b'canGetAndSetFMUstate="false"'
    )
    files["modelDescription.xml"] = files["modelDescription.xml"].replace(
        b'canSerializeFMUstate="true"', b'canSerializeFMUstate="false"'
    )
    rigid = write_archive(tmp_path / "Rigid.fmu", files)
    assert zipfile.is_zipfile(rigid)
    system = System()
    system.add("plant", rigid, force=1.0)
    with pytest.raises(ModelError, match="needs FMUs that save their states; plant cannot"):
        system.simulate(1.0, 0.1, tolerance=1e-4)
    with pytest.raises(ModelError, match=r"tolerance = -1\.0 must be a positive number"):
        system.simulate(1.0, 0.1, tolerance=-1.0)
