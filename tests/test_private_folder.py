"""Caches where nothing else can be written to: a folder of the user's own among the temporary files, and nobody else's."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from shaper_fmu.private_folder import private_folder

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="owners and rights are POSIX's")


@POSIX
def test_the_folder_is_the_users_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder = private_folder("cache", "the usual one cannot be written to")
    assert folder is not None
    assert folder == tmp_path / f"cache-{os.getuid()}"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert capsys.readouterr().err == f"note: the usual one cannot be written to; {folder} is used\n"
    folder.chmod(0o777)  # others could put code into it
    assert private_folder("cache", "") is None
    folder.rmdir()
    folder.symlink_to(tmp_path)
    assert private_folder("cache", "") is None
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert private_folder("cache", "") is None


PROGRAM = "from shaper_fmu.master.arithmetic import arithmetic_mode; from numba.core import config; print(config.CACHE_DIR)"


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0 or not shutil.which("setpriv"), reason="needs another user")
def test_another_user_without_a_home_runs_the_compiled_loop(tmp_path):
    """It can read everything here, but write to nothing."""
    tmp_path.chmod(0o777)
    for folder in tmp_path.parents[:2]:
        folder.chmod(0o755)
    user = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--inh-caps=-all,+dac_read_search"]
    done = subprocess.run(
        [*user, "--ambient-caps=-all,+dac_read_search", sys.executable, "-c", PROGRAM],
        capture_output=True, text=True, check=False, cwd=Path(__file__).parents[1],
        env={**os.environ, "HOME": "/nonexistent", "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{tmp_path}/shaper-fmu-numba-65534\n"
    assert "compiled code can be kept neither beside shaper-fmu nor in the user's cache folder" in done.stderr
