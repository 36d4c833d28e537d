"""Metrics: figures of merit that are computed while a system is stepped, so that no trajectory has to be kept.

Each is a file of its own: formula, what it needs, unit, keys in study.toml. `metric` is their base and shows how one is written,
`known` finds them; docs/extending.md shows one from another package.
"""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
