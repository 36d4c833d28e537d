"""The public names of shaper_fmu.live, each with the module that defines it."""

from shaper_fmu.live.page import write_live_page as write_live_page
from shaper_fmu.live.panel import tuning_panel as tuning_panel
