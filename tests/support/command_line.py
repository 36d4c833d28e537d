"""The command line: in this process, for Python need not start again for each command, or as a process of its own."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from shaper_fmu.cli.main import main
from shaper_fmu.export.native.toolchain import platform_named

MAIN = [sys.executable, "-c", "from shaper_fmu.cli.main import main; main()"]
FOR_THIS_PLATFORM = "shaper_fmu.export.build.USUAL_PLATFORMS", (platform_named("this").name,)
"""What to set where FMUs are built by default, but not needed for other machines."""
Done = subprocess.CompletedProcess[str]


def typed(*arguments: str | Path, cwd: Path) -> Done:
    """What the command does, prints and exits with, in this process.

    FMUs that it builds for the usual platforms are built for this machine alone: `in_a_process` builds them for all, which takes long.
    """
    out, err, words = io.StringIO(), io.StringIO(), ["shaper-fmu", *map(str, arguments)]
    code: object = 0
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.chdir(cwd)
        patch.setattr(sys, "argv", words)
        patch.setattr(*FOR_THIS_PLATFORM)
        try:
            main()
        except SystemExit as end:
            code = end.code
    return Done(words, code if isinstance(code, int) else int(code is not None), out.getvalue(), err.getvalue())


def in_a_process(*arguments: str | Path, cwd: Path) -> Done:
    """The same as a user types it: with pipes, an exit code, and what has to be imported."""
    return subprocess.run([*MAIN, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=900)
