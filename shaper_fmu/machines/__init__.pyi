"""The public names of shaper_fmu.machines, each with the module that defines it."""

from shaper_fmu.machines.names import MACHINES as MACHINES
from shaper_fmu.machines.settings import MachineSettings as MachineSettings
from shaper_fmu.machines.settings import machine_settings as machine_settings
