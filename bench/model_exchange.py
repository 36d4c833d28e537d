"""A plant of model exchange behind a shaper, 10 s: our loop against fmpy's own, both with SUNDIALS' CVODE."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import fmpy
import numpy as np
from fmpy.simulation import simulate_fmu
from harness import Measured, Row, compared

from shaper_fmu import System, shaper
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.simulation import Simulation

STOP, STEP, BEGIN = 10.0, 0.01, 0.5
TOLERANCE = 1e-6
NEEDED = 10.0
INPUT, OUTPUT = "base_acceleration", "tip_deflection"
SHAPER = {"shaper": "zvd", "natural_frequency": [10.0], "damping_ratio": [0.05]}


def me_vs_fmpy(folder: Path) -> Row:
    """FlexibleBeam, 12 states, at the same tolerance; fmpy, which couples no FMUs here, is given the shaped command as a table."""
    del folder
    beam, plain = fmu_path("FlexibleBeam", fmi=2, platforms=["this"]), shaper("zvd", 10.0, 0.05)
    times = BEGIN + np.asarray(plain.delays)
    levels = np.concatenate([[0.0], np.cumsum(plain.amplitudes)])
    edges = zip(times, pairwise(levels), strict=True)
    rows = [(0.0, 0.0), *((t, level) for t, sides in edges for level in sides)]
    table = np.array(rows, dtype=[("time", float), (INPUT, float)])
    unpacked, description = fmpy.extract(str(beam)), fmpy.read_model_description(str(beam), validate=False)

    system = System()
    system.add("shaper", fmu_path("InputShaper", fmi=2, platforms=["this"]), SHAPER)
    system.add("plant", beam, interface="model_exchange")
    system.drive("shaper.command", [(0.0, 0.0), (BEGIN, 1.0)])
    system.connect_raw("shaper.shaped", f"plant.{INPUT}")

    def theirs(stop: float) -> tuple[float, float]:
        begin = time.process_time()
        found = simulate_fmu(
            unpacked, stop_time=stop, output_interval=STEP, input=table, output=[OUTPUT], fmi_type="ModelExchange",
            relative_tolerance=TOLERANCE, model_description=description, validate=False,
        )  # fmt: skip
        return time.process_time() - begin, float(found[OUTPUT][-1])

    with Simulation(system, record=[f"plant.{OUTPUT}"]) as simulation:

        def ours(stop: float) -> tuple[float, float]:
            begin = time.thread_time()
            results = simulation.run(stop, STEP, solver_tolerance=TOLERANCE)
            return time.thread_time() - begin, float(results[f"plant.{OUTPUT}"][-1])

        def measured(run: Callable[[float], tuple[float, float]]) -> Measured:
            (taken, end), (fixed, _) = run(STOP), run(STEP)
            return Measured((taken - fixed) / (STOP / STEP - 1.0) * 1e6, (end,))

        def turns() -> Sequence[Measured]:
            return measured(ours), measured(theirs)

        return compared("me_vs_fmpy", turns, 1e-5, NEEDED)
