"""Carries a tuned shaper to a machine: settings of firmware that shapes commands itself, C, structured text, and numbers."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
