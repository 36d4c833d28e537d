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


PROGRAM = """
from shaper_fmu.export.cache import cache_folder
from shaper_fmu.master.loop_library import loop
loop()
print(cache_folder())
"""
NO_HOME: dict[str, str | None] = {"HOME": "/nonexistent", "SHAPER_FMU_CACHE": None}
OTHER = r"note: the user's cache folder cannot be written to \(SHAPER_FMU_CACHE names another\)"


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


@pytest.mark.representatives(home=["/nonexistent", None])
@OTHER_USER
@pytest.mark.parametrize("home", ["/nonexistent", "", None, "/"])
def test_another_user_without_a_home_has_the_loop_compiled_once(nobodys, home):
    """ziglang keeps what it needs in the home, too; then another compiler serves."""
    for _ in range(2):
        done = as_nobody(PROGRAM, {**NO_HOME, "HOME": home, "XDG_CACHE_HOME": None, "TMPDIR": str(nobodys)})
        assert done.returncode == 0, done.stderr
        assert done.stdout == f"{nobodys}/shaper-fmu-cache-65534\n"
        assert re.fullmatch(f"{OTHER}; {nobodys}/shaper-fmu-cache-65534 is used\n", done.stderr)
    made = [path for path in (nobodys / "shaper-fmu-cache-65534" / "loop").iterdir() if path.suffix != ".lock"]
    assert len(made) == 1


@OTHER_USER
@pytest.mark.parametrize("kind", ["missing", "not theirs"])
def test_a_folder_for_temporary_files_that_cannot_be_used_is_not(tmp_path, kind):
    """Python's rule: the next of /tmp, /var/tmp, ... is used."""
    done = as_nobody(PROGRAM, {**NO_HOME, "TMPDIR": str(tmp_path / "missing") if kind == "missing" else str(tmp_path)})
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"/(tmp|var/tmp|usr/tmp)/shaper-fmu-cache-65534\n", done.stdout)
    assert done.stderr.count("\n") == 1


@OTHER_USER
def test_without_any_folder_an_error_names_the_variables(fmus):
    nowhere = "import tempfile; tempfile.tempdir = '/nonexistent'; "
    done = as_nobody(nowhere + PROGRAM.replace("\n", "; ").strip("; "), NO_HOME)
    assert done.returncode == 1
    assert "the cache folder /nonexistent/.cache/shaper-fmu cannot be made" in done.stderr
    assert "set SHAPER_FMU_CACHE to another" in done.stderr
    done = as_nobody(
        nowhere + "from shaper_fmu.master.fmu import load_fmu; load_fmu(" + repr(str(fmus / "MassSpringDamper.fmu")) + ")", NO_HOME
    )
    assert (
        "ModelError: MassSpringDamper.fmu cannot be unpacked: No such file or directory; TMPDIR names another folder" in done.stderr
    )
