"""Design of unity-magnitude on/off commands, one method a file; kernel functions over an array `switch_time` [s].

The command is 0 before the first switch, 1 after it, 0 after the second, and so on; it is 1 after the last.
"""

from shaper_fmu.public_names import lazily

__getattr__, __dir__, __all__ = lazily(__name__)
