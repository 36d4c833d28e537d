"""An FMU by pythonfmu itself, as somebody else would write it: its step at t = 0.5 s waits until a file is there, and tells so."""

from __future__ import annotations

import zipfile
from pathlib import Path

from pythonfmu.builder import FmuBuilder

SCRIPT = '''\
import os
import time

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Waiting(Fmi2Slave):
    """Adds up the time; without $WAITING_MARK it never waits."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.gain, self.sum, self.swallows, self.waits = 1.0, 0.0, False, True
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Real("gain", causality=Fmi2Causality.input))
        self.register_variable(Boolean("swallows", **fixed))
        self.register_variable(Real("sum", causality=Fmi2Causality.output))

    def do_step(self, t, dt):
        mark = os.environ.get("WAITING_MARK")
        if mark is not None and self.waits and t > 0.45:
            open(mark, "w").close()
            try:
                while os.path.exists(mark):
                    time.sleep(0.01)
            except KeyboardInterrupt:
                os.remove(mark)
                self.waits = False  # the master hears it some steps later
                if not self.swallows:
                    raise
        self.sum += self.gain * dt
        return True
'''
SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="waiting" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription">
  <ssd:System name="waiting"><ssd:Elements><ssd:Component name="x" source="resources/Waiting.fmu"/></ssd:Elements></ssd:System>
</ssd:SystemStructureDescription>
"""
STUDY = """
name = "waiting"
system = "waiting.ssp"
stop_time = 1.0
step = 0.1
[vary."x.gain"]
low = 1.0
high = 5.0
points = 5
[compare]
honest = {{ "x.swallows" = {swallows} }}
[metrics.last]
kind = "final"
output = "x.sum"
"""


def waiting_files(folder: Path) -> Path:
    """Write the FMU, waiting.ssp, and the studies True.toml and False.toml: whether the FMU swallows Ctrl-C."""
    (folder / "waiting.py").write_text(SCRIPT)
    FmuBuilder.build_FMU(folder / "waiting.py", dest=folder)
    with zipfile.ZipFile(folder / "waiting.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", SYSTEM)
        archive.write(folder / "Waiting.fmu", "resources/Waiting.fmu")
    for swallows in (True, False):
        (folder / f"{swallows}.toml").write_text(STUDY.format(swallows=str(swallows).lower()))
    return folder
