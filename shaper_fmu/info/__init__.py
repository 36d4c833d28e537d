"""What FMUs, SSP archives and folders of systems are: their facts as plain data, read from their files alone."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
