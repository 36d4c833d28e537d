"""The public names of shaper_fmu.smoothers, each with the module that defines it."""

from shaper_fmu.smoothers.method import SmootherMethod as SmootherMethod
from shaper_fmu.smoothers.terms import put_box as put_box
from shaper_fmu.smoothers.terms import put_impulse as put_impulse
