"""Rest-to-rest profiles of unit distance, one a file; kernel functions of the time since the start."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
