"""Pages and pictures: blocks of text, tables and figures, as HTML, SVG and PNG."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
