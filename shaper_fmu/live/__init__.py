"""A page on which shaping is tried: the components' kernels as WebAssembly, designed and simulated while a slider moves."""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
