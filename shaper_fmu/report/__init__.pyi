"""The public names of shaper_fmu.report, each with the module that defines it."""

from shaper_fmu.report.sweep.data import SweepData as SweepData
from shaper_fmu.report.sweep.report import read_store as read_store
from shaper_fmu.report.sweep.report import sweep_blocks as sweep_blocks
from shaper_fmu.report.sweep.report import write_sweep_report as write_sweep_report
from shaper_fmu.report.tune.inputs import write_inputs as write_inputs
from shaper_fmu.report.tune.outputs import write_tuning as write_tuning
