"""FMUs of model exchange that are solved as one: loops without delay that are far from linear, and values that cannot be read."""

from __future__ import annotations

import math

import numpy as np
import pytest
from array_fmus import arrays_fmu
from equation_fmus import MODELS, equations_fmu
from scipy.integrate import solve_ivp
from scipy.optimize import root_scalar

from shaper_fmu.master.system import System


@pytest.mark.parametrize("versions", [(2, 3), (2, 2), (3, 3)])
def test_a_loop_is_closed_from_afar(versions):
    """ua = xb - ub^3 and ub = xa - ua^3 from ua = 0, where Newton's steps lead away; then x' = u - x by scipy."""
    system = System()
    for name, version, start in zip("ab", versions, (1.0, 2.0), strict=True):
        system.add(name, equations_fmu(version), {"model": float(MODELS["cubic"]), "p": start})
    system.connect("a.y", "b.u")
    system.connect("b.y", "a.u")
    results = system.simulate(1.0, 0.1, solver_tolerance=1e-10, record=["a.x1", "b.x1"])

    def rates(t: float, x: tuple[float, float]) -> list[float]:
        ua = root_scalar(lambda u: u - x[1] + (x[0] - u**3) ** 3, bracket=(-2.0, 0.0), xtol=1e-15).root
        return [ua - x[0], x[0] - ua**3 - x[1]]

    found = solve_ivp(rates, (0.0, 1.0), [1.0, 2.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert [results["a.x1"][-1], results["b.x1"][-1]] == pytest.approx(found, abs=1e-8)


@pytest.mark.parametrize("version", [2, 3])
def test_a_step_to_where_values_between_fmus_cannot_be_read_is_tried_shorter(version):
    """x' = 50 (1 - x) comes near 1, and a coarse step beyond 1.002; z' = x - z: z = 1 - (50 exp(-t) - exp(-50 t)) / 49."""
    system = System()
    system.add("a", equations_fmu(version), {"model": float(MODELS["unreadable"]), "p": 50.0, "q": 1.002})
    system.add("b", equations_fmu(version), {"model": float(MODELS["decay"])})
    system.drive("a.u", [(0.0, 1.0)])
    system.connect("a.y", "b.u")
    results = system.simulate(1.0, 0.5, solver="adams", solver_tolerance=1e-2)
    assert results["b.y"][-1] == pytest.approx(1.0 - (50.0 * math.exp(-1.0) - math.exp(-50.0)) / 49.0, abs=0.02)


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, 1e-9, 1e-10, 1e-11])
@pytest.mark.parametrize("solver", ["adams", "bdf"])
@pytest.mark.parametrize("step", [0.01, 0.25])
def test_a_loop_of_partly_connected_arrays_is_solved_as_precisely_as_asked(tolerance, solver, step):
    """Of a: u = (1, -0.3 y2, 0.2 y1) of b's y; of b: u = (0, 0.5 y1, 0.7) of a's: by scipy.

    The states are 0 at first. In the first, very short steps they differ by less than what the loop is closed to.
    """
    system = System()
    for name in "ab":
        system.add(name, arrays_fmu())
    system.drive("a.u[1]", [(0.0, 1.0)])
    for source, target, gain in (("a.y[1]", "b.u[2]", 0.5), ("b.y[2]", "a.u[2]", -0.3), ("b.y[1]", "a.u[3]", 0.2)):
        system.connect_raw(source, target, gain=gain)
    names = ["a.x[1]", "a.x[2]", "b.x[1]", "b.x[2]"]
    results = system.simulate(1.0, step, solver=solver, solver_tolerance=tolerance, record=names)

    def rates(t: float, x: tuple[float, ...]) -> list[float]:
        ua3 = 0.2 * (x[2] + 0.1 * 0.7)
        ua2, ub2 = -0.3 * x[3], 0.5 * (x[0] + 0.1 * ua3)
        return [1.0 + 2.0 * ua2 + 0.5 * ua3 - x[0], ua2 - 2.0 * x[1], 2.0 * ub2 + 0.5 * 0.7 - x[2], ub2 - 2.0 * x[3]]

    exact = solve_ivp(rates, (0.0, 1.0), [0.0] * 4, rtol=1e-12, atol=1e-14, method="DOP853", t_eval=results.time).y
    for name, values in zip(names, exact, strict=True):
        assert np.abs(results[name] - values).max() <= 100.0 * tolerance, name
