"""Computes residual vibration and other figures of merit from responses."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
