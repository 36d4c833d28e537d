"""Command shaping for flexible machines: components as FMUs, a master to couple and sweep them, SSP systems.

`__init__.pyi` lists the public names; each is imported when it is first used, so that `import shaper_fmu` is quick.
"""

from __future__ import annotations

from shaper_fmu.public_names import lazily
from shaper_fmu.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazily(__name__)
