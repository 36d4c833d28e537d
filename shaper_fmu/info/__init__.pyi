"""The public names of shaper_fmu.info, each with the module that defines it."""

from shaper_fmu.info.facts import FmuInfo as FmuInfo
from shaper_fmu.info.facts import SspInfo as SspInfo
from shaper_fmu.info.facts import VariableInfo as VariableInfo
from shaper_fmu.info.fmu import fmu_info as fmu_info
from shaper_fmu.info.system import ssp_info as ssp_info
