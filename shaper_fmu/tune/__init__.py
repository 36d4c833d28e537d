"""Tunes shapers for plants: identifies modes by experiments on FMUs or from measured responses, and chooses a shaper."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
