"""Designs commands in Python: sequences and motions as objects, optimal shapers, mode selection and proven bounds."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
