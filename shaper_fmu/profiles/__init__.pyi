"""The public names of shaper_fmu.profiles, each with the module that defines it."""

from shaper_fmu.profiles.method import ProfileMethod as ProfileMethod
