"""The public names of shaper_fmu.drawing, each with the module that defines it."""

from shaper_fmu.drawing.diagram import Box as Box
from shaper_fmu.drawing.diagram import Diagram as Diagram
from shaper_fmu.drawing.diagram import Port as Port
from shaper_fmu.drawing.diagram import Wire as Wire
from shaper_fmu.drawing.svg import svg_of as svg_of
from shaper_fmu.drawing.svg import write_drawing as write_drawing
