"""The public names of shaper_fmu.page, each with the module that defines it."""

from shaper_fmu.page.blocks import Block as Block
from shaper_fmu.page.blocks import Heading as Heading
from shaper_fmu.page.blocks import write_report as write_report
from shaper_fmu.page.figures import Figure as Figure
from shaper_fmu.page.figures import Line as Line
from shaper_fmu.page.pictures import write_picture as write_picture
