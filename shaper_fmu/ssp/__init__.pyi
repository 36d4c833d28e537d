"""The public names of shaper_fmu.ssp, each with the module that defines it."""

from shaper_fmu.ssp.archive import load_ssp as load_ssp
from shaper_fmu.ssp.check import check_ssp as check_ssp
from shaper_fmu.ssp.loaded import SspSystem as SspSystem
from shaper_fmu.ssp.parameter_sets import apply_parameter_set as apply_parameter_set
from shaper_fmu.ssp.system import System as System
