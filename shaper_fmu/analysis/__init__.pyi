"""The public names of shaper_fmu.analysis, each with the module that defines it."""

from shaper_fmu.analysis.vibration import damping_curve as damping_curve
from shaper_fmu.analysis.vibration import insensitivity as insensitivity
from shaper_fmu.analysis.vibration import relative_residual as relative_residual
from shaper_fmu.analysis.vibration import sensitivity_curve as sensitivity_curve
from shaper_fmu.analysis.vibration import tolerated_band as tolerated_band
