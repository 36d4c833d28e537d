"""Couples FMUs: the system, its stepping loop and its results."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
