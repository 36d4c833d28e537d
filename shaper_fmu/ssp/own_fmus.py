"""FMUs that a system's folder describes itself, in a file fmus.toml: components with other start values.

    [MotionProfile_s_curve]
    component = "MotionProfile"
    start = { profile = "s_curve" }

is the FMU resources/MotionProfile_s_curve.fmu of its archive.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import msgspec

from shaper_fmu.component import Component
from shaper_fmu.errors import BuildError, ComponentError
from shaper_fmu.export.start_values import with_start_values
from shaper_fmu.registry import find_component

FILE = "fmus.toml"


class _Own(msgspec.Struct, forbid_unknown_fields=True):
    component: str
    start: dict[str, float | int | bool | str | list[float]]


def own_fmus(folder: Path) -> dict[str, type[Component]]:
    """The components of a folder's fmus.toml, by the file names of their FMUs. Raises BuildError if it is wrong."""
    path = folder / FILE
    if not path.is_file():
        return {}
    try:
        read = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), dict[str, _Own])
        return {f"{name}.fmu": with_start_values(find_component(own.component), own.start, name) for name, own in read.items()}
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, ComponentError, UnicodeDecodeError) as error:
        raise BuildError(f"{path}: {error}") from None
