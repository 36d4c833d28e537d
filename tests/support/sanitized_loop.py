"""A plugin for pytest: the loop is the library that the environment names, compiled with sanitizers."""

from __future__ import annotations

import os
from pathlib import Path

from shaper_fmu.master import loop_library

loop_library._shipped = lambda: Path(os.environ["SHAPER_FMU_TEST_LOOP"])
