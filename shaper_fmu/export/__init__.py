"""Builds FMUs from components."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
