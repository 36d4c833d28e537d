"""The public names of shaper_fmu.shapers, each with the module that defines it."""

from shaper_fmu.shapers.method import ShaperMethod as ShaperMethod
