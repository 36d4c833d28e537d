"""The settings of several axes of one machine, in files for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from shaper_fmu.archives import write_file
from shaper_fmu.machines.settings import FIRMWARE, MachineSettings


def write_axes(settings: Mapping[str, MachineSettings], folder: Path | str) -> list[Path]:
    """Write the settings of one machine for each axis, and return the paths.

    A firmware's are one file with the settings of all axes, under one section where it has such; others are in folders of the axes,
    if there are several. Raises ShaperFmuError if that fails.
    """
    if len(settings) == 1:
        return next(iter(settings.values())).write(folder)
    files: dict[str, str] = {}
    for axis, one in settings.items():
        for name, text in one.files.items():
            if one.machine not in FIRMWARE:
                files[f"{axis}/{name}"] = text
            elif name not in files:
                files[name] = text
            else:
                files[name] += "\n" + "\n".join(line for line in text.splitlines() if line not in _sections(files[name])) + "\n"
    written = []
    for name, text in files.items():
        path = Path(folder) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        written.append(write_file(path, text.encode()))
    return written


def _sections(text: str) -> list[str]:
    """The lines that begin a section, such as [input_shaper]."""
    return [line for line in text.splitlines() if line.startswith("[") and line.endswith("]")]
