"""Shapers without jumps, one method a file: kernel functions for distributed delays, ramps and smoothers."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
