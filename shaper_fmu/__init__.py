"""Command shaping for flexible machines: components as FMUs, a master to couple and sweep them, SSP systems.

The public names are imported when first used, so that `import shaper_fmu` is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from shaper_fmu.component import Calculated, Component, Input, Output, Parameter, State
    from shaper_fmu.errors import ShaperFmuError
    from shaper_fmu.export.pythonfmu_backend import build_fmu
    from shaper_fmu.master.results import Results
    from shaper_fmu.master.system import System
    from shaper_fmu.registry import components, find_component

__version__ = "0.1.0"

_HOME = {
    "Calculated": "component", "Component": "component", "Input": "component", "Output": "component",
    "Parameter": "component", "State": "component", "ShaperFmuError": "errors", "build_fmu": "export.pythonfmu_backend",
    "Results": "master.results", "System": "master.system", "components": "registry", "find_component": "registry",
}  # fmt: skip

__all__ = [
    "Calculated", "Component", "Input", "Output", "Parameter", "Results", "ShaperFmuError", "State", "System",
    "build_fmu", "components", "find_component",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'shaper_fmu' has no attribute {name!r}")
    return getattr(importlib.import_module(f"shaper_fmu.{_HOME[name]}"), name)
