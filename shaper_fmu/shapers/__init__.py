"""Design of impulse sequences, one method a file; kernel functions over arrays `amplitude` [-] and `delay` [s]."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
