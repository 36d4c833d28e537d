"""The public names of shaper_fmu.export, each with the module that defines it."""

from shaper_fmu.export.build import Backend as Backend
from shaper_fmu.export.build import build_fmu as build_fmu
from shaper_fmu.export.build import fmu_path as fmu_path
