"""A shaper before a plant in a container, against the same two on the master's loop: the time for an inner step."""

from __future__ import annotations

import time
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from harness import Measured, Row, compared

from shaper_fmu import System
from shaper_fmu.container.build import pack
from shaper_fmu.container.interface import outer_variables
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.simulation import Simulation

STEP, HOST, STOP = 0.001, 1.0, 50.0  # [s]
NEEDED = 1.0 / 1.5
"""The container may take 1.5 times as long."""


def container_vs_loop(folder: Path) -> Row:
    """Inner steps of 1 ms for a host that steps by 1 s, so that the host's own calls do not count."""
    system = System("shaped")
    system.add("shaper", fmu_path("InputShaper", platforms=["this"]), shaper="zvd", natural_frequency=[10.0])
    system.add("plant", fmu_path("MassSpringDamper", platforms=["this"]), mass=1.0, stiffness=100.0, damping=0.0)
    system.connect("shaper.shaped", "plant.force")
    path = pack(system, outer_variables(system, 2), folder / "shaped.fmu", step=STEP, platforms=["this"]).path
    slave = _instance(path)
    variables = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
    system.drive("shaper.command", 1.0)

    def ours() -> Measured:
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.setReal([variables["shaper.command"]], [1.0])
        slave.exitInitializationMode()
        begin = time.thread_time()
        for i in range(round(STOP / HOST)):
            slave.doStep(i * HOST, HOST)
        taken = time.thread_time() - begin
        return Measured(taken / (STOP / STEP) * 1e6, (slave.getReal([variables["plant.position"]])[0],))

    with Simulation(system, record=["plant.position"]) as simulation:

        def theirs() -> Measured:
            results = simulation.run(STOP, STEP)
            return Measured(results.stepping_time / (STOP / STEP) * 1e6, (float(results["plant.position"][-1]),))

        return compared("container_vs_loop", lambda: (ours(), theirs()), 1e-12, NEEDED)


def _instance(path: Path) -> FMU2Slave:
    description = fmpy.read_model_description(str(path))
    assert description.coSimulation is not None
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=fmpy.extract(str(path)), instanceName="c",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    slave.instantiate()
    return slave
