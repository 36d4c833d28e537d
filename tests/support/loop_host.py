"""The loop's C sources compiled for tests, and systems made by hand."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from shaper_fmu.export.native.toolchain import PLATFORMS
from shaper_fmu.master import layout as of
from shaper_fmu.master.loop_library import write_unit

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-pedantic", "-Werror", "-ffp-contract=off"]


def compile_loop(folder: Path, *arguments: str, compiler: str = "gcc", source: Path | None = None) -> None:
    """Compile the loop, or another file that includes its headers, with these arguments; `compiler`: gcc, or a platform of ziglang.

    Skips where gcc is missing, but not in CI.
    """
    folder.mkdir(parents=True, exist_ok=True)
    unit, includes = write_unit(folder)
    command = (
        [sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[compiler].target] if compiler in PLATFORMS else [compiler]
    )
    if compiler == "gcc" and not shutil.which("gcc"):
        assert not os.environ.get("CI"), "gcc is not installed"
        pytest.skip("gcc is not installed")
    libraries = ["-lm"] if "-o" in arguments and "-c" not in arguments else []
    headers = [f"-I{include}" for include in includes]
    plain = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
    done = subprocess.run(
        [*command, *arguments, *headers, str(source or unit), *libraries], capture_output=True, text=True, check=False, env=plain
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "", done.stderr


def layout_with(**arrays: np.ndarray) -> of.Layout:
    """A layout with these arrays, and nothing else."""
    kinds = {
        name: kind if isinstance(kind, np.dtype) else {"double": "f8", "int32_t": "i4", "uint32_t": "u4"}[kind]
        for name, kind in of.ELEMENTS.items()
    }
    return of.Layout(**{name: arrays.get(name, np.zeros(0, kind)) for name, kind in kinds.items()})
