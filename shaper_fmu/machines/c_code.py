"""The shaper as C: the InputShaper of `shaper-fmu build --c`, with the tuned shaper as its start values."""

from __future__ import annotations

from importlib import resources

from shaper_fmu.export.plain_c import plain_c
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.registry import find_component
from shaper_fmu.tune.choice.search import Candidate

NAME = "TunedShaper"


def c_files(candidate: Candidate, head: list[str]) -> dict[str, str]:
    """A header, a source file, an example and kernel.h, by name."""
    component = with_start_values(find_component("InputShaper"), candidate.start_values(), NAME)
    texts = plain_c(component)
    about = "/* " + "\n   ".join(line.replace("/*", "/ *").replace("*/", "* /") for line in head) + " */\n\n"
    kernel = resources.files("shaper_fmu.export.native").joinpath("kernel.h").read_text(encoding="utf-8")
    return {**{name: about + text for name, text in texts.items()}, "kernel.h": kernel}
