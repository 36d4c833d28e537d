"""`shaper-fmu tune` from the FMU of a plant with two damped modes to the report, as a user types it."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import mkdtemp

from harness import Row

from shaper_fmu.export.build import fmu_path

ALLOWED = 30.0
"""Seconds."""
_TURNS = 3


def tune_two_modes(folder: Path) -> Row:
    """The three masses between a force and the third position: a rigid body and two modes, over +-10 % of a mass."""
    plant = fmu_path("ThreeMassChain")
    options = ["--input", "force", "--output", "position[3]", "--vary", "mass[3]=10%"]
    words = [sys.executable, "-c", "from shaper_fmu.cli.main import main; main()", "tune", str(plant), *options]
    seconds = []
    for _ in range(_TURNS):
        begin = time.perf_counter()
        done = subprocess.run(words, capture_output=True, text=True, cwd=mkdtemp(dir=folder))
        seconds.append(time.perf_counter() - begin)
        if done.returncode:
            raise SystemExit(f"tune_two_modes: {done.stderr}")
    return Row("tune_two_modes", median(seconds) * 1e6, note=f"the whole command, once; {ALLOWED:g} s are allowed")
