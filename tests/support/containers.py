"""Containers for tests, built for this machine alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shaper_fmu.container.build import pack
from shaper_fmu.container.interface import outer_variables
from shaper_fmu.export.build import fmu_path
from shaper_fmu.master.system import System

MASS, STIFFNESS, FREQUENCY = 1.0, 100.0, 10.0  # [kg], [N/m], [rad/s]: sqrt(STIFFNESS / MASS)


def container(system: System, path: Path, fmi: int = 2, expose: tuple[str, ...] = (), **options: Any) -> Path:
    """A container of the system that shows its free inputs, its outputs, and what is exposed."""
    return pack(system, outer_variables(system, fmi, expose=expose), path, fmi=fmi, platforms=("this",), **options).path


def shaped_oscillator(inner: int = 2, shaper: str = "zvd", **values: Any) -> System:
    """A shaper before a mass on a spring without damping, of this version of FMI: the shaper's command is free."""
    system = System("shaped")
    system.add("shaper", fmu_path("InputShaper", inner, platforms=["this"]), shaper=shaper, natural_frequency=[FREQUENCY], **values)
    system.add("plant", fmu_path("MassSpringDamper", inner, platforms=["this"]), mass=MASS, stiffness=STIFFNESS, damping=0.0)
    system.connect("shaper.shaped", "plant.force")
    return system
