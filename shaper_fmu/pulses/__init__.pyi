"""The public names of shaper_fmu.pulses, each with the module that defines it."""

from shaper_fmu.pulses.method import PulseMethod as PulseMethod
