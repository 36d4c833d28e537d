"""Repeats the studies of papers with the FMUs: one package per paper, each with `reproduce(update) -> Reproduction`.

A module builds its systems from the components' FMUs, runs them, and gives every claim of its paper a verdict. All numbers
come from these runs; formulas stand beside them only for comparison. `NAMES` are the names on the command line; the module
of a name has underscores for hyphens.
"""

from __future__ import annotations

import importlib

from shaper_fmu.progress import Update
from shaper_fmu.reproduce.claims import Reproduction

NAMES = ("pwm", "s-curve", "two-part", "partial-modes", "unknown-parameters")
"""In the order in which `all` runs them."""


def reproduce(name: str, update: Update) -> Reproduction:
    """Run what belongs to a name of `NAMES`; `update(done, total)` is called now and then."""
    module = importlib.import_module(f"shaper_fmu.reproduce.{name.replace('-', '_')}.paper")
    return module.reproduce(update)
