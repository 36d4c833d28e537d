"""The cache of compiled files, whose names are hashes of everything that they are made from.

The folder is the user's cache folder, or what the environment variable SHAPER_FMU_CACHE names. It may be deleted at any time.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

from shaper_fmu.archives import write_file
from shaper_fmu.errors import BuildError
from shaper_fmu.private_folder import private_folder


def cache_folder() -> Path:
    """The folder of the cache; made if it is missing. Raises BuildError if it cannot be."""
    folder = Path(os.environ.get("SHAPER_FMU_CACHE") or user_cache_path("shaper-fmu"))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, "it cannot be written to")
    except OSError as error:
        other = None if os.environ.get("SHAPER_FMU_CACHE") else _other_folder()
        if other is not None:
            return other
        raise BuildError(f"the cache folder {folder} cannot be made ({error.strerror}); set SHAPER_FMU_CACHE to another") from error
    return folder.resolve()


@lru_cache
def _other_folder() -> Path | None:
    return private_folder("shaper-fmu-cache", "the user's cache folder cannot be written to (SHAPER_FMU_CACHE names another)")


def digest(*parts: str | bytes) -> str:
    """A name that is a hash of these parts."""
    found = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        found.update(len(data).to_bytes(8, "big") + data)
    return found.hexdigest()[:32]


def cached(kind: str, key: str, make: Callable[[], bytes]) -> Path:
    """The file of this kind and key; it is made if it does not exist. Processes that want the same file wait for the first one."""
    path = cache_folder() / kind / key
    if path.is_file():
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(path.with_name(f"{path.name}.lock")):
        if not path.is_file():
            write_file(path, make())
    return path
