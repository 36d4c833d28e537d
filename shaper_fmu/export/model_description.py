"""The model descriptions of a component: modelDescription.xml of FMI 2.0 and 3.0."""

from __future__ import annotations

from shaper_fmu.export.description_parts import summary
from shaper_fmu.export.fmi2_description import fmi2_model_description, fmi2_native_description
from shaper_fmu.export.fmi3_description import fmi3_native_description
from shaper_fmu.export.model_structure import dependencies, visible_variables

__all__ = [
    "dependencies",
    "fmi2_model_description",
    "fmi2_native_description",
    "fmi3_native_description",
    "summary",
    "visible_variables",
]
