"""Drawings of systems: boxes, connectors with units, connections, as SVG."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
