"""The public names of shaper_fmu.sweep, each with the module that defines it."""

from shaper_fmu.sweep.engine import engine_for as engine_for
from shaper_fmu.sweep.engine import run_study as run_study
from shaper_fmu.sweep.engines import Engine as Engine
from shaper_fmu.sweep.in_python import sweep_system as sweep_system
from shaper_fmu.sweep.plan import Sampling as Sampling
from shaper_fmu.sweep.store import Store as Store
from shaper_fmu.sweep.study import Refine as Refine
from shaper_fmu.sweep.study import Study as Study
from shaper_fmu.sweep.study import read_study as read_study
from shaper_fmu.sweep.variation import Vary as Vary
