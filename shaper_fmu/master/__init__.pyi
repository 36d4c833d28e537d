"""The public names of shaper_fmu.master, each with the module that defines it."""

from shaper_fmu.master.alone import simulate_fmu as simulate_fmu
from shaper_fmu.master.batch import Batch as Batch
from shaper_fmu.master.batch import Plan as Plan
from shaper_fmu.master.comparison import Comparison as Comparison
from shaper_fmu.master.comparison import compare as compare
from shaper_fmu.master.fmu import Fmu as Fmu
from shaper_fmu.master.fmu import load_fmu as load_fmu
from shaper_fmu.master.results import Results as Results
from shaper_fmu.master.simulation import Simulation as Simulation
