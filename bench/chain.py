"""The system of the benchmarks of masters: profile -> shaper -> plant, of native FMUs, for 10 s in steps of 1 ms.

All run the same SSP archive (ssp/SystemStructure.ssd), with the start values of the FMUs: a cycloidal move of 1 m in
1 s, a ZV shaper, a lightly damped plant. Ours uses the others' convention: an input is what its source gave at the end of
the step before (`algorithm="parallel"`), and no step ends at an event (`exact=False`).
"""

from __future__ import annotations

import time
from pathlib import Path
from statistics import median

from harness import Measured

from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.results import Results
from shaper_fmu.master.simulation import Simulation
from shaper_fmu.ssp.archive import load_ssp, pack_ssp

STEPS, STEP = 10_000, 0.001
FILES = {"profile": "MotionProfile", "shaper": "InputShaper", "plant": "MassSpringDamper"}
RESULT = "plant.position"


def chain_archive(folder: Path) -> Path:
    """The archive, made in `folder` unless it is there, with native FMUs of FMI 2.0 for this machine."""
    archive = folder / "chain.ssp"
    if not archive.is_file():
        fmus = folder / "chain_fmus"
        fmus.mkdir()
        for file in FILES.values():
            (fmus / f"{file}.fmu").write_bytes(fmu_path(file, fmi=2, platforms=["this"]).read_bytes())
        pack_ssp(Path(__file__).with_name("ssp"), fmus, archive)
    return archive


class Ours:
    """The compiled master with one simulation that is run again and again. Use it in a with statement.

    It has one thread, whose own time on the processor is taken: a pass is about as long as a slice of the scheduler.
    """

    def __init__(self, archive: Path):
        self.simulation = Simulation(load_ssp(archive).system, record=[RESULT])
        self.run(1)

    def __enter__(self) -> Ours:
        return self

    def __exit__(self, *error: object) -> None:
        self.simulation.close()

    def run(self, steps: int) -> Results:
        """A run with the others' convention."""
        return self.simulation.run(steps * STEP, STEP, algorithm="parallel", exact=False)

    def stepping(self) -> Measured:
        """A step: what a run takes more than one of a single step, without reset and initialization."""
        fixed = median(self.per_run().microseconds for _ in range(3))
        begin = time.thread_time()
        results = self.run(STEPS)
        taken = (time.thread_time() - begin) * 1e6
        return Measured((taken - fixed) / (STEPS - 1), tuple(results[RESULT][1:].tolist()))

    def per_run(self) -> Measured:
        """What a run takes whatever its length: reset, initialization, and its results; with a single step."""
        begin = time.thread_time()
        results = self.run(1)
        return Measured((time.thread_time() - begin) * 1e6, (float(results[RESULT][-1]),))
