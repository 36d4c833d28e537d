"""The first run after an installation: a whole process, as a user's script, with empty caches against filled ones.

The loop is that of a wheel, put into a folder of its own. In a source checkout the first process compiles it besides, once.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from harness import Measured, Row, compared

from shaper_fmu.export.build import fmu_path
from shaper_fmu.export.native.toolchain import platform_named
from shaper_fmu.master import loop_library

SCRIPT = """
import sys
from pathlib import Path
from shaper_fmu.master import loop_library
loop_library._LIBRARIES = Path(sys.argv[1])
from shaper_fmu import System
system = System("first")
system.add("plant", sys.argv[2], force=1.0)
print(system.simulate(1.0, 0.1)["plant.position"][-1])
"""


def first_run(folder: Path) -> Row:
    """Seconds of processor time of the whole process, loading included."""
    plant = str(fmu_path("MassSpringDamper", platforms=["this"]))
    shipped, cache = folder / "first_run", folder / "first_run_cache"
    loop_library.ship(shipped, [platform_named("this")])  # a wheel has those of other platforms, too

    def passed() -> Measured:
        before = os.times()
        command = [sys.executable, "-c", SCRIPT, str(shipped), plant]
        environment = {**os.environ, "SHAPER_FMU_CACHE": str(cache)}
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        after = os.times()
        seconds = after.children_user + after.children_system - before.children_user - before.children_system
        return Measured(seconds * 1e6, (float(done.stdout),))

    def turns() -> list[Measured]:
        shutil.rmtree(cache, ignore_errors=True)
        return [passed(), passed()]

    return compared("first_run", turns, tolerance=0.0, needed=1 / 1.2)
