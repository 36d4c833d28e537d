"""The master against what a user would write with fmpy alone: set, doStep and get of each FMU, in Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from harness import Measured, Row, compared

from shaper_fmu import System
from shaper_fmu.master.fmu import load_fmu
from shaper_fmu.master.instance import Instance
from shaper_fmu.master.simulation import Simulation

STEPS, STEP = 2000, 0.001


def _timed(run: Callable[[], float]) -> Measured:
    begin = time.perf_counter()
    result = run()
    return Measured((time.perf_counter() - begin) / STEPS * 1e6, (result,))


def master_vs_fmpy_loop(fmus: Path) -> Row:
    """Profile -> shaper -> plant, Jacobi without order, all FMUs in `fmus` by pythonfmu: time per macro step."""
    starts = {"profile": {"profile": 3, "duration": 1.0}, "shaper": {"shaper": 2}, "plant": {}}
    files = {"profile": "MotionProfile", "shaper": "InputShaper", "plant": "MassSpringDamper"}
    system = System("chain")
    for name, file in files.items():
        system.add(name, fmus / f"{file}.fmu", starts[name])
    system.connect("profile.position", "shaper.command")
    system.connect("shaper.shaped", "plant.force")
    loaded = {name: load_fmu(fmus / f"{file}.fmu") for name, file in files.items()}
    reference = {(n, v.name): v.valueReference for n, fmu in loaded.items() for v in fmu.variables.values()}
    instances = {name: Instance(name, fmu) for name, fmu in loaded.items()}

    def peer() -> float:
        slaves = {name: instance.slave for name, instance in instances.items()}
        for name, instance in instances.items():
            slaves[name].reset()
            instance.set_values(starts[name])
            for call in ("setupExperiment", "enterInitializationMode", "exitInitializationMode"):
                instance.call(call)
        profile, shaper, plant = slaves.values()
        position, shaped, swing = [0.0], [0.0], [0.0]
        for i in range(STEPS):
            shaper.setReal([reference["shaper", "command"]], position)
            plant.setReal([reference["plant", "force"]], shaped)
            for slave in (profile, shaper, plant):
                slave.doStep(i * STEP, STEP)
            position = profile.getReal([reference["profile", "position"]])
            shaped = shaper.getReal([reference["shaper", "shaped"]])
            swing = plant.getReal([reference["plant", "position"]])
        return swing[0]

    with Simulation(system, record=["plant.position"]) as simulation:

        def ours() -> float:
            return simulation.run(STEPS * STEP, STEP, algorithm="parallel")["plant.position"][-1]

        row = compared("master_vs_fmpy_loop", lambda: (_timed(ours), _timed(peer)), tolerance=1e-12)
    for instance in instances.values():
        instance.close()
    return row
