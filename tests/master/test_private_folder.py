"""Caches where nothing else can be written to: a folder of the user's own among the temporary files, and nobody else's."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
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
NO_HOME: dict[str, str | None] = {"HOME": "/nonexistent", "NUMBA_CACHE_DIR": ""}
NEITHER = "compiled code can be kept neither beside shaper-fmu nor in the user's cache folder"


@pytest.fixture
def nobodys(tmp_path) -> Path:
    """A folder for everybody."""
    tmp_path.chmod(0o777)
    for folder in tmp_path.parents[:2]:
        folder.chmod(0o755)
    return tmp_path


def as_nobody(program: str, environment: Mapping[str, str | None], cwd: Path | str = "/") -> subprocess.CompletedProcess[str]:
    """What another user's Python says, who can read everything here, but write to nothing; None is what is not set at all."""
    user = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--inh-caps=-all,+dac_read_search"]
    known = {name: value for name, value in {**os.environ, **environment}.items() if value is not None}
    root = Path(__file__).parents[2]
    return subprocess.run(
        [*user, "--ambient-caps=-all,+dac_read_search", sys.executable, "-c", program],
        capture_output=True, text=True, check=False, cwd=cwd, env={**known, "PYTHONPATH": str(root)},
    )  # fmt: skip


OTHER_USER = pytest.mark.skipif(
    sys.platform != "linux" or os.geteuid() != 0 or not shutil.which("setpriv"), reason="needs another user"
)


@OTHER_USER
@pytest.mark.parametrize(
    ("home", "cache"),
    [
        ("/nonexistent", None),
        ("", None),
        (None, None),
        ("/", None),
        (None, ""),
        ("/nonexistent", "/nonexistent/numba"),
        (None, "/"),
    ],
)
def test_another_user_without_a_home_runs_the_compiled_loop(nobodys, home, cache):
    done = as_nobody(PROGRAM, {"HOME": home, "XDG_CACHE_HOME": None, "NUMBA_CACHE_DIR": cache, "TMPDIR": str(nobodys)})
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{nobodys}/shaper-fmu-numba-65534\n"
    words = f"compiled code cannot be kept in {cache}: NUMBA_CACHE_DIR cannot be written to" if cache else NEITHER
    assert re.fullmatch(rf"note: {words}.*; {nobodys}/shaper-fmu-numba-65534 is used\n", done.stderr)


@OTHER_USER
@pytest.mark.parametrize("kind", ["missing", "not theirs"])
def test_a_folder_for_temporary_files_that_cannot_be_used_is_not(tmp_path, kind):
    """Python's rule: the next of /tmp, /var/tmp, ... is used."""
    done = as_nobody(PROGRAM, {**NO_HOME, "TMPDIR": str(tmp_path / "missing") if kind == "missing" else str(tmp_path)})
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"/(tmp|var/tmp|usr/tmp)/shaper-fmu-numba-65534\n", done.stdout)
    assert done.stderr.count("\n") == 1


@OTHER_USER
def test_without_any_folder_the_loop_is_compiled_each_time(fmus):
    """And what must be unpacked is refused in words."""
    nowhere = "import tempfile; tempfile.tempdir = '/nonexistent'; "
    done = as_nobody(nowhere + PROGRAM, NO_HOME)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith(f"note: {NEITHER} (NUMBA_CACHE_DIR names another): the loop is compiled anew each time")
    assert done.stderr.count("\n") == 1
    done = as_nobody(
        nowhere + "from shaper_fmu.master.fmu import load_fmu; load_fmu(" + repr(str(fmus / "MassSpringDamper.fmu")) + ")", NO_HOME
    )
    assert (
        "ModelError: MassSpringDamper.fmu cannot be unpacked: No such file or directory; TMPDIR names another folder" in done.stderr
    )
