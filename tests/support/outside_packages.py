"""Distributions of others in a folder, and Python processes that find them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path


def announced(folder: Path, points: dict[str, dict[str, str]], name: str = "theirs") -> None:
    """A distribution in this folder that has these entry points."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [f"[{group}]\n" + "\n".join(f"{key} = {value}" for key, value in one.items()) for group, one in points.items()]
    (info / "entry_points.txt").write_text("\n\n".join(lines) + "\n")


def python(folder: Path, code: str, *arguments: str | Path, flags: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    """What Python says to this code, with the folder among those where modules are looked for."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    words = [sys.executable, *flags, "-c", code, *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, env=environment, timeout=1800, cwd=folder)


COMMAND = "from shaper_fmu.cli.main import main; main()"
"""The program `shaper-fmu`, with the arguments that follow."""
